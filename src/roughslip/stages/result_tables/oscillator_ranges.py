"""Ranges of the inputs of the oscillator without scatter over which its cycle and its stability stay the same."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import numpy as np

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_law import FrictionLaw
from roughslip.oscillator.limits import hopf_damping, limit_cycle
from roughslip.verdicts.bracket import REACH, end

PARAMETERS = ("mass_kg", "belt_velocity_m_per_s")
TOLERANCE = 1e-9  # of a slip phase; ends of ranges have 1e-6
LONGEST = 5.0  # natural periods of a cycle: then a run that cycles shows one in its closing ten

TITLES = {
    "cycle_range": "factor of the input at which the stick-slip cycle begins or ceases to exist at the scene's damping",
    "unstable_range": "factor of the input at which steady sliding gains or loses stability at the scene's damping",
    "sides_range": "factor of the input at which the list of damping ratios comes to lie on one side of the limit, "
    "or on both",
}


def cycle_period(oscillator: Oscillator, law: FrictionLaw) -> float | None:
    """Natural periods of the stick-slip cycle at the oscillator's own damping ratio.

    Infinite where there is none, None where slip is too stiff to decide.
    """
    try:
        return limit_cycle(oscillator, law, TOLERANCE).period / (2.0 * math.pi)
    except IllPosedError:
        return math.inf
    except ConvergenceError:
        return None


def range_variables(belt: Oscillator, law: FrictionLaw, dampings: Sequence[float]) -> dict[str, store.Variable]:
    """Ranges of mass and belt velocity, each alone, as factors of the scene's value, without scatter.

    dampings : the list of damping ratios, ascending

    Each variable is (parameter, 2, 2): lower and upper end, up to where it is as in the scene and from where it is
    not; NaN where nothing changes within a factor of ten, or where an excited oscillator, or a belt at rest, has none.
    """

    def cycle(oscillator: Oscillator) -> Hashable:
        period = cycle_period(oscillator, law)
        return None if period is None or LONGEST < period < math.inf else period < math.inf

    def unstable(oscillator: Oscillator) -> Hashable:
        return oscillator.damping_ratio < hopf_damping(oscillator, law)

    def sides(oscillator: Oscillator) -> Hashable:
        least, most = (
            cycle_period(replace(oscillator, damping_ratio=ratio), law) for ratio in (dampings[0], dampings[-1])
        )
        return None if least is None or most is None else (least < math.inf, most < math.inf)

    free = belt.q == 0.0 and belt.V > 0.0
    answers = dict(zip(TITLES, (cycle, unstable, sides), strict=True))
    variables = {"parameter": store.Variable(("parameter",), np.array(PARAMETERS), "1", "input of the oscillator")}
    for name, answer in answers.items():
        ends = [_ends(belt, parameter, answer) if free else np.full((2, 2), np.nan) for parameter in PARAMETERS]
        variables[name] = store.Variable(("parameter", "end", "side"), np.array(ends), "1", TITLES[name])
    return variables


def _ends(belt: Oscillator, parameter: str, answer: Callable[[Oscillator], Hashable | None]) -> np.ndarray:
    """(2, 2) lower and upper end: the last factor with the answer of the scene, the first with another one."""
    value = getattr(belt, parameter)

    def of_factor(factor: float) -> Hashable | None:
        return answer(replace(belt, **{parameter: factor * value}))

    if of_factor(1.0) is None:
        return np.full((2, 2), np.nan)
    found = [end(of_factor, 1.0, reach) for reach in (1.0 / REACH, REACH)]
    return np.array([[one.stands, np.nan if one.changes is None else one.changes] for one in found])
