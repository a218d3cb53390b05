"""Counts without scatter from one cycle: as every departure is the same point, every cycle is the first one again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from roughslip.errors import ParameterError
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.law import FrictionLaw
from roughslip.oscillator.motion import Counts, Motion, simulate
from roughslip.oscillator.system import Oscillator

LOOPS = 3.0  # natural periods of a damped oscillator within which slip that will stick again has done so


def counts_by_period(
    oscillator: Oscillator,
    law: FrictionLaw,
    duration_periods: float,
    damping_ratios: Sequence[float] | np.ndarray,
    tolerance: float = 1e-9,
    integrator: str = "fehlberg45",
) -> Counts:
    """Cycles and micro-slips of the free oscillator without scatter, as `ensemble_counts` gives them without a path.

    Every run ends with its second departure, or with a slip whose first loop misses the belt: the next loops lie within
    it, because trajectories of the plane do not cross. What follows is counted by the period of the cycle. Raises
    ParameterError with excitation, and as `simulate` does.
    """
    if oscillator.q > 0.0:
        raise ParameterError("with excitation no cycle repeats the last: count them one by one")
    ratios = np.atleast_1d(np.asarray(damping_ratios, dtype=np.float64))
    found = [
        _of_one(replace(oscillator, damping_ratio=float(ratio)), law, duration_periods, tolerance, integrator)
        for ratio in ratios
    ]
    motions, cycles, micro_slips, last = zip(*found, strict=True)
    return Counts(
        damping_ratios=ratios,
        cycles=np.array(cycles),
        micro_slips=np.array(micro_slips),
        last_cycle=np.array(last),
        cuts=np.zeros(ratios.size, dtype=np.int64),
        steps=sum(motion.steps for motion in motions),
        evaluations=sum(motion.evaluations for motion in motions),
        periods=sum(motion.duration for motion in motions) / (2.0 * math.pi),
    )


def _of_one(
    oscillator: Oscillator, law: FrictionLaw, periods: float, tolerance: float, integrator: str
) -> tuple[Motion, int, int, float]:
    """The motion up to the second departure at most, cycles, micro-slips and the end of the last cycle [periods]."""
    depart = max(oscillator.F * law.static - 2.0 * oscillator.damping_ratio * oscillator.V, 0.0)
    first = math.inf if oscillator.V == 0.0 else depart / oscillator.V / (2.0 * math.pi)
    loop = LOOPS / math.sqrt(max(1.0 - oscillator.damping_ratio**2, 0.01))
    motion = simulate(oscillator, law, None, 0.0, min(periods, first + loop), tolerance, integrator=integrator)
    back = np.flatnonzero(motion.kind == REATTACHMENT)
    if back.size == 0:
        return motion, 0, 0, 0.0
    leave, again = motion.time[motion.kind == DEPARTURE][0], motion.time[back[0]]
    # stick lasts from where the mass has stuck again to the point of departure
    period = again - leave + (depart - motion.position[back[0]]) / oscillator.V
    count = math.floor((2.0 * math.pi * periods - again) / period) + 1
    if not motion.backwards[back[0]]:
        return motion, 0, count, 0.0
    return motion, count, 0, (again + (count - 1) * period) / (2.0 * math.pi)
