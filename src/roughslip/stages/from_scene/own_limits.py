"""Damping ratios and ranges of parameters that follow from the limits of the scene's own oscillator."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.limits import hopf_damping, limits_or_nan
from roughslip.scene.fields import AUTO, unless_auto
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers
from roughslip.stages.from_scene.variation import PARAMETERS, System

BELOW, NEAR, ABOVE = 5, 12, 3
REACH = 3.0  # standard deviations of the limit
FACTOR = 4.0  # of a range around the scene's own value


def damping_ratios(scene: Scene, numbers: FrictionNumbers, statistics: Path | None) -> tuple[float, ...]:
    """The damping ratios of figure5: as given, or where auto around the limits of the scene without excitation.

    They go from a fifth of the smaller limit to 1.25 of the larger one, or as far as the scatter of friction moves the
    existence limit: NEAR of them where it moves it, BELOW and ABOVE of them on either side. It reads the sections
    `oscillator` and `ensemble`. Raises IllPosedError where the law has no limits.

    statistics : the file of the friction, if any
    """
    if (given := unless_auto(scene.ensemble.damping_ratios)) is not None:
        return given
    free = replace(mass_on_belt.oscillator(scene), excitation_force_n=0.0)
    law = mass_on_belt.law(scene, numbers.mean)
    try:
        response, scatter = mass_on_belt.response_of_limit(scene, free, numbers, statistics)
    except (ParameterError, IllPosedError, ConvergenceError) as error:
        raise IllPosedError(
            f"ensemble.damping_ratios = {AUTO} takes a list around the limits of the stick-slip cycle, which the "
            f"oscillator does not have ({error}); give a list"
        ) from error
    deviation = numbers.standard_deviation / math.sqrt(mass_on_belt.independent_windows(scene, statistics))
    limit, hopf = response.limit, max(hopf_damping(free, law), 0.0)
    moved = REACH * scatter * deviation
    first = 0.2 * (min(limit, hopf) or limit)
    last = max(1.25 * max(limit, hopf), limit + moved)
    near = np.linspace(max(limit - moved, first), limit + moved, NEAR)
    below, above = np.linspace(first, near[0], BELOW + 1)[:-1], np.linspace(near[-1], last, ABOVE + 1)[1:]
    return tuple(np.unique(np.concatenate([below, near, above])).tolist())


def own_range(name: str, own: System) -> tuple[float, float]:
    """First and last value of a parameter of `variation.PARAMETERS`: a factor of FACTOR around that of the scene.

    Damping ratios also reach half of the smaller limit of the scene and twice the larger one, where it has limits.
    """
    value = PARAMETERS[name].value(own)
    values = [value / FACTOR, value * FACTOR] if value > 0.0 else []
    if name == "damping":
        limits = [limit for limit in limits_or_nan(own.belt, own.law) if limit > 0.0]
        values += [factor * limit for limit in limits for factor in (0.5, 2.0)]
        values = values or [0.01, 1.0]
    return max(min(values), 1.0) if name == "windows" else min(values), max(values)
