"""What the benchmark of skips shares: one thing that is not computed, and the same problem with it computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Call = Callable[[], tuple[Any, int]]  # the result, and its natural count of work


@dataclass(frozen=True)
class Skip:
    """One way in which the code leaves something out.

    told : what and why, as costs.json counts it
    problem : what both solve, without blanks
    tolerance : of the difference; 0 where the result is the same to the bit
    skipping, plain : the problem as the code solves it, and with everything computed
    difference : of the two results, relative
    """

    told: str
    problem: str
    tolerance: float
    skipping: Call
    plain: Call
    difference: Callable[[Any, Any], float]
