"""Motion without scatter: steady sliding, the stick-slip cycle, its limits in damping, and its counts of cycles.

All functions are for the free oscillator (Q = 0). Let y = (X - X_eq) / V and w = y' = X' / V. Slip with w < 1 obeys

    y'' + 2 D y' + y = G(w),    G(w) = (F / V) (mu_D(v0 (1 - w)) - mu_D(v0)),

where steady sliding is y = w = 0 and the belt runs at w = 1. A peak of w alone determines the motion after it. The next
peak falls strictly with D, because more damping turns every velocity of the plane the same way (a rotated family,
G. F. D. Duff, Ann. of Math. 57 (1953) 15). So one damping ratio at most belongs to each limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts when they are used: scipy.integrate takes 0.3 s to import, and few stages ask for limits

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import FrictionLaw, friction, friction_slope
from roughslip.oscillator.motion import DEFAULTS, Counts, Motion, MotionOptions, simulate
from roughslip.validation import gate

TOLERANCE = 1e-12  # relative, of a step
AT_REST = 1e-9  # of the first peak: a motion that has come so close to steady sliding does not turn again
LARGEST_DAMPING = 1e3
MOST_EVALUATIONS = 100_000  # of a turn, which takes some thousand; a stiff one ends with a message
RANGE_TOLERANCE = 1e-9  # of a slip phase; ends of ranges have 1e-6
LOOPS = 3.0  # natural periods of a damped oscillator within which slip that will stick again has done so
LOOP_PERIODS = 4.0  # the first loop of slip takes 1 / sqrt(1 - D^2) natural periods and a little


@dataclass(frozen=True)
class SlipFlow:
    """Slip about steady sliding in units of the belt.

    damping_ratio : [-] D
    force, slope : w -> G(w) and G'(w) [-]
    steady : [m] X of steady sliding
    """

    damping_ratio: float
    force: Callable[[float], float]
    slope: Callable[[float], float]
    steady: float

    def at_peak(self, w: float) -> float:
        """y where X' = V w has its peak or trough."""
        return self.force(w) - 2.0 * self.damping_ratio * w


def check_free(oscillator: Oscillator) -> None:
    """Raise ParameterError where the oscillator is excited or its belt is at rest, as the limits do not apply there."""
    if oscillator.q > 0.0:
        raise ParameterError("limits of the cycle are for the free oscillator: set the excitation force to 0")
    if not oscillator.V > 0.0:
        raise ParameterError("limits of the cycle are for a belt that moves: give it a velocity")


def slip_flow(oscillator: Oscillator, law: FrictionLaw) -> SlipFlow:
    """The flow of an oscillator and its law; friction below zero is cut, as in the motion."""
    check_free(oscillator)
    v0, scale, compiled = oscillator.belt_velocity_m_per_s, oscillator.F / oscillator.V, law.parameters()
    mean = max(friction(v0, compiled), 0.0)

    def force(w: float) -> float:
        return scale * (max(friction(abs(v0 * (1.0 - w)), compiled), 0.0) - mean)

    def slope(w: float) -> float:
        speed = v0 * (1.0 - w)
        if friction(abs(speed), compiled) <= 0.0:
            return 0.0
        return -scale * v0 * math.copysign(1.0, speed) * friction_slope(abs(speed), compiled)

    return SlipFlow(oscillator.damping_ratio, force, slope, oscillator.F * mean)


