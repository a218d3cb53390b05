"""Slip about steady sliding without scatter, in units of the belt: its turns, and their response to noise.

Let y = (X - X_eq) / V and w = y' = X' / V. Slip of the free oscillator (Q = 0) with w < 1 obeys

    y'' + 2 D y' + y = G(w),    G(w) = (F / V) (mu_D(v0 (1 - w)) - mu_D(v0)),

where steady sliding is y = w = 0 and the belt runs at w = 1. A peak of w alone determines the motion after it.

Friction mu_D + mu_S(s) adds (F / V) mu_S(s) to that, s being the slipped distance.
Friction mu_D (1 + mu_S(s)) adds as much times mu_D at the speed of the orbit there. So, to first order, the damping
ratio at which a loop just reaches the belt again is normal about the existence limit. Its standard deviation is
proportional to that of mu_S. This scatter sets the width of the band of damping in which stick-slip goes on or ends by
chance. A loop that misses the belt may still reach it at its next peak.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts when they are used: scipy.integrate takes 0.3 s to import, and few stages ask for limits

from roughslip.errors import ConvergenceError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import FrictionLaw, friction, friction_slope
from roughslip.oscillator.limits import departure_point, equilibrium, existence_limit
from roughslip.oscillator.machine import Machine
from roughslip.results import described, result
from roughslip.validation import gate, positive

SAMPLES = 2001  # of the kernel over a loop, 0.003 apart: the trapezoidal rule errs by some 1e-5 of it
TOLERANCE = 1e-12  # relative, of a step
AT_REST = 1e-9  # of the first peak or the belt: a motion that has come so close to steady sliding does not turn again
MOST_EVALUATIONS = 10_000  # of half a loop, which takes some thousand


@dataclass(frozen=True)
class SlipFlow:
    """Slip about steady sliding in units of the belt.

    damping_ratio : [-] D
    force, slope : w -> G(w) and G'(w) [-]
    departure : [-] y of the departure without scatter, at w = 1
    """

    damping_ratio: float
    force: Callable[[float], float]
    slope: Callable[[float], float]
    departure: float

    def at_peak(self, w: float) -> float:
        """y where X' = V w has its peak or trough."""
        return self.force(w) - 2.0 * self.damping_ratio * w


def slip_flow(oscillator: Oscillator, law: FrictionLaw) -> SlipFlow:
    """The flow of an oscillator and its law; friction below zero is cut, as in the motion."""
    steady = equilibrium(oscillator, law)
    v0, scale, compiled = oscillator.belt_velocity_m_per_s, oscillator.F / oscillator.V, law.parameters()
    mean = max(friction(v0, compiled), 0.0)

    def force(w: float) -> float:
        return scale * (max(friction(abs(v0 * (1.0 - w)), compiled), 0.0) - mean)

    def slope(w: float) -> float:
        speed = v0 * (1.0 - w)
        if friction(abs(speed), compiled) <= 0.0:
            return 0.0
        return -scale * v0 * math.copysign(1.0, speed) * friction_slope(abs(speed), compiled)

    departure = (departure_point(oscillator, law) - steady) / oscillator.V
    return SlipFlow(oscillator.damping_ratio, force, slope, departure)


