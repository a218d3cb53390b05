"""Counts of cycles at several damping ratios, on one friction path or without scatter, and the time in stick-slip."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.motion import DEFAULTS, FrictionPath, Motion, MotionOptions, simulate
from roughslip.oscillator.states import longest_slip, states_of
from roughslip.validation import gate


@dataclass(frozen=True)
class Counts:
    """Counts of the motions on one friction path at several damping ratios.

    damping_ratios : (dampings,) [-]
    cycles, micro_slips : (dampings,)
    last_cycle : (dampings,) [-] natural periods until the last cycle ends, 0 where there is none
    stick_slip : (dampings,) [-] share of the time in either state that is stick-slip; NaN where the run reaches no
        state, and with excitation
    cuts : (dampings,) of negative friction, as in Motion
    steps, evaluations : in all, as in Motion
    """

    damping_ratios: np.ndarray
    cycles: np.ndarray
    micro_slips: np.ndarray
    last_cycle: np.ndarray
    stick_slip: np.ndarray
    cuts: np.ndarray
    steps: int
    evaluations: int


@gate
def ensemble_counts(
    oscillator: Oscillator,
    law: FrictionLaw,
    path: FrictionPath,
    spacing_m: float,
    duration_periods: float,
    damping_ratios: Sequence[float] | np.ndarray,
    options: MotionOptions = DEFAULTS,
) -> Counts:
    """Counts of one realisation of the friction at several damping ratios, which replace that of the oscillator.

    damping_ratios : (dampings,) [-] each >= 0; the other arguments and the errors as in `simulate`, but an iterable
        path must start again for each
    """
    ratios = np.atleast_1d(np.asarray(damping_ratios, dtype=np.float64))
    belts = [replace(oscillator, damping_ratio=float(ratio)) for ratio in ratios]
    motions = [simulate(belt, law, path, spacing_m, duration_periods, options) for belt in belts]
    return Counts(
        damping_ratios=ratios,
        cycles=np.array([motion.cycles for motion in motions]),
        micro_slips=np.array([motion.micro_slips for motion in motions]),
        last_cycle=np.array([motion.last_cycle for motion in motions]),
        stick_slip=np.array([_share(belt, law, motion) for belt, motion in zip(belts, motions, strict=True)]),
        cuts=np.array([motion.cuts for motion in motions]),
        steps=sum(motion.steps for motion in motions),
        evaluations=sum(motion.evaluations for motion in motions),
    )


def _share(oscillator: Oscillator, law: FrictionLaw, motion: Motion) -> float:
    """Share of stick-slip in a motion; NaN where the states are not defined."""
    if oscillator.q > 0.0 or oscillator.V == 0.0:
        return math.nan
    return states_of(motion, longest_slip(oscillator, law)).share()
