"""The deterministic motion: steady sliding, the stick-slip cycle, its limits in damping, and its counts of cycles.

All functions are for the free oscillator (Q = 0) with its mean friction (mu_S = 0). With the peak a of X' / V a cycle
without stick belongs to one damping ratio D(a) at most (`oscillator.return_map`). As mu_D''' < 0 in eq. (13), the
equilibrium loses its stability by a subcritical bifurcation at D(0), the Hopf damping. Above it a repelling cycle
separates the equilibrium from stick-slip. This cycle grows with D until it grazes the belt at D(1), the existence limit
(H. Hetzler, D. Schwarzer & W. Seemann, Commun. Nonlinear Sci. Numer. Simul. 12 (2007) 83).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.friction_law import FrictionLaw
from roughslip.oscillator.motion import DEFAULTS, Counts, Motion, MotionOptions, simulate
from roughslip.oscillator.return_map import TOLERANCE, check_free, falling_root, slip_flow, turn_from

LOOPS = 3.0  # natural periods of a damped oscillator within which slip that will stick again has done so
LOOP_PERIODS = 4.0  # the first loop of slip takes 1 / sqrt(1 - D^2) natural periods and a little


@dataclass(frozen=True)
class LimitCycle:
    """The deterministic stick-slip cycle.

    departure, reattachment : [m] X at the end and at the start of stick
    slip_duration, period : [-] in tau = omega t
    slipped_distance : [m] a cycle
    local_error : [m] sum of the error estimates of a slip phase
    """

    departure: float
    reattachment: float
    slip_duration: float
    period: float
    slipped_distance: float
    local_error: float


def equilibrium(oscillator: Oscillator, law: FrictionLaw) -> float:
    """X [m] of steady sliding: F mu_D(v0)."""
    return slip_flow(oscillator, law).steady


def hopf_damping(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The damping ratio below which steady sliding is unstable: -mu_D'(v0) N / (2 m omega).

    From X'' + (2 D + F omega mu_D'(v0)) X' + X = 0 about the equilibrium; negative where friction rises with speed.
    """
    check_free(oscillator)
    slope = float(law.slope(oscillator.belt_velocity_m_per_s))
    return -0.5 * oscillator.F * oscillator.natural_frequency_rad_per_s * slope


def limit_cycle(oscillator: Oscillator, law: FrictionLaw, tolerance: float = 1e-11) -> LimitCycle:
    """The stick-slip cycle: one slip phase from the departure point, and the stick line back to it.

    Every departure is the same point (F static - 2 D V, V), so the first return is the cycle. Where the first loop of
    slip passes below X' = V it spirals inwards, because trajectories of the plane do not cross, and no cycle exists.

    Raises IllPosedError where the mass does not stick again; ParameterError with excitation.
    """
    check_free(oscillator)
    departure = oscillator.F * law.static - 2.0 * oscillator.damping_ratio * oscillator.V
    motion = simulate(oscillator, law, None, 0.0, LOOP_PERIODS, MotionOptions(tolerance), start_position_m=departure)
    ends = np.flatnonzero(motion.kind == REATTACHMENT)
    if ends.size == 0:
        raise IllPosedError(
            f"no stick-slip cycle at the damping ratio {oscillator.damping_ratio:.6g}: the mass does not stick again; "
            f"lower the damping (see existence_limit)"
        )
    first = ends[0]
    slip_duration = float(motion.time[first] - motion.time[0])
    reattachment = float(motion.position[first])
    return LimitCycle(
        departure=departure,
        reattachment=reattachment,
        slip_duration=slip_duration,
        period=slip_duration + (departure - reattachment) / oscillator.V,
        slipped_distance=float(motion.slipped_distance[first]),
        local_error=motion.local_error,
    )


def existence_limit(
    oscillator: Oscillator, law: FrictionLaw, accuracy: float = 1e-10, tolerance: float = TOLERANCE
) -> float:
    """The damping ratio above which the stick-slip cycle does not exist, for any damping ratio of the oscillator.

    accuracy : [-] of the result, 1e-12 to 1
    tolerance : [-] of the slip phases

    At the limit the first loop of slip from the departure point only grazes the belt: its next peak, which falls with
    D, is 1. The departure point is y = (F / V) (static - mu_D(v0)) - 2 D and w = 1. Where friction at vanishing speed
    is the limit of stick, departure is the grazing point, and the stick-slip cycle has shrunk to a cycle of slip alone.

    Raises IllPosedError where there is no cycle without damping either, ConvergenceError where there is one at any
    damping or slip is too stiff.
    """
    if not (math.isfinite(accuracy) and 1e-12 <= accuracy < 1.0):
        raise ParameterError(f"the accuracy must lie in 1e-12 to 1, not {accuracy}")
    flow = slip_flow(oscillator, law)
    departure = (oscillator.F * law.static - flow.steady) / oscillator.V

    def excess(ratio: float) -> float:
        return turn_from(replace(flow, damping_ratio=ratio), departure - 2.0 * ratio, 1.0, tolerance).peak - 1.0

    limit = falling_root(excess, hopf_damping(oscillator, law), accuracy)
    if limit is None:
        raise IllPosedError("no stick-slip cycle even without damping: friction must fall with sliding speed")
    return limit


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
        raise ParameterError("with excitation cycles do not repeat: use ensemble_counts")
    ratios = np.atleast_1d(np.asarray(damping_ratios, dtype=np.float64))
    found = [
        _of_one(replace(oscillator, damping_ratio=float(ratio)), law, duration_periods, options) for ratio in ratios
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
    oscillator: Oscillator, law: FrictionLaw, periods: float, options: MotionOptions
) -> tuple[Motion, int, int, float]:
    """The motion up to the second departure at most, cycles, micro-slips and the end of the last cycle [periods]."""
    depart = max(oscillator.F * law.static - 2.0 * oscillator.damping_ratio * oscillator.V, 0.0)
    first = math.inf if oscillator.V == 0.0 else depart / oscillator.V / (2.0 * math.pi)
    loop = LOOPS / math.sqrt(max(1.0 - oscillator.damping_ratio**2, 0.01))
    motion = simulate(oscillator, law, None, 0.0, min(periods, first + loop), options)
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
