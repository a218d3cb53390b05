"""Counts of cycles at several damping ratios, on one friction path or without scatter, and the time in stick-slip."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import departure_point, slip_loop
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
    periods : natural periods followed in all
    """

    damping_ratios: np.ndarray
    cycles: np.ndarray
    micro_slips: np.ndarray
    last_cycle: np.ndarray
    stick_slip: np.ndarray
    cuts: np.ndarray
    steps: int
    evaluations: int
    periods: float


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
        periods=duration_periods * ratios.size,
    )


def _share(oscillator: Oscillator, law: FrictionLaw, motion: Motion) -> float:
    """Share of stick-slip in a motion; NaN where the states are not defined."""
    if oscillator.q > 0.0 or oscillator.V == 0.0:
        return math.nan
    return states_of(motion, longest_slip(oscillator, law)).share()


@gate
def counts_by_period(
    oscillator: Oscillator,
    law: FrictionLaw,
    duration_periods: float,
    damping_ratios: Sequence[float] | np.ndarray,
    options: MotionOptions = DEFAULTS,
) -> Counts:
    """Cycles and micro-slips of the free oscillator without scatter, as `ensemble_counts` gives them without a path.

    Every run ends with its second departure, or with a slip whose first loop misses the belt. The next loops lie within
    that loop, because trajectories of the plane do not cross. The period of the cycle gives the other counts. Raises
    ParameterError with excitation, and as `simulate` does.
    """
    if oscillator.q > 0.0:
        raise ParameterError(
            f"an excitation of {oscillator.excitation_force_n:g} N does not let cycles repeat: count them by "
            "ensemble_counts, or without excitation; scene key: oscillator.excitation_force_n"
        )
    ratios = np.atleast_1d(np.asarray(damping_ratios, dtype=np.float64))
    runs = [
        _of_one(replace(oscillator, damping_ratio=float(ratio)), law, duration_periods, options) for ratio in ratios
    ]
    motions, cycles, micro_slips, last = zip(*runs, strict=True)
    return Counts(
        damping_ratios=ratios,
        cycles=np.array(cycles),
        micro_slips=np.array(micro_slips),
        last_cycle=np.array(last),
        stick_slip=np.where(
            np.array(cycles) > 0, 1.0, np.where([motion.kind.size > 0 for motion in motions], 0.0, np.nan)
        ),
        cuts=np.zeros(ratios.size, dtype=np.int64),
        steps=sum(motion.steps for motion in motions),
        evaluations=sum(motion.evaluations for motion in motions),
        periods=sum(motion.duration for motion in motions) / (2.0 * math.pi),
    )


def _of_one(
    oscillator: Oscillator, law: FrictionLaw, periods: float, options: MotionOptions
) -> tuple[Motion, int, int, float]:
    """The motion up to the second departure at most, cycles, micro-slips and the end of the last cycle [periods]."""
    turn, belt_moves = 2.0 * math.pi, oscillator.V > 0.0
    depart = max(departure_point(oscillator, law), 0.0)
    first = depart / oscillator.V / turn if belt_moves else math.inf
    loop = slip_loop(oscillator, law).periods if belt_moves else 0.0
    motion = simulate(oscillator, law, None, 0.0, min(periods, first + 1.1 * loop + 1.0), options)
    back = np.flatnonzero(motion.kind == REATTACHMENT)
    if back.size == 0:
        return motion, 0, 0, 0.0
    leave, again = motion.time[motion.kind == DEPARTURE][0], motion.time[back[0]]
    # stick lasts from where the mass has stuck again to the point of departure
    period = again - leave + (depart - motion.position[back[0]]) / oscillator.V
    count = math.floor((turn * periods - again) / period) + 1
    if not motion.backwards[back[0]]:
        return motion, 0, count, 0.0
    return motion, count, 0, (again + (count - 1) * period) / turn
