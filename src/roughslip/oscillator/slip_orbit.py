"""Slip about steady sliding without scatter, in units of the belt, from one turn to the next.

Let y = (X - X_eq) / V and w = y' = X' / V. Slip of the free oscillator (Q = 0) with w < 1 obeys

    y'' + 2 D y' + y = G(w),    G(w) = (F / V) (mu_D(v0 (1 - w)) - mu_D(v0)),

where steady sliding is y = w = 0 and the belt runs at w = 1. A peak of w alone determines the motion after it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import FrictionLaw, friction, friction_slope
from roughslip.oscillator.memory_law import MemoryLaw, direct_slope
from roughslip.oscillator.runge_kutta import ERROR, ROWS, WEIGHTS
from roughslip.validation import gate

TOLERANCE = 1e-12  # relative, of a step
AT_REST = 1e-9  # of the first peak or the belt: a motion that has come so close to steady sliding does not turn again
CHATTER = 1e-6  # of the first peak: an extreme of the same sign below it is noise of strongly damped slip near rest
MOST_STEPS = 100_000  # of half a loop, which takes some thousand
HALVINGS = 52  # of a step, to its event
EXTREME, BELT, REST, TOO_STIFF = range(4)  # how a turn ends
STAGES = np.array([(*row, *[0.0] * (5 - len(row))) for row in ((), *ROWS)])  # of Fehlberg's pair, as a table
SUMS, ERRORS = (np.insert(weights, 1, 0.0) for weights in (WEIGHTS, ERROR))


class SlipFlow(NamedTuple):
    """Slip about steady sliding in units of the belt; compiled code reads it.

    damping_ratio : [-] D
    v0, scale, mean : [m/s] of the belt, F / V, and mu_D(v0)
    departure : [-] y of the departure without scatter, at w = 1
    law : parameters of the friction law
    """

    damping_ratio: float
    v0: float
    scale: float
    mean: float
    departure: float
    law: Any

    def at_peak(self, w: float) -> float:
        """y where X' = V w has its peak or trough."""
        return float(balance(w, self))


def check_free(oscillator: Oscillator) -> None:
    """Raise ParameterError where the oscillator is excited or its belt is at rest, as the limits do not apply there."""
    if oscillator.q > 0.0:
        raise ParameterError(
            f"limits of the cycle are without excitation: set its force of {oscillator.excitation_force_n:g} N to 0",
            scene_keys="oscillator.excitation_force_n",
        )
    if not oscillator.V > 0.0:
        raise ParameterError(
            "limits of the cycle are for a belt that moves: give it a velocity",
            scene_keys="oscillator.belt_velocity_m_per_s",
        )


@gate
def equilibrium(oscillator: Oscillator, law: FrictionLaw) -> float:
    """X [m] of steady sliding: F mu_D(v0); friction below zero is cut, as in the motion."""
    check_free(oscillator)
    return oscillator.F * max(float(law.mu(oscillator.belt_velocity_m_per_s)), 0.0)


def _about_sliding(belt: Oscillator, law: MemoryLaw) -> tuple[float, float, float]:
    """alpha = N dmu/d|v| + d at constant age [kg/s], r = v0 / D_c [1/s], kappa = N b v_c / ((v0 + v_c) D_c) [N/m]."""
    check_free(belt)
    v0, load, p = belt.belt_velocity_m_per_s, belt.normal_force_n, law.parameters()
    alpha, r = load * float(direct_slope(v0, p)) + belt.damper_kg_per_s, v0 / p.length
    return alpha, r, load * p.ageing * p.cutoff / ((v0 + p.cutoff) * p.length)


@gate
def growth_rates(oscillator: Oscillator, law: MemoryLaw) -> np.ndarray:
    """(3,) [1/s] lambda of small motions exp(lambda t) about steady sliding with memory, the fastest growth first.

    (m lambda^2 + alpha lambda + k) (lambda + r) = kappa lambda. Raises ParameterError with excitation or without belt.
    """
    alpha, r, kappa = _about_sliding(oscillator, law)
    m, k, unit = oscillator.mass_kg, oscillator.stiffness_n_per_m, oscillator.natural_frequency_rad_per_s
    roots = unit * np.roots([1.0, (r + alpha / m) / unit, (k + alpha * r - kappa) / k, r / unit])
    return roots[np.argsort(-roots.real, kind="stable")]


