"""Motion without scatter: steady sliding and its limits, the stick-slip cycle, and its limits in damping.

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

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.oscillator.equation import Oscillator, coefficients
from roughslip.oscillator.laws import FrictionLaw, friction
from roughslip.oscillator.memory_attractors import AT_REST, departure, ending
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.slip_orbit import (
    TOLERANCE,
    SlipFlow,
    check_free,
    growth_rates,
    hopf_damper,
    slip_flow,
    too_stiff,
    turn,
)
from roughslip.results import described, result
from roughslip.validation import gate

LARGEST_DAMPING = 1e3
LATEST = 1e9  # tau
GRAZES = 1e-9  # excess of a peak, relative, below which only rounding parts it from the belt's velocity; and damping


@result
class LimitCycle:
    """The deterministic stick-slip cycle; times are in tau = omega t."""

    departure: float = described("X at the end of stick", "m")
    reattachment: float = described("X at the start of stick", "m")
    slip_duration: float = described("duration of slip in tau")
    period: float = described("period of the cycle in tau")
    slipped_distance: float = described("slipped distance of a cycle", "m")


@gate
def hopf_damping(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The damping ratio below which steady sliding is unstable: -mu_D'(v0) N / (2 m omega).

    From X'' + (2 D + F omega mu_D'(v0)) X' + X = 0 about the equilibrium; negative where friction rises with speed.
    With a memory the one at which the stiffness is the critical one.
    """
    check_free(oscillator)
    if isinstance(law, MemoryLaw):
        return hopf_damper(oscillator, law) / (2.0 * oscillator.mass_kg * oscillator.natural_frequency_rad_per_s)
    return damping_of_slope(oscillator, float(law.slope(oscillator.belt_velocity_m_per_s)))


def damping_of_slope(oscillator: Oscillator, slope: float) -> float:
    """The same at a slope [s/m] of friction at the belt's velocity."""
    return -0.5 * oscillator.F * oscillator.natural_frequency_rad_per_s * slope


def growth_of_sliding(oscillator: Oscillator, law: FrictionLaw) -> float:
    """Rate [-], in tau, at which a swing about steady sliding grows; negative where it decays."""
    if isinstance(law, MemoryLaw):
        return float(growth_rates(oscillator, law)[0].real) / oscillator.natural_frequency_rad_per_s
    return hopf_damping(oscillator, law) - oscillator.damping_ratio


def departure_point(oscillator: Oscillator, law: FrictionLaw) -> float:
    """X [m] at which the mass leaves the belt: F static - 2 D V; with a memory the first time, from rest."""
    if isinstance(law, MemoryLaw):
        return departure(AT_REST, coefficients(oscillator, law)).x
    return oscillator.F * law.static - 2.0 * oscillator.damping_ratio * oscillator.V


@dataclass(frozen=True)
class SlipLoop:
    """The first loop of slip without scatter, from the departure point.

    cycle : the stick-slip cycle, None where the loop does not come back to the belt, or passes it without sticking
    periods : natural periods of the loop, up to its end on the belt or to its largest velocity; 0 where slip comes to
        steady sliding without a loop
    fastest : [m/s] largest sliding speed of the cycle; v0, that of steady sliding, where there is none
    excess : [-] of the peak of X' / V over 1, to first order where the belt cuts it; above 0 wherever there is a cycle
    """

    cycle: LimitCycle | None
    periods: float
    fastest: float
    excess: float


def loop_of_slip(flow: SlipFlow, y: float, w: float, accuracy: float = TOLERANCE) -> tuple[float, float, float, float]:
    """Trough after a departure or peak, y and w of the next peak, up to the belt, and the time until then [-] in tau.

    Trough or peak is 0 where slip comes to rest before it. accuracy : relative, of a step
    """
    low, trough, down = turn(flow, y, w, accuracy)
    y, peak, up = turn(flow, low, trough, accuracy, to_belt=True) if trough < 0.0 else (low, 0.0, 0.0)
    return trough, y, peak, down + up


