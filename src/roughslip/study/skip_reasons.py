"""What stages did not compute, and why: the names under which the record of a job counts it.

A name says what was not computed, and behind the colon why the result is the same without it.
"""

import math

import numpy as np

NO_CONTACT = "solves: no contact"

NODES_BELOW = "solves: the nodes asked for lie below the plane"
NODES_KNOWN = "solves to the tolerance: bounds give the pressures asked for"

SYMMETRIC = "terms: forbidden by symmetry"
TURNED = "rows: half a turn takes them into fitted ones"
SMOOTH = "columns: the expansion is smooth"
STICK = "stick phases integrated: their end is known from the friction path"
KEPT = "friction paths: kept for other runs"
BETWEEN = "runs: the probability is smooth between the points"
UNREAD = "nodes of friction paths: slip came to its end before them"


def forbidden_terms(kept: np.ndarray, degree: int) -> int:
    """Terms of a total degree that a basis leaves out. kept : (terms, variables) exponents"""
    return math.comb(kept.shape[1] + degree, degree) - len(kept)
