"""What contact solves left out, counted one by one."""

from __future__ import annotations

from collections import Counter

import numpy as np

from roughslip.contact.influence import DIRECT_SUM_LIMIT
from roughslip.contact.solve import ContactSolution
from roughslip.stages.runtime import skip_reasons


def nothing_yet() -> Counter[str]:
    """Zero of everything that contact solves may leave out, so that a record also tells what never occurred."""
    return Counter(dict.fromkeys(skip_reasons.OF_SOLVES, 0))


def count_solve(counts: Counter[str], solution: ContactSolution) -> None:
    """Add to the counts of OF_SOLVES what a solve left out."""
    if solution.method == "none":
        counts[skip_reasons.NO_CONTACT] += 1
        return
    left = solution.pressure.size - solution.nodes
    if solution.method == "dense":
        counts[skip_reasons.BELOW] += left
        counts[skip_reasons.SUMMED] += int(np.count_nonzero(solution.pressure)) <= DIRECT_SUM_LIMIT
    else:
        counts[skip_reasons.CROPPED] += left
        counts[skip_reasons.WARM] += solution.start == "given"
        counts[skip_reasons.NESTED] += solution.start == "nested"
