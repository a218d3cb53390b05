"""Stick: how far it holds, and when and where the mass departs."""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients
from roughslip.oscillator.path import Path, Piece, mu_s_at, mu_s_curvature, piece_at, reaches

UPPER, LOWER, HELD, PAUSED = 1, -1, 0, 2
RESOLUTION = 1e-12  # of tau, to which the first passage on a path is bracketed,
WIDEST = 1e-6  # and up to which the bracket widens where force and limit are too close for any bound


@compiled()
def limit_levels(stochastic: bool, p: Coefficients) -> tuple[float, float]:
    """(floor, base) of the limit of stick, max(floor, base + mu_S).

    It is never below the kinetic friction at vanishing speed: for a force between the two, neither stick nor slip would
    satisfy the law (Filippov's sliding mode, which is stick). So a constant limit also follows mu_S upwards.
    """
    return (0.0, p.law.static) if stochastic else (p.law.static, p.law.rest)


@compiled()
def static_limit(mu_s: float, stochastic: bool, p: Coefficients) -> float:
    """The largest friction deflection F mu [m] that stick transmits."""
    floor, base = limit_levels(stochastic, p)
    return p.F * max(floor, base + mu_s)


@compiled()
def stick_force(tau: float, x: float, p: Coefficients) -> float:
    """X + 2 D V - q cos(r tau) [m]: the deflection that friction has to balance in stick, eq. (12)."""
    return x + 2.0 * p.D * p.V - (p.q * math.cos(p.r * tau) if p.q > 0.0 else 0.0)


@compiled()
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


@compiled()
def departure(tau: float, x: float, limit: float, tau_end: float, p: Coefficients) -> tuple[int, float, float]:
    """The end of a stick phase that starts at (tau, x): (UPPER, LOWER or HELD until tau_end, tau, X).

    Without excitation the force rises as V tau, and the departure is known in closed form. With excitation the force
    is monotone between its stationary points, where sin(r tau) = -V / (q r). The first such interval that leaves the
    limits contains the departure, so no short excursion is missed.
    """
    if p.q * p.r == 0.0:
        spare = max(limit - stick_force(tau, x, p), 0.0)
        leave = tau + (spare / p.V if p.V > 0.0 else math.inf)
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


@compiled()
def sample_stick(
    start: float, x: float, end: float, interval: float, p: Coefficients, x_drawn: np.ndarray, u_drawn: np.ndarray
) -> None:
    """Store X and X' in stick from (start, x) on, at the multiples of interval in (start, end]."""
    for k in range(int(start / interval), min(int(end / interval) + 2, x_drawn.size)):
        if start < k * interval <= end:
            x_drawn[k], u_drawn[k] = x + p.V * (k * interval - start), p.V


@compiled()
def passage(
    tau: float, x: float, tau_end: float, path: Path, stochastic: bool, p: Coefficients
) -> tuple[int, float, float]:
    """The end of a stick phase from (tau, x) where mu_S goes with time or the belt: its first passage on the path.

    Returns (UPPER, LOWER, HELD until tau_end, or PAUSED at the end of the present nodes; tau, X). The search goes piece
    by piece from the left: an interval that a bound clears is passed, any other interval is halved. So it finds every
    excursion beyond the limit longer than RESOLUTION, or than WIDEST where it stays within rounding of the limit.
    """
    floor, base = limit_levels(stochastic, p)
    piece = piece_at(path, p.advance * tau)
    a, width, finest = tau, math.inf, RESOLUTION * (1.0 + 1e-3 * tau)
    for side in (UPPER, LOWER):
        if min(_excess(side, a, x, piece, floor, base, p)) > 0.0:
            return side, a, x
    while a < tau_end:
        if p.advance * a >= piece.right * (1.0 - 1e-15):
            inside = piece.right + 0.5 / piece.per_spacing
            if not reaches(path, inside) or (path.ends and inside > (path.first + path.nodes.size - 1) * path.spacing):
                return PAUSED, a, x + p.V * (a - tau)
            piece = piece_at(path, inside)
        b = min(min(a + width, piece.right / p.advance), tau_end)
        x_a, x_b = x + p.V * (a - tau), x + p.V * (b - tau)
        upper = _holds(UPPER, a, x_a, b, x_b, piece, floor, base, p)
        if upper and _holds(LOWER, a, x_a, b, x_b, piece, floor, base, p):
            a, width, finest = b, 2.0 * (b - a), RESOLUTION * (1.0 + 1e-3 * a)
        elif b - a > finest:
            width = 0.5 * (b - a)
        else:
            for side in (UPPER, LOWER):
                if min(_excess(side, b, x_b, piece, floor, base, p)) > 0.0:
                    return side, b, x_b
            finest = min(2.0 * finest, max(WIDEST, finest))
            a, width = b, finest
    return HELD, tau_end, x + p.V * (tau_end - tau)


@compiled()
def _excess(
    side: int, tau: float, x: float, piece: Piece, floor: float, base: float, p: Coefficients
) -> tuple[float, float]:
    """Excess [m] of the force to one side over F (base + mu_S) and over F floor; stick ends where both are positive."""
    force = side * stick_force(tau, x, p)
    return force - p.F * (base + mu_s_at(piece, p.advance * tau)), force - p.F * floor


@compiled()
def _holds(
    side: int, a: float, x_a: float, b: float, x_b: float, piece: Piece, floor: float, base: float, p: Coefficients
) -> bool:
    """Whether stick certainly holds on [a, b] within a piece.

    A function exceeds its chord by at most (b - a)^2 / 8 times the largest second derivative, which a cubic has at an
    end.
    """
    path_a, floor_a = _excess(side, a, x_a, piece, floor, base, p)
    path_b, floor_b = _excess(side, b, x_b, piece, floor, base, p)
    eighth = 0.125 * (b - a) ** 2
    bend = eighth * p.q * p.r * p.r
    curvature = max(abs(mu_s_curvature(piece, p.advance * a)), abs(mu_s_curvature(piece, p.advance * b)))
    sag = eighth * p.F * p.advance * p.advance * curvature
    return max(path_a, path_b) + bend + sag <= 0.0 or max(floor_a, floor_b) + bend <= 0.0