def meetings(flow: SlipFlow, y: float, w: float, level: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [-] of the first meetings of w with a level, and y there, on either side of the belt; by LSODA."""

    def meets(_: float, z: np.ndarray) -> float:
        return float(z[1]) - level

    def rate(_: float, z: np.ndarray) -> tuple[float, float]:
        turned = max(float(friction(flow.v0 * (z[1] - 1.0), flow.law)), 0.0) if z[1] > 1.0 else 0.0
        return z[1], flow.at_peak(z[1]) - z[0] - 2.0 * flow.scale * turned

    meets.terminal = count  # type: ignore[attr-defined]
    run = scipy.integrate.solve_ivp(rate, (0.0, LATEST), (y, w), "LSODA", events=meets, rtol=1e-11, atol=1e-13 * w)
    if run.t_events[0].size < count:
        raise too_stiff(flow, math.hypot(*run.y[:, -1]), run.nfev)
    return run.t_events[0], run.y_events[0][:, 0]


@lru_cache(maxsize=4096)
def slip_loop(oscillator: Oscillator, law: FrictionLaw, accuracy: float = TOLERANCE) -> SlipLoop:
    """Follow slip from the departure point until it sticks again, or until its first loop has missed the belt.

    Every departure is the same point (F static - 2 D V, V), so the first return is the cycle. Where the first loop of
    slip passes below X' = V it spirals inwards, because trajectories of the plane do not cross, and no cycle exists.
    No duration limits the search. Coulomb's law with static = kinetic has no cycle: its loop is a damped oscillation,
    which without damping only grazes the belt.

    A loop that comes to the belt beyond the static limit passes it, under friction of the other sign. If it falls back
    before the departure point it sticks there. If not, it grows outwards: each later loop falls back farther still.

    accuracy : relative, of a step. With a memory the cycle is that in which the motion ends (`memory_attractors`)

    Raises ParameterError with excitation or a belt at rest, ConvergenceError where slip is too stiff to follow.
    """
    v0, turns = oscillator.belt_velocity_m_per_s, 2.0 * math.pi
    if isinstance(law, MemoryLaw):
        found = ending(oscillator, law)
        cycle = None if found.cycle is None else LimitCycle(*found.cycle)
        return SlipLoop(cycle, found.loop, found.fastest, math.nan)
    flow = slip_flow(oscillator, law)
    trough, y, peak, time = loop_of_slip(flow, flow.departure, 1.0, accuracy)
    departure = departure_point(oscillator, law)
    reattachment, stick = departure + oscillator.V * (y - flow.departure), flow.departure - y
    excess, passed = peak - 1.0 if peak <= 1.0 else 0.5 * (peak - 1.0) ** 2, 0.0  # w'' = -1 where w' = 0 at the belt
    if peak > 1.0 and reattachment + 2.0 * oscillator.damping_ratio * oscillator.V <= -oscillator.F * law.static:
        (above,), (back,) = meetings(flow, y, np.nextafter(1.0, 2.0), 1.0, 1)
        passed, time, stick = float(back - y - above), time + float(above), flow.departure - float(back)
        reattachment = departure - oscillator.V * stick
    if peak <= 1.0 or stick <= math.sqrt(GRAZES) * time:  # stick grows with the root of the excess
        return SlipLoop(None, time / turns if peak > 0.0 else 0.0, v0, excess)
    slipped = oscillator.V * (time + stick + 2.0 * passed)
    cycle = LimitCycle(departure, reattachment, time, time + stick, slipped)
    return SlipLoop(cycle, time / turns, v0 * (1.0 - trough), excess)


@gate
def limit_cycle(oscillator: Oscillator, law: FrictionLaw) -> LimitCycle:
    """The stick-slip cycle: one slip phase from the departure point (`slip_loop`), and the stick line back to it.

    Raises IllPosedError where the mass does not stick again; ParameterError with excitation; ConvergenceError where
    slip is too stiff to follow.
    """
    cycle = slip_loop(oscillator, law).cycle
    if cycle is None:
        raise IllPosedError(
            f"no stick-slip cycle at damping_ratio {oscillator.damping_ratio:.6g}: lower it below the existence limit",
            scene_keys="oscillator.damping_ratio",
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

    Raises IllPosedError where there is no cycle without damping either, ConvergenceError where there is one at any
    damping or slip is too stiff.

    Method: the root of the peak by R. P. Brent (Comput. J. 14 (1971) 422); with a memory by halves.
    """

    def excess(ratio: float) -> float:
        damped = replace(oscillator, damping_ratio=ratio)
        if isinstance(law, MemoryLaw):
            return -1.0 if ending(damped, law).cycle is None else 1.0
        flow = slip_flow(damped, law)
        return loop_of_slip(flow, flow.departure, 1.0)[2] - 1.0

    if not excess(GRAZES) > 0.0:
        raise IllPosedError(
            "no stick-slip cycle even without damping: friction must fall with speed, or from more "
            + ("with the age of the contacts" if isinstance(law, MemoryLaw) else f"than {law.static:.4g} at rest"),
            scene_keys="oscillator.law, oscillator.static_friction",
        )
    low, high, trials = 0.0, max(hopf_damping(oscillator, law), 0.05), 2
    while excess(high) > 0.0:
        if high > LARGEST_DAMPING:
            raise ConvergenceError(
                f"the cycle exists up to the damping ratio {high:.3g}: lower the normal force or raise the belt speed",
                scene_keys="oscillator.normal_force_n, oscillator.belt_velocity_m_per_s",
                residual=1.0,
                work=trials,
            )
        low, high, trials = high, 2.0 * high, trials + 1
    return float(scipy.optimize.brentq(excess, max(low, GRAZES), high, xtol=1e-10 * max(high, 1.0), rtol=8.9e-16))


def limits_or_nan(oscillator: Oscillator, law: FrictionLaw) -> tuple[float, float]:
    """Hopf damping and existence limit [-]; NaN for that of a cycle which does not exist or is too stiff."""
    try:
        return hopf_damping(oscillator, law), existence_limit(oscillator, law)
    except (IllPosedError, ConvergenceError):
        return hopf_damping(oscillator, law), np.nan
