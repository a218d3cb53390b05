"""What contact solves left out, counted one by one."""

from __future__ import annotations

from collections import Counter

import numpy as np

from roughslip.contact.influence import DIRECT_SUM_LIMIT
from roughslip.contact.solve import ContactSolution
from roughslip.stages import left_out


def nothing_yet() -> Counter[str]:
    """Zero of everything that contact solves may leave out, so that a record also tells what never occurred."""
    return Counter(dict.fromkeys(left_out.OF_SOLVES, 0))


def count_solve(counts: Counter[str], solution: ContactSolution) -> None:
    """Add to the counts of OF_SOLVES what a solve left out."""
    if solution.method == "none":
        counts[left_out.NO_CONTACT] += 1
        return
    left = solution.pressure.size - solution.nodes
    if solution.method == "dense":
        counts[left_out.BELOW] += left
        counts[left_out.SUMMED] += int(np.count_nonzero(solution.pressure)) <= DIRECT_SUM_LIMIT
    else:
        counts[left_out.CROPPED] += left
        counts[left_out.WARM] += solution.start == "given"
        counts[left_out.NESTED] += solution.start == "nested"
