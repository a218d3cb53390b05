"""Motion without scatter: steady sliding, the stick-slip cycle, and its limits in damping.

All functions are for the free oscillator (Q = 0), whose slip is that of `slip_orbit`. The next peak of the velocity
falls strictly with D, because more damping turns every velocity of the plane the same way (a rotated family,
G. F. D. Duff, Ann. of Math. 57 (1953) 15). So one damping ratio at most belongs to each limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.motion import Motion, MotionOptions, Trajectory, trajectory
from roughslip.results import described, result
from roughslip.validation import gate

LARGEST_DAMPING = 1e3
STEADY = 1e-9  # of V: slip that has come so close to steady sliding does not turn again
GRAZES = 1e-9  # excess of a peak, relative, below which only rounding parts it from the belt's velocity; and damping
LOOP_TOLERANCE = 1e-9  # of a slip phase; ends of ranges have 1e-6
LIMIT_TOLERANCE = 1e-12  # of the loops whose limit is searched
LOOP_PERIODS = 4.0  # most loops of slip take one natural period or two; longer ones are followed without a time limit
LOOP_SAMPLES, MOST_SAMPLES = 200, 1e6  # a natural period, in all


@result
class LimitCycle:
    """The deterministic stick-slip cycle; times are in tau = omega t."""

    departure: float = described("X at the end of stick", "m")
    reattachment: float = described("X at the start of stick", "m")
    slip_duration: float = described("duration of slip in tau")
    period: float = described("period of the cycle in tau")
    slipped_distance: float = described("slipped distance of a cycle", "m")


def check_free(oscillator: Oscillator) -> None:
    """Raise ParameterError where the oscillator is excited or its belt is at rest, as the limits do not apply there."""
    if oscillator.q > 0.0:
        raise ParameterError(
            "limits of the cycle are for the free oscillator: set the excitation force to 0, not "
            f"{oscillator.excitation_force_n:g} N; scene key: oscillator.excitation_force_n"
        )
    if not oscillator.V > 0.0:
        raise ParameterError(
            "limits of the cycle are for a belt that moves: give it a velocity; scene key: "
            "oscillator.belt_velocity_m_per_s"
        )


@gate
def equilibrium(oscillator: Oscillator, law: FrictionLaw) -> float:
    """X [m] of steady sliding: F mu_D(v0); friction below zero is cut, as in the motion."""
    check_free(oscillator)
    return oscillator.F * max(float(law.mu(oscillator.belt_velocity_m_per_s)), 0.0)


@gate
def hopf_damping(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The damping ratio below which steady sliding is unstable: -mu_D'(v0) N / (2 m omega).

    From X'' + (2 D + F omega mu_D'(v0)) X' + X = 0 about the equilibrium; negative where friction rises with speed.
    """
    check_free(oscillator)
    slope = float(law.slope(oscillator.belt_velocity_m_per_s))
    return -0.5 * oscillator.F * oscillator.natural_frequency_rad_per_s * slope


def departure_point(oscillator: Oscillator, law: FrictionLaw) -> float:
    """X [m] at which the mass leaves the belt: F static - 2 D V."""
    return oscillator.F * law.static - 2.0 * oscillator.damping_ratio * oscillator.V


@dataclass(frozen=True)
class SlipLoop:
    """The first loop of slip without scatter, from the departure point.

    cycle : the stick-slip cycle, None where the loop does not come back to the belt, or passes it without sticking
    periods : natural periods of the loop, up to its end on the belt or to its largest velocity; 0 where slip comes to
        steady sliding without a loop
    fastest : [m/s] largest sliding speed of the cycle; v0, that of steady sliding, where there is none
    """

    cycle: LimitCycle | None
    periods: float
    fastest: float


def _first_loop(oscillator: Oscillator, law: FrictionLaw, tolerance: float) -> tuple[Trajectory, float | None]:
    """Slip from the departure point until it is back at the belt, has a peak of its velocity below, or is steady.

    Returns its trajectory, and the natural periods until that peak.
    """
    departure, steady, still = departure_point(oscillator, law), equilibrium(oscillator, law), STEADY * oscillator.V
    periods = LOOP_PERIODS
    while True:
        samples = max(min(LOOP_SAMPLES, int(MOST_SAMPLES / periods)), 1)
        options = MotionOptions(tolerance, samples_per_period=samples)
        drawn = trajectory(oscillator, law, None, 0.0, periods, options, departure)
        rises = np.diff(drawn.velocity) > 0.0
        peaks = np.flatnonzero(rises[:-1] & ~rises[1:] & (drawn.velocity[1:-1] > still))
        if peaks.size:
            return drawn, float(drawn.time[peaks[0] + 1]) / (2.0 * math.pi)
        is_steady = math.hypot(drawn.position[-1] - steady, drawn.velocity[-1]) <= still
        if is_steady or np.any(drawn.motion.kind != DEPARTURE):
            return drawn, None
        periods *= 4.0