def next_peak(flow: SlipFlow, y: float, w: float) -> tuple[float, float]:
    """The next peak of w from a state with w > 0 and w' <= 0, and the time until then [-] in tau.

    The peak is 0 where the motion comes to steady sliding. Beyond the belt the law goes on as mu(|v|). Raises
    ParameterError for another state, ConvergenceError where the flow is too stiff for an explicit method.

    Method: DOP853 of E. Hairer, S. P. Nørsett & G. Wanner (Solving Ordinary Differential Equations I, 1993, II.10),
    trough and peak as roots of w' on its dense output.
    """
    if not (math.isfinite(y) and w > 0.0 and flow.at_peak(w) - y <= 1e-9 * max(abs(y), w)):
        raise ParameterError(f"a turn of slip begins where X' > 0 is at its peak or falls, not at y = {y}, w = {w}")
    evaluations = 0

    def velocity(_: float, state: np.ndarray) -> tuple[float, float]:
        nonlocal evaluations
        evaluations += 1
        if evaluations > MOST_EVALUATIONS:
            raise ConvergenceError(
                f"a turn of slip at the damping ratio {flow.damping_ratio:.6g} is too stiff: this oscillator has no "
                "cycle within reach of an explicit method; lower the normal force or the damping; distance from rest "
                "in units of V",
                residual=math.hypot(state[0], state[1]),
                work=evaluations,
            )
        here = float(state[1])
        return here, flow.at_peak(here) - float(state[0])

    def rate(_: float, state: np.ndarray) -> float:
        return flow.at_peak(float(state[1])) - float(state[0])

    def rest(_: float, state: np.ndarray) -> float:
        return math.hypot(state[0], state[1]) - AT_REST * w

    rest.terminal = True  # type: ignore[attr-defined]
    time, state = 0.0, np.array([y, w])
    for direction in (1.0, -1.0):  # to the trough, then to the peak
        rate.terminal, rate.direction = True, direction  # type: ignore[attr-defined]
        leg = scipy.integrate.solve_ivp(
            velocity, (time, math.inf), state, "DOP853", events=(rate, rest), rtol=TOLERANCE, atol=0.1 * TOLERANCE * w
        )
        if leg.t_events[0].size == 0:
            return 0.0, float(leg.t[-1])
        time, state = float(leg.t_events[0][0]), leg.y_events[0][0]
    return max(float(state[1]), 0.0), time


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


@gate
def equilibrium(oscillator: Oscillator, law: FrictionLaw) -> float:
    """X [m] of steady sliding: F mu_D(v0)."""
    return slip_flow(oscillator, law).steady


@gate
def hopf_damping(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The damping ratio below which steady sliding is unstable: -mu_D'(v0) N / (2 m omega).

    From X'' + (2 D + F omega mu_D'(v0)) X' + X = 0 about the equilibrium; negative where friction rises with speed.
    """
    check_free(oscillator)
    slope = float(law.slope(oscillator.belt_velocity_m_per_s))
    return -0.5 * oscillator.F * oscillator.natural_frequency_rad_per_s * slope


@gate
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


def cycle_period(oscillator: Oscillator, law: FrictionLaw) -> float | None:
    """Natural periods of the stick-slip cycle at the oscillator's own damping ratio.

    Infinite where there is none, None where slip is too stiff to decide.
    """
    try:
        return limit_cycle(oscillator, law, RANGE_TOLERANCE).period / (2.0 * math.pi)
    except IllPosedError:
        return math.inf
    except ConvergenceError:
        return None


@gate
def existence_limit(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The damping ratio above which the stick-slip cycle does not exist, for any damping ratio of the oscillator.

    At the limit the first loop of slip from the departure point only grazes the belt: its next peak, which falls with
    D, is 1. The result is accurate to 1e-10. The departure point is y = (F / V) (static - mu_D(v0)) - 2 D and w = 1.
    Where friction at vanishing speed is the limit of stick, departure is the grazing point, and the stick-slip cycle
    has shrunk to a cycle of slip alone.

    Raises IllPosedError where there is no cycle without damping either, ConvergenceError where there is one at any
    damping or slip is too stiff.
    """
    flow = slip_flow(oscillator, law)
    departure = (oscillator.F * law.static - flow.steady) / oscillator.V

    def excess(ratio: float) -> float:
        return next_peak(replace(flow, damping_ratio=ratio), departure - 2.0 * ratio, 1.0)[0] - 1.0

    if excess(0.0) <= 0.0:
        raise IllPosedError("no stick-slip cycle even without damping: friction must fall with sliding speed")
    low, high, trials = 0.0, max(hopf_damping(oscillator, law), 0.05), 2
    while (reached := excess(high)) > 0.0:
        if high > LARGEST_DAMPING:
            raise ConvergenceError("the cycle exists at every damping ratio tried", residual=reached, work=trials)
        low, high, trials = high, 2.0 * high, trials + 1
    return float(scipy.optimize.brentq(excess, low, high, xtol=1e-10, rtol=8.9e-16))


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
