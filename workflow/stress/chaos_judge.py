"""The judge of expansions: their polynomials evaluated anew at fresh points, beside the function itself."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import chi2

from roughslip.chaos.expansion import Expansion
from workflow.stress.chaos_problem import Problem, product_terms
from workflow.stress.outcomes import Verdict

FRESH = 4000
RISK = 1e-6


def diagnose(problem: Problem, found: Expansion) -> dict:
    rng = np.random.default_rng([problem.number, 7])
    points = problem.fresh(rng, FRESH)
    own = product_terms(found.basis.families, found.basis.indices, points) @ found.fit.coefficients
    truth = problem.truth(points)
    sq = (own - truth) ** 2
    w = np.ones(len(problem.target)) if problem.weights is None else problem.weights
    pts = np.round(problem.points / 1e-5)
    _, first, inverse = np.unique(pts, axis=0, return_index=True, return_inverse=True)
    n = len(first)
    q = 1 - RISK ** (1 / n)
    keep = int(np.ceil((1 - q) * FRESH))
    trim = float(np.sum(np.sort(sq)[:keep]) / FRESH) + problem.noise**2
    y = problem.target
    mean = np.average(y, weights=w)
    variance = float(np.average((y - mean) ** 2, weights=w))
    const = float(np.mean((mean - truth) ** 2)) + problem.noise**2
    return {
        "e": float(sq.mean()) + problem.noise**2,
        "trim": trim,
        "const": const,
        "med": float(np.median(sq)),
        "var": variance,
        "distinct": n,
        "max": float(np.abs(y).max()),
        "cond": found.fit.condition_number,
    }
