"""One step of slip by Fehlberg's embedded Runge-Kutta pair, and the motion between the ends of a step.

It has order 5 and an estimate of order 4 (E. Fehlberg, NASA TR R-315, 1969). Steps are written into their callers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, acceleration, slip_state
from roughslip.oscillator.laws import CONTRACTED
from roughslip.oscillator.path import Piece, mu_s_at

# The tableau, in tuples without zeros, so that the compiler writes out their sums: nodes, rows, weights of order 5 of
# all stages but the second, and these less those of order 4.
NODES = (0.0, 1 / 4, 3 / 8, 12 / 13, 1.0, 1 / 2)
ROWS = (
    (1 / 4,),
    (3 / 32, 9 / 32),
    (1932 / 2197, -7200 / 2197, 7296 / 2197),
    (439 / 216, -8.0, 3680 / 513, -845 / 4104),
    (-8 / 27, 2.0, -3544 / 2565, 1859 / 4104, -11 / 40),
)
WEIGHTS = (16 / 135, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55)
ERROR = (1 / 360, -128 / 4275, -2197 / 75240, 1 / 50, 2 / 55)
HALVINGS = 52
CONVERGED = 1e-9  # of a step, between two iterates of a root: Newton has doubled the digits by then


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def weighted(row: tuple[float, ...], values: tuple[float, ...]) -> float:
    """The sum of products of two tuples of the same length."""
    total = row[0] * values[0]
    for i in range(1, len(row)):
        total += row[i] * values[i]
    return total


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def stage(
    y: State, h: float, c: float, rise: float, gain: float, sigma: float, piece: Piece, p: Coefficients
) -> tuple[float, float]:
    """X' and X'' of the stage at y.tau + c h, from those of earlier stages as a row of the tableau weighs them.

    The slipped distance needs no equation of its own: s + sigma (X - V tau) is constant in slip.
    """
    x, u = y.x + h * rise, y.u + h * gain
    s = y.s + sigma * (p.V * (c * h) - (x - y.x))
    return u, acceleration(y.tau + c * h, x, u, sigma, mu_s_at(piece, s), p)


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def step(y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state of fifth order after a step h, with its acceleration and jerk, and the error of the fourth [m]."""
    u, a, c, rows = y.u, y.a, NODES, ROWS

    def next_stage(c: float, row: Any, us: Any, accelerations: Any) -> tuple[float, float]:
        return stage(y, h, c, weighted(row, us), weighted(row, accelerations), sigma, piece, p)

    u2, a2 = next_stage(c[1], rows[0], (u,), (a,))
    u3, a3 = next_stage(c[2], rows[1], (u, u2), (a, a2))
    u4, a4 = next_stage(c[3], rows[2], (u, u2, u3), (a, a2, a3))
    u5, a5 = next_stage(c[4], rows[3], (u, u2, u3, u4), (a, a2, a3, a4))
    u6, a6 = next_stage(c[5], rows[4], (u, u2, u3, u4, u5), (a, a2, a3, a4, a5))
    us, accelerations = (u, u3, u4, u5, u6), (a, a3, a4, a5, a6)
    dx, du = h * weighted(WEIGHTS, us), h * weighted(WEIGHTS, accelerations)
    x_new = y.x + dx
    s_new = y.s + sigma * (p.V * h - (x_new - y.x))
    end = slip_state(y.tau + h, x_new, u + du, s_new, sigma, piece, p)
    x_error, u_error = h * weighted(ERROR, us), h * weighted(ERROR, accelerations)
    return end, max(abs(x_error), abs(u_error))


@compiled()
def single_step(y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The same, compiled once for callers whose time does not count."""
    return step(y, h, sigma, piece, p)


@compiled(error_model="numpy")
def error_ratio(error: float, h: float, end: State, p: Coefficients, tolerance: float) -> float:
    """The error of a step h over the error allowed."""
    return error / (h * tolerance * (p.F + max(abs(end.x), abs(end.u)))) if error != 0.0 else 0.0


class Quintic(NamedTuple):
    """Control points in Bernstein's form of a quintic over a step, of which the fraction t runs from 0 to 1.

    It has the value and two derivatives of X or X' at both ends, and errs by h^6 / 46080 of the sixth derivative. It
    lies within the range of its points, so that a step away from the belt needs no search for a root (G. Farin, Curves
    and Surfaces for CAGD, 5th ed. 2002, ch. 6).
    """

    b0: float
    b1: float
    b2: float
    b3: float
    b4: float
    b5: float


@compiled(forceinline=True)
def quintic(h: float, y0: float, d0: float, e0: float, y1: float, d1: float, e1: float) -> Quintic:
    """The quintic with value y, slope d and second derivative e at the two ends of a step h."""
    w, v = 0.2 * h, 0.05 * h * h
    return Quintic(y0, y0 + w * d0, y0 + 2.0 * w * d0 + v * e0, y1 - 2.0 * w * d1 + v * e1, y1 - w * d1, y1)


@compiled(forceinline=True)
def value(b: Quintic, t: float) -> float:
    """The quintic at the fraction t."""
    r = 1.0 - t
    low = r * r * (r * b.b0 + 5.0 * t * b.b1) + 10.0 * r * t * t * b.b2
    return r * r * low + t * t * t * (10.0 * r * r * b.b3 + t * (5.0 * r * b.b4 + t * b.b5))


@compiled(forceinline=True)
def slope(b: Quintic, t: float) -> float:
    """Its derivative by t."""
    r = 1.0 - t
    low = r * r * (b.b1 - b.b0) + 4.0 * r * t * (b.b2 - b.b1)
    high = 4.0 * r * t * (b.b4 - b.b3) + t * t * (b.b5 - b.b4)
    return 5.0 * (r * r * (low + 6.0 * t * t * (b.b3 - b.b2)) + t * t * high)


@compiled(forceinline=True)
def lowest(b: Quintic) -> float:
    """A number that the quintic does not fall below."""
    return min(min(min(b.b0, b.b1), min(b.b2, b.b3)), min(b.b4, b.b5))


@compiled(forceinline=True)
def sign_changes(b: Quintic) -> int:
    """Number of sign changes of the control points: the number of roots of the quintic, or an even number more."""
    changes, last = 0, b.b0
    for point in (b.b1, b.b2, b.b3, b.b4, b.b5):
        if point * last < 0.0:
            changes += 1
        if point != 0.0:
            last = point
    return changes


@compiled()
def first_zero(b: Quintic) -> float:
    """The fraction where a quintic that begins above zero and has one root meets it, by guarded Newton steps."""
    low, high, t = 0.0, 1.0, b.b0 / (b.b0 - b.b5) if b.b5 < 0.0 < b.b0 else 0.5
    for _ in range(HALVINGS):
        gap = value(b, t)
        if gap > 0.0:
            low = t
        else:
            high = t
        rate = slope(b, t)
        newton = t - gap / rate if rate < 0.0 else low
        last, t = t, newton if low < newton < high else 0.5 * (low + high)
        if abs(t - last) <= CONVERGED:
            break
    return t


@compiled(forceinline=True)
def stationary(b: Quintic) -> float:
    """The fraction of an extreme of a quintic whose slope has different signs at the ends, by bisection."""
    low, high = 0.0, 1.0
    falls = b.b1 < b.b0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if (slope(b, middle) < 0.0) == falls:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