def turn(
    flow: SlipFlow, y: float, w: float, accuracy: float = TOLERANCE, to_belt: bool = False
) -> tuple[float, float, float]:
    """State y, w at the next extreme of w, and the time until then [-] in tau; w = 0 where the motion comes to rest.

    From w > 0 with w' <= 0 that is a trough, from a trough a peak. accuracy : relative, of a step

    to_belt : end where a rise reaches the belt; 1 + w' then stands for the peak. Else, beyond the belt, the law goes on
        as mu(|v|)

    Raises ConvergenceError where the flow is too stiff for an explicit method. A largest velocity below zero is no peak
    (there w'' = -w > 0) but the chatter of a stiff flow.

    Method: DOP853 of E. Hairer, S. P. Nørsett & G. Wanner (Solving Ordinary Differential Equations I, 1993, II.10),
    extremes as roots of w' on its dense output.
    """
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
        return math.hypot(state[0], state[1]) - AT_REST * abs(w)

    def belt(_: float, state: np.ndarray) -> float:
        return float(state[1]) - 1.0

    rate.terminal, rate.direction, rest.terminal = True, math.copysign(1.0, w), True  # type: ignore[attr-defined]
    belt.terminal, belt.direction = to_belt, 1.0  # type: ignore[attr-defined]
    leg = scipy.integrate.solve_ivp(
        velocity, (0.0, math.inf), (y, w), "DOP853", events=(rate, rest, belt), rtol=accuracy,
        atol=0.1 * accuracy * abs(w),
    )  # fmt: skip
    if to_belt and w < 0.0 and leg.t_events[2].size:
        y, w = map(float, leg.y_events[2][0])
        return y, 1.0 + flow.at_peak(w) - y, float(leg.t_events[2][0])
    if leg.t_events[0].size == 0:
        return 0.0, 0.0, float(leg.t[-1])
    there, extreme = map(float, leg.y_events[0][0])
    if extreme * w > 0.0:
        raise _too_stiff(flow, math.hypot(there, extreme), evaluations)
    return there, extreme, float(leg.t_events[0][0])


def _too_stiff(flow: SlipFlow, distance: float, evaluations: int) -> ConvergenceError:
    """The error of a loop that an integration cannot follow."""
    return ConvergenceError(
        f"a loop of slip at the damping ratio {flow.damping_ratio:.6g} is too stiff to follow: lower the normal force "
        "or the damping, or give a stiffer spring; scene keys: oscillator.normal_force_n, oscillator.damping_ratio, "
        "oscillator.stiffness_n_per_m; distance from steady sliding in units of V",
        residual=distance,
        work=evaluations,
    )


@result
class GrazingResponse:
    """How noise and damping move the peak of the grazing orbit."""

    limit: float = described("damping ratio of the orbit, the existence limit")
    slipped: np.ndarray = described("slipped distance since departure, at equal times", "m", "samples")
    kernel: np.ndarray = described(
        "weight of mu_S there in the peak of X' / V: the sum over the samples is the integral", "1", "samples"
    )
    damping: float = described("change of the peak with the damping ratio, negative")

    @gate
    def scatter(self, correlation: float | Callable[[np.ndarray], np.ndarray]) -> float:
        """Standard deviation of the damping ratio at which a loop just grazes, for mu_S of unit variance.

        correlation : [m] length L of the autocorrelation exp(-s / L) of mu_S; or that of any lags [m], as
            `FrictionProcess.autocorrelation`
        """
        return math.sqrt(max(self.covariance(correlation), 0.0)) / abs(self.damping)

    @gate
    def covariance(self, correlation: float | Callable[[np.ndarray], np.ndarray], apart_m: float = 0.0) -> float:
        """Covariance of the peaks, in units of X' / V, of two loops so far apart in slip, for mu_S of unit variance."""
        lag = np.abs(apart_m + self.slipped[:, None] - self.slipped[None, :])
        of_lags = (
            correlation(lag) if callable(correlation) else np.exp(-lag / positive("correlation", correlation, "m"))
        )
        return float(np.einsum("i,ij,j->", self.kernel, of_lags, self.kernel))


