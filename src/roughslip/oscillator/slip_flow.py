"""Slip about steady sliding without scatter, in units of the belt: the next peak of its velocity, its return.

Let y = (X - X_eq) / V and w = y' = X' / V. Slip of the free oscillator (Q = 0) with w < 1 obeys

    y'' + 2 D y' + y = G(w),    G(w) = (F / V) (mu_D(v0 (1 - w)) - mu_D(v0)),

where steady sliding is y = w = 0 and the belt runs at w = 1. A peak of w alone determines the motion after it.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy  # its parts when they are used: scipy.integrate takes 0.3 s to import, and few stages ask for limits

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import FrictionLaw, friction, friction_slope

TOLERANCE = 1e-12  # relative, of a step
AT_REST = 1e-9  # of the first peak: a motion that has come so close to steady sliding does not turn again
MOST_EVALUATIONS = 10_000  # of a loop, which takes some thousand; a stiff one goes to an implicit method
STIFF_TOLERANCE = 1e-11  # relative, of its steps


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
        raise ParameterError(
            "limits of the cycle are for the free oscillator: set the excitation force to 0, not "
            f"{oscillator.excitation_force_n:g} N; scene key: oscillator.excitation_force_n"
        )
    if not oscillator.V > 0.0:
        raise ParameterError(
            "limits of the cycle are for a belt that moves: give it a velocity; scene key: "
            "oscillator.belt_velocity_m_per_s"
        )


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
    ParameterError for another state, ConvergenceError where the flow is too stiff for an explicit method. A largest
    velocity below zero is no peak (there w'' = -w > 0) but the chatter of a stiff flow.

    Method: DOP853 of E. Hairer, S. P. Nørsett & G. Wanner (Solving Ordinary Differential Equations I, 1993, II.10),
    trough and peak as roots of w' on its dense output.
    """
    if not (math.isfinite(y) and w > 0.0 and flow.at_peak(w) - y <= 1e-9 * max(abs(y), w)):
        raise ParameterError(f"a loop of slip begins where X' > 0 is at its peak or falls, not at y = {y}, w = {w}")
    evaluations = 0

    def velocity(_: float, state: np.ndarray) -> tuple[float, float]:
        nonlocal evaluations
        evaluations += 1
        if evaluations > MOST_EVALUATIONS or not math.isfinite(state[0] + state[1]):
            raise _too_stiff(flow, math.hypot(state[0], state[1]), evaluations)
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
    if state[1] < 0.0:
        raise _too_stiff(flow, math.hypot(state[0], state[1]), evaluations)
    return float(state[1]), time


def _too_stiff(flow: SlipFlow, distance: float, evaluations: int) -> ConvergenceError:
    """The error of a loop that an integration cannot follow."""
    return ConvergenceError(
        f"a loop of slip at the damping ratio {flow.damping_ratio:.6g} is too stiff to follow: lower the normal force "
        "or the damping, or give a stiffer spring; scene keys: oscillator.normal_force_n, oscillator.damping_ratio, "
        "oscillator.stiffness_n_per_m; distance from steady sliding in units of V",
        residual=distance,
        work=evaluations,
    )


def stiff_return(flow: SlipFlow, y: float) -> tuple[float, float, float] | None:
    """Place y and time [-] at which slip from the belt, (y, w = 1), returns to it, and the least w before.

    None where its first loop does not return.

    The loop has missed the belt once w falls through 0 for the second time: later loops lie within it. Raises
    ConvergenceError where no step is small enough.

    Method: LSODA of L. R. Petzold (SIAM J. Sci. Stat. Comput. 4 (1983) 136), which changes to backward differences for
    the slow parts of relaxation oscillations. Roots of w and of w - 1 stay well determined there, those of w' do not.
    """

    def velocity(_: float, state: np.ndarray) -> tuple[float, float]:
        return float(state[1]), flow.at_peak(float(state[1])) - float(state[0])

    def jacobian(_: float, state: np.ndarray) -> list[list[float]]:
        return [[0.0, 1.0], [-1.0, flow.slope(float(state[1])) - 2.0 * flow.damping_ratio]]

    def turns(_: float, state: np.ndarray) -> float:
        return float(state[1])

    def belt(_: float, state: np.ndarray) -> float:
        return float(state[1]) - 1.0

    def rest(_: float, state: np.ndarray) -> float:
        return math.hypot(state[0], state[1]) - AT_REST

    turns.terminal, rest.terminal, belt.terminal, belt.direction = True, True, True, 1.0  # type: ignore[attr-defined]
    time, state, minimum = 0.0, np.array([y, 1.0]), 1.0
    for direction in (-1.0, 1.0, -1.0):  # backwards, forwards, and backwards again
        turns.direction = direction  # type: ignore[attr-defined]
        try:
            with warnings.catch_warnings(action="error", category=UserWarning):
                leg = scipy.integrate.solve_ivp(
                    velocity,
                    (time, math.inf),
                    state,
                    "LSODA",
                    events=(turns, belt, rest),
                    rtol=STIFF_TOLERANCE,
                    atol=STIFF_TOLERANCE,
                    jac=jacobian,
                )
        except (ValueError, UserWarning) as error:  # of its root search and its steps, which are as short as rounding
            raise _too_stiff(flow, math.hypot(*state), 0) from error
        if leg.status < 0:
            raise _too_stiff(flow, math.hypot(*leg.y[:, -1]), leg.nfev)
        minimum = min(minimum, float(np.min(leg.y[1])))
        if leg.t_events[1].size:
            return float(leg.y_events[1][0][0]), float(leg.t_events[1][0]), minimum
        if leg.t_events[0].size == 0:
            return None
        time, state = float(leg.t_events[0][0]), leg.y_events[0][0]
    return None
