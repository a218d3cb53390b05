"""Stick: how far it holds, and when and where the mass departs."""

from __future__ import annotations

import math

from numba import njit

from roughslip.oscillator.system import Coefficients

UPPER, LOWER, HELD = 1, -1, 0


@njit(cache=True)
def static_limit(mu_s: float, stochastic: bool, p: Coefficients) -> float:
    """The largest friction deflection F mu [m] that stick transmits.

    It is never below the kinetic one at vanishing speed: beyond the first and within the second neither stick nor
    slip satisfies the law (Filippov's sliding mode, which is stick). So a constant limit, too, follows mu_S upwards.
    """
    kinetic = max(p.static + mu_s, 0.0)
    return p.F * (kinetic if stochastic else max(p.static, kinetic))


@njit(cache=True)
def stick_force(tau: float, x: float, p: Coefficients) -> float:
    """X + 2 D V - q cos(r tau) [m]: the deflection that friction has to balance in stick, eq. (12)."""
    return x + 2.0 * p.D * p.V - (p.q * math.cos(p.r * tau) if p.q > 0.0 else 0.0)


@njit(cache=True)
def _root(a: float, b: float, level: float, tau: float, x: float, p: Coefficients) -> float:
    """Where the stick force, monotone on [a, b], meets the level: bisection down to neighbouring numbers."""
    rising = stick_force(b, x + p.V * (b - tau), p) > level
    while True:
        middle = 0.5 * (a + b)
        if middle <= a or middle >= b:
            return middle
        if (stick_force(middle, x + p.V * (middle - tau), p) > level) == rising:
            b = middle
        else:
            a = middle


@njit(cache=True)
def departure(tau: float, x: float, limit: float, tau_end: float, p: Coefficients) -> tuple[int, float, float]:
    """The end of a stick phase that starts at (tau, x): (UPPER, LOWER or HELD until tau_end, tau, X).

    Without excitation the force rises as V tau, and the departure is known in closed form. With excitation the force
    is monotone between its stationary points, where sin(r tau) = -V / (q r); the first such interval that leaves the
    limits holds the only candidate, so that no short excursion is missed.
    """
    if p.q * p.r == 0.0:
        leave = tau + max(limit - stick_force(tau, x, p), 0.0) / p.V
        if leave >= tau_end:
            return HELD, tau_end, x + p.V * (tau_end - tau)
        return UPPER, leave, x + p.V * (leave - tau)

    rising = True
    rise = fall = math.inf
    stop = math.inf
    if p.q * p.r > p.V:
        arc = math.asin(p.V / (p.q * p.r))
        rise, fall = (math.pi + 2.0 * arc) / p.r, (math.pi - 2.0 * arc) / p.r
        phase = (p.r * tau + arc) % (2.0 * math.pi)  # since the last minimum of the force
        rising = phase < math.pi + 2.0 * arc
        stop = tau + (((math.pi + 2.0 * arc) if rising else 2.0 * math.pi) - phase) / p.r
    start = tau
    while start < tau_end:
        end = min(stop, tau_end)
        level = limit if rising else -limit
        side = UPPER if rising else LOWER
        if side * stick_force(start, x + p.V * (start - tau), p) >= limit:
            return side, start, x + p.V * (start - tau)
        if side * stick_force(end, x + p.V * (end - tau), p) > limit:
            leave = _root(start, end, level, tau, x, p)
            return side, leave, x + p.V * (leave - tau)
        start = end
        rising = not rising
        stop = start + (rise if rising else fall)
    return HELD, tau_end, x + p.V * (tau_end - tau)