@lru_cache(maxsize=4096)
def slip_loop(oscillator: Oscillator, law: FrictionLaw, tolerance: float = LOOP_TOLERANCE) -> SlipLoop:
    """Follow slip from the departure point until it sticks again, or until its first loop has missed the belt.

    Every departure is the same point (F static - 2 D V, V), so the first return is the cycle. Where the first loop of
    slip passes below X' = V it spirals inwards, because trajectories of the plane do not cross, and no cycle exists.
    No duration limits the search. Coulomb's law with static = kinetic has no cycle: its loop is a damped oscillation,
    which without damping only grazes the belt.

    Raises ParameterError with excitation or a belt at rest, ConvergenceError where slip is too stiff to follow.
    """
    drawn, peak = _first_loop(oscillator, law, tolerance)
    v0 = oscillator.belt_velocity_m_per_s
    if REATTACHMENT not in drawn.motion.kind:
        return SlipLoop(None, peak or 0.0, v0)
    end = int(np.flatnonzero(drawn.motion.kind == REATTACHMENT)[0])
    cycle, time = _cycle(oscillator, drawn.motion, end), float(drawn.motion.time[end])
    fastest = v0 - oscillator.natural_frequency_rad_per_s * float(np.min(drawn.velocity[drawn.time <= time]))
    return SlipLoop(cycle, time / (2.0 * math.pi), fastest if cycle else v0)


def _cycle(oscillator: Oscillator, motion: Motion, end: int) -> LimitCycle | None:
    """The cycle of a motion from the departure point and its first reattachment; None where they are one point."""
    departure, reattachment = float(motion.position[0]), float(motion.position[end])
    slip_duration = float(motion.time[end] - motion.time[0])
    stick = (departure - reattachment) / oscillator.V
    if stick <= math.sqrt(GRAZES) * slip_duration:  # the stick grows with the root of the excess of the peak
        return None
    return LimitCycle(
        departure=departure,
        reattachment=reattachment,
        slip_duration=slip_duration,
        period=slip_duration + stick,
        slipped_distance=float(motion.slipped_distance[end]),
    )


@gate
def limit_cycle(oscillator: Oscillator, law: FrictionLaw, tolerance: float = 1e-11) -> LimitCycle:
    """The stick-slip cycle: one slip phase from the departure point (`slip_loop`), and the stick line back to it.

    Raises IllPosedError where the mass does not stick again; ParameterError with excitation; ConvergenceError where
    slip is too stiff to follow.
    """
    cycle = slip_loop(oscillator, law, tolerance).cycle
    if cycle is None:
        raise IllPosedError(
            f"no stick-slip cycle at the damping ratio {oscillator.damping_ratio:.6g}: the mass does not stick again; "
            "lower the damping below the existence limit; scene key: oscillator.damping_ratio"
        )
    return cycle


@gate
def existence_limit(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The damping ratio above which the stick-slip cycle does not exist, for any damping ratio of the oscillator.

    At the limit the first loop of slip from the departure point only grazes the belt: its next peak, which falls with
    D, is that of the belt. The result is accurate to 1e-10, relative where it is above 1. Where friction at vanishing
    speed is the limit of stick, departure is the grazing point, and the stick-slip cycle has shrunk to a cycle of slip
    alone.

    It is the upper limit. Where friction rises from a minimum, a nearly undamped mass may overtake the belt and fall
    back behind it beyond the static limit. This is a cycle of slip alone, which ends above a damping ratio of its own.
    `slip_loop` has no cycle there.

    Raises IllPosedError where there is no cycle without damping either, ConvergenceError where there is one at any
    damping or slip is too stiff.

    Method: bisection. A loop costs a millisecond, but its peak as a number, for faster root searches, some twenty.
    """

    def exists(ratio: float) -> bool:
        drawn, _ = _first_loop(replace(oscillator, damping_ratio=ratio), law, LIMIT_TOLERANCE)
        return bool(np.any(drawn.motion.kind != DEPARTURE))

    if not exists(GRAZES):
        raise IllPosedError(
            "no stick-slip cycle even without damping: friction must fall with speed, or from more than "
            f"{law.static:.4g} at rest; scene keys: oscillator.law, oscillator.static_friction"
        )
    low, high, trials = 0.0, max(hopf_damping(oscillator, law), 0.05), 2
    while exists(high):
        if high > LARGEST_DAMPING:
            raise ConvergenceError(
                f"the cycle exists at every damping ratio tried, up to {high:.3g}: lower the normal force or raise the "
                "belt velocity; scene keys: oscillator.normal_force_n, oscillator.belt_velocity_m_per_s",
                residual=1.0,
                work=trials,
            )
        low, high, trials = high, 2.0 * high, trials + 1
    accuracy = 1e-10 * max(high, 1.0)
    limit = scipy.optimize.bisect(lambda ratio: exists(ratio) - 0.5, low, high, xtol=accuracy, rtol=8.9e-16)
    return float(limit)


def limits_or_nan(oscillator: Oscillator, law: FrictionLaw) -> tuple[float, float]:
    """Hopf damping and existence limit [-]; NaN for that of a cycle which does not exist or is too stiff."""
    try:
        return hopf_damping(oscillator, law), existence_limit(oscillator, law)
    except (IllPosedError, ConvergenceError):
        return hopf_damping(oscillator, law), np.nan
