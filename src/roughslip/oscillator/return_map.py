"""Slip from one peak of X' to the next: the return map of the free oscillator with its mean friction.

Let y = (X - X_eq) / V and w = y' = X' / V, in units of the belt. Slip with v_rel = v0 (1 - w) > 0 obeys

    y'' + 2 D y' + y = G(w),    G(w) = (F / V) (mu_D(v0 (1 - w)) - mu_D(v0)),

where steady sliding is y = w = 0 and the belt runs at w = 1. X' peaks where w' = 0 with w > 0, on the curve
y = G(w) - 2 D w. Every orbit crosses this curve from the same side, as w'' = -w there. So the peak alone determines a
motion, and the map of peaks 0 < a <= 1 onto the next peaks describes all sliding. A fixed point is a cycle without
stick; where the next peak exceeds 1 the mass meets the belt before it.

More damping turns every velocity of the plane (y, w) the same way, by dw' = -2 w dD: a rotated family in the sense of
G. F. D. Duff (Ann. of Math. 57 (1953) 15). So the next peak falls strictly with D, one damping ratio belongs to each
peak at most, and the cycles of different damping do not cross.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_law import FrictionLaw
from roughslip.oscillator.laws import friction, friction_slope

TOLERANCE = 1e-12  # relative, of a step
AT_REST = 1e-9  # of the first peak: a motion that has come so close to steady sliding does not turn again
LARGEST_DAMPING = 1e3
MOST_EVALUATIONS = 100_000  # of a turn, which takes some thousand; a stiff one ends with a message


@dataclass(frozen=True)
class SlipFlow:
    """Slip about steady sliding in units of the belt.

    damping_ratio : [-] D
    force, slope : w -> G(w) and G'(w) [-]
    steady : [m] X of steady sliding
    belt : [m] V, the unit of y and w
    """

    damping_ratio: float
    force: Callable[[float], float]
    slope: Callable[[float], float]
    steady: float
    belt: float

    def at_peak(self, w: float) -> float:
        """y where X' = V w has its peak or trough."""
        return self.force(w) - 2.0 * self.damping_ratio * w

    def position(self, y: float) -> float:
        """X [m] at y."""
        return self.steady + self.belt * y


@dataclass(frozen=True)
class Turn:
    """One turn of slip.

    peak : [-] the next maximum of X' / V, 0 where the motion comes to steady sliding without another one
    duration : [-] in tau = omega t
    """

    peak: float
    duration: float


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

    return SlipFlow(oscillator.damping_ratio, force, slope, oscillator.F * mean, oscillator.V)


def turn(flow: SlipFlow, peak: float, tolerance: float = TOLERANCE) -> Turn:
    """The turn that begins at a peak of X', given in units of V. Raises as `turn_from`."""
    return turn_from(flow, flow.at_peak(peak), peak, tolerance)


def turn_from(flow: SlipFlow, y: float, w: float, tolerance: float = TOLERANCE) -> Turn:
    """The turn from a state with w > 0 and w' <= 0 to the next peak of w; beyond the belt the law goes on as mu(|v|).

    Raises ParameterError for another state, ConvergenceError where the flow is too stiff for an explicit method.

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
        leg = solve_ivp(
            velocity, (time, math.inf), state, "DOP853", events=(rate, rest), rtol=tolerance, atol=0.1 * tolerance * w
        )
        if leg.t_events[0].size == 0:
            return Turn(0.0, float(leg.t[-1]))
        time, state = float(leg.t_events[0][0]), leg.y_events[0][0]
    return Turn(max(float(state[1]), 0.0), time)


def falling_root(excess: Callable[[float], float], start: float, accuracy: float) -> float | None:
    """The damping ratio where a function that falls with it vanishes; None where it is not positive without damping.

    excess : of the damping ratio
    start : [-] where the search for the other end begins

    Raises ConvergenceError where it is positive at every damping ratio up to LARGEST_DAMPING.
    """
    if excess(0.0) <= 0.0:
        return None
    low, high, trials = 0.0, max(start, 0.05), 2
    while (reached := excess(high)) > 0.0:
        if high > LARGEST_DAMPING:
            raise ConvergenceError("the cycle exists at every damping ratio tried", residual=reached, work=trials)
        low, high, trials = high, 2.0 * high, trials + 1
    return float(brentq(excess, low, high, xtol=accuracy, rtol=8.9e-16))