@gate
def critical_stiffness(oscillator: Oscillator, law: MemoryLaw) -> tuple[float, float]:
    """k_c [N/m], below which steady sliding with memory is unstable, and omega [rad/s] there; mass and damper held.

    0 and NaN where any spring holds it, infinite where none. J. R. Rice & A. L. Ruina, J. Appl. Mech. 50 (1983) 343
    """
    (alpha, r, kappa), m = _about_sliding(oscillator, law), oscillator.mass_kg
    k = (kappa - alpha * r) * (1.0 + m * r / alpha) if alpha > 0.0 else math.inf
    return (k, math.sqrt(k * r / (m * r + max(alpha, 0.0)))) if k > 0.0 else (0.0, math.nan)


def hopf_damper(oscillator: Oscillator, law: MemoryLaw) -> float:
    """The damper [kg/s] below which steady sliding with memory is unstable; negative where it needs none.

    With mass and spring held k = k_c is r alpha^2 + (k + m r^2 - kappa) alpha - kappa m r = 0, whose root is above 0.
    """
    (alpha, r, kappa), m = _about_sliding(oscillator, law), oscillator.mass_kg
    half = 0.5 * (oscillator.stiffness_n_per_m + m * r**2 - kappa) / r
    root = math.hypot(half, math.sqrt(kappa * m))
    return (kappa * m / (half + root) if half > 0.0 else root - half) - alpha + oscillator.damper_kg_per_s


def slip_flow(oscillator: Oscillator, law: FrictionLaw) -> SlipFlow:
    """The flow of an oscillator and its law; friction below zero is cut, as in the motion."""
    check_free(oscillator)
    v0, scale, parameters = float(oscillator.belt_velocity_m_per_s), oscillator.F / oscillator.V, law.parameters()
    mean, ratio = max(float(friction(v0, parameters)), 0.0), float(oscillator.damping_ratio)
    return SlipFlow(ratio, v0, float(scale), mean, float(scale * (law.static - mean) - 2.0 * ratio), parameters)


@compiled(error_model="numpy")
def balance(w: float, flow: SlipFlow) -> float:
    """G(w) - 2 D w: y where w' = 0."""
    mu = max(friction(abs(flow.v0 * (1.0 - w)), flow.law), 0.0)
    return flow.scale * (mu - flow.mean) - 2.0 * flow.damping_ratio * w


@compiled(error_model="numpy")
def rate_of_slip(w: float, flow: SlipFlow) -> float:
    """G'(w) - 2 D, up to the belt."""
    speed, rate = flow.v0 * (1.0 - w), -2.0 * flow.damping_ratio
    return rate - flow.scale * flow.v0 * friction_slope(speed, flow.law) if friction(speed, flow.law) > 0.0 else rate


@compiled(error_model="numpy")
def rk_step(z: np.ndarray, h: float, flow: SlipFlow, k: np.ndarray, end: np.ndarray) -> float:
    """A step of Fehlberg's pair from z to end : (2,) y and w, or (6,) with two tangents; returns the error of y, w.

    k : (6, as z) the stages, overwritten
    """
    for stage in range(6):
        for i in range(z.size):
            end[i] = z[i]
            for before in range(stage):
                end[i] += h * STAGES[stage, before] * k[before, i]
        k[stage, 0], k[stage, 1] = end[1], balance(end[1], flow) - end[0]
        if z.size == 6:
            rate = rate_of_slip(end[1], flow)
            k[stage, 2], k[stage, 3] = end[3], rate * end[3] - end[2]
            k[stage, 4], k[stage, 5] = end[5], rate * end[5] - end[4]
    largest = 0.0
    for i in range(z.size):
        end[i], error = z[i], 0.0
        for stage in range(6):
            end[i] += h * SUMS[stage] * k[stage, i]
            error += h * ERRORS[stage] * k[stage, i]
        largest = max(largest, abs(error)) if i < 2 else largest
    return largest


