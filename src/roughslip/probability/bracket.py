"""The range of a number over which an answer stays the same: a search outwards in steps, then bisection."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from roughslip.errors import ParameterError, real

REACH = 10.0
STEPS = 24  # to REACH: 10 % apart
ACCURACY = 1e-6  # relative, of an end

Answer = Callable[[float], Hashable | None]


@dataclass(frozen=True)
class End:
    """One end of a range.

    last_same : the farthest value up to which the answer is known to be the same
    first_different : the nearest one beyond whose answer is known to be another; None where there is none within reach
    """

    last_same: float
    first_different: float | None


def range_end(answer: Answer, start: float, reach: float, accuracy: float = ACCURACY) -> End:
    """The end of the range around `start` towards `reach`, both positive.

    answer : of a value; None where it is unknown
    accuracy : relative, of both numbers of the end

    Between two steps an answer is taken to change once at most. Raises ParameterError where the answer at the start
    is unknown, or where start and reach are not finite and positive.
    """
    if not all(math.isfinite(value) and value > 0.0 for value in (real("start", start), real("reach", reach))):
        raise ParameterError(f"a range is searched between finite positive numbers, not from {start} to {reach}")
    own = answer(start)
    if own is None:
        raise ParameterError(f"the answer at the start value {start:g} is unknown, so no range begins there")
    values = [start, *(float(value) for value in np.geomspace(start, reach, STEPS + 1)[1:])]
    last_same, left = start, True
    for before, value in pairwise(values):
        here = answer(value)
        if left and here != own:
            last_same, _ = _bisected(lambda trial: answer(trial) == own, before, value, accuracy)
            left = False
        if here not in (None, own):
            return End(last_same, _bisected(lambda trial: answer(trial) in (None, own), before, value, accuracy)[1])
    return End(values[-1] if left else last_same, None)


def _bisected(holds: Callable[[float], bool], inside: float, outside: float, accuracy: float) -> tuple[float, float]:
    """Two numbers next to each other, of which the first holds and the second does not, as `inside` and `outside`."""
    while abs(outside / inside - 1.0) > accuracy:
        middle = math.sqrt(inside * outside)
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside, outside
