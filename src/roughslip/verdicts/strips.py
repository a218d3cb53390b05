"""How many strips decide the statements on friction.

Intervals narrow by 1 / sqrt(n) around the numbers as they are, and the rules judge them.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from functools import cache

import numpy as np

from roughslip.verdicts.finding import Arrays, Bounds, Finding, judged

STEP = 1.1  # of one number of strips over the one before
STEPS = 72  # to a thousand times the strips


def with_more_samples(arrays: Arrays, factor: float) -> dict[str, np.ndarray]:
    """Results of so many times the samples, in first order: the same numbers, their intervals over sqrt(factor)."""
    foreseen = dict(arrays)
    for name in (name for name in arrays if f"{name}_low" in arrays):
        for close in (f"{name}_low", f"{name}_high"):
            foreseen[close] = arrays[name] + (arrays[close] - arrays[name]) / np.sqrt(factor)
    return foreseen


def _is_settled(finding: Finding | None) -> bool:
    """Whether a statement is decided, or lies on its threshold, or cannot be tested."""
    if finding is None or not np.isfinite([finding.ours, *finding.interval]).all():
        return True
    if finding.contradicts or finding.holds(finding.interval):
        return True
    return any(number.near_threshold is not None for number in (finding, finding.other) if number is not None)


def factors_to_settle(arrays: Arrays, rules: Mapping[str, Bounds]) -> dict[str, float]:
    """By statement the least of 1, STEP, STEP^2, ... times the strips that decide it; STEP^STEPS where none does.

    Intervals of more strips lie within those of fewer, so that a decided statement stays so.
    """
    at = cache(lambda power: with_more_samples(arrays, STEP**power))

    def minimum(rule: Bounds) -> int:
        if _is_settled(judged(arrays, rule)):
            return 0
        return bisect_left(range(STEPS), True, lo=1, key=lambda power: _is_settled(judged(at(power), rule)))

    return {name: STEP ** minimum(rule) for name, rule in rules.items()}


def strips_that_decide(friction: Arrays, strips: int, rules: Mapping[str, Bounds]) -> dict[str, int]:
    """Strips that would decide each statement that is undecided off its threshold, its numbers as they are."""
    factors = factors_to_settle(friction, rules)
    return {name: math.ceil(strips * times) for name, times in factors.items() if 1.0 < times < STEP**STEPS}