@compiled(error_model="numpy")
def next_step(h: float, ratio: float) -> float:
    """The step after one whose error is that many times the allowed one; shorter after one that ends in no number."""
    return h * min(max(0.9 * max(ratio, 1e-9) ** -0.2, 0.2), 5.0) if ratio < np.inf else 0.2 * h


@compiled(error_model="numpy")
def _turn(z: np.ndarray, flow: SlipFlow, accuracy: float, to_belt: bool) -> tuple[float, int, int]:
    """Move z to the next extreme, to the belt or to rest. Returns the time, how it ended, and the steps."""
    first, time, h, k, end = z[1], 0.0, 1e-2, np.zeros((6, 2)), z.copy()
    for steps in range(MOST_STEPS):
        error = rk_step(z, h, flow, k, end) / (accuracy * max(abs(first), abs(end[0]), abs(end[1])))
        if not error <= 1.0:
            h = next_step(h, error)
            if h < 1e-15 * (1.0 + time):
                return time, TOO_STIFF, steps
            continue
        if math.hypot(end[0], end[1]) <= AT_REST * abs(first):
            return time + h, REST, steps
        sign = math.copysign(1.0, first)
        turns = sign * (balance(end[1], flow) - end[0]) >= 0.0 and sign * (balance(z[1], flow) - z[0]) < 0.0
        meets = to_belt and first < 0.0 and end[1] >= 1.0
        if turns or meets:
            low, high = 0.0, h
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                rk_step(z, middle, flow, k, end)
                past = to_belt and first < 0.0 and end[1] >= 1.0
                if past or sign * (balance(end[1], flow) - end[0]) >= 0.0:
                    high, meets = middle, past
                else:
                    low = middle
            rk_step(z, high, flow, k, end)
            z[:] = end
            return time + high, BELT if meets else EXTREME, steps
        z[:] = end
        time += h
        h = next_step(h, error)
    return time, TOO_STIFF, MOST_STEPS


def too_stiff(flow: SlipFlow, distance: float, steps: int) -> ConvergenceError:
    """The error of a flow that an explicit method cannot follow, at a distance from steady sliding."""
    return ConvergenceError(
        f"a loop of slip at the damping ratio {flow.damping_ratio:.6g} is too stiff to follow: lower the normal "
        "force or the damping, or give a stiffer spring; distance from steady sliding in units of V",
        scene_keys="oscillator.normal_force_n, oscillator.damping_ratio, oscillator.stiffness_n_per_m",
        residual=distance,
        work=steps,
    )


def turn(
    flow: SlipFlow, y: float, w: float, accuracy: float = TOLERANCE, to_belt: bool = False
) -> tuple[float, float, float]:
    """State y, w at the next extreme of w, and the time until then [-] in tau; w = 0 where the motion comes to rest.

    From w > 0 with w' <= 0 that is a trough, from a trough a peak. accuracy : relative, of a step

    to_belt : end where a rise reaches the belt; 1 + w' then stands for the peak. Else, beyond the belt, the law goes on
        as mu(|v|)

    Raises ConvergenceError where the flow is too stiff for an explicit method. A largest velocity below zero is no peak
    (there w'' = -w > 0) but the chatter of a stiff flow.

    Method: Fehlberg's pair (`runge_kutta`) with its error held at each step, events by halving the step that has one.
    """
    z = np.array([y, w], dtype=float)
    time, ended, steps = _turn(z, flow, accuracy, to_belt)
    there, extreme = map(float, z)
    if ended == EXTREME and extreme * w > 0.0 and math.hypot(there, extreme) <= CHATTER * abs(w):
        ended = REST
    if ended == TOO_STIFF or (ended == EXTREME and extreme * w > 0.0):
        raise too_stiff(flow, math.hypot(there, extreme), steps)
    if ended == BELT:
        return there, 1.0 + flow.at_peak(extreme) - there, time
    return (0.0, 0.0, time) if ended == REST else (there, extreme, time)