@gate
def grazing_response(machine: Machine) -> GrazingResponse:
    """The response of the orbit at the existence limit, independent of the oscillator's own damping ratio.

    Raises as `existence_limit` does.

    Method: along the orbit from departure to the next peak at the belt, that peak moves by

        dw = (F / V) (psi_y(0) mu_S(0) + integral of psi_w(tau) mu_S(s(tau)) d tau),
        dw / dD = -2 (psi_y(0) + integral of psi_w w d tau),

    psi being the adjoint solution that ends as (0, 1) at the peak: the last row of the propagator from each sample to
    the peak, by variational equations. The first part is the departure point, which moves with the static limit. A
    constant mu_S that is added only moves the motion along X, so that the two parts cancel; one that multiplies changes
    the force. Where friction does not jump at the start of slip, as in eq. (13), the first part is zero: an earlier
    departure is on the same orbit.
    """
    oscillator, law = machine.oscillator, machine.law
    limit = existence_limit(oscillator, law)
    flow = slip_flow(replace(oscillator, damping_ratio=limit), law)
    trough, w, down = turn(flow, flow.departure, 1.0)
    _, _, up = turn(flow, trough, w)
    return orbit_response(machine, flow, (flow.departure, 1.0), down + up, law.static)


def orbit_response(
    machine: Machine,
    flow: SlipFlow,
    start: tuple[float, float],
    duration: float,
    static: float = 0.0,
    samples: int = SAMPLES,
    at: float | None = None,
) -> GrazingResponse:
    """The response of the end of the orbit of a flow from a state (y, w), as `grazing_response` has it of a peak.

    duration : [-] tau until the peak, or until the orbit reaches the belt before it
    static : limit of stick where the orbit begins with a departure that moves with mu_S; else 0
    at : [-] tau of a trough, at which the response is taken instead
    """
    oscillator = machine.oscillator
    scale = oscillator.F / oscillator.V
    weight, (y, w), adjoint = _along_orbit(flow, start, duration, samples, along=at is not None)
    if at is not None:
        adjoint = adjoint / np.interp(at, np.linspace(0.0, duration, samples), adjoint[:, 1])
    multiplies = machine.options.scatter == "multiplicative"
    kernel = scale * weight * adjoint[:, 1]
    if multiplies:
        kernel *= machine.law.mu(oscillator.belt_velocity_m_per_s * (1.0 - w))
    if static > 0.0:
        kernel[0] += scale * adjoint[0, 0] * (static if multiplies else 1.0)
    return GrazingResponse(
        limit=flow.damping_ratio,
        slipped=oscillator.V * (np.linspace(0.0, duration, samples) - (y - start[0])),
        kernel=kernel,
        damping=-2.0 * float(adjoint[0, 0] + np.sum(weight * adjoint[:, 1] * w)),
    )


def _along_orbit(
    flow: SlipFlow, start: tuple[float, float], duration: float, samples: int, along: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights (samples,) of the trapezoidal rule in tau, the orbit (2, samples) y and w, and its adjoint.

    The adjoint (samples, 2) ends as (0, 1): what a change of the state at each sample does to w at the end. Or, along
    the flow, as (-w', w) / w: that is the same at a peak, and before it what does not depend on when the orbit ends.
    """

    def velocity(_: float, state: np.ndarray) -> list[float]:
        y, w, yy, wy, yw, ww = state
        rate = flow.slope(float(w)) - 2.0 * flow.damping_ratio
        return [w, flow.at_peak(float(w)) - y, wy, rate * wy - yy, ww, rate * ww - yw]

    times = np.linspace(0.0, duration, samples)
    orbit = scipy.integrate.solve_ivp(
        velocity, (0.0, duration), [*start, 1.0, 0.0, 0.0, 1.0], "DOP853", times, rtol=TOLERANCE, atol=0.1 * TOLERANCE
    ).y
    propagator = np.array([[orbit[2], orbit[4]], [orbit[3], orbit[5]]]).transpose(2, 0, 1)  # from 0 to each sample
    last = propagator[-1, 1]
    if along:
        last = last - (flow.at_peak(float(orbit[1, -1])) - orbit[0, -1]) / orbit[1, -1] * propagator[-1, 0]
    adjoint = np.linalg.solve(propagator.transpose(0, 2, 1), last[:, None])[..., 0]
    weight = np.full(samples, duration / (samples - 1))
    weight[[0, -1]] *= 0.5
    return weight, orbit[:2], adjoint
