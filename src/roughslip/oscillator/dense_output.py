"""Dense output of a step of any method: quintics through value and two derivatives at its two ends.

X with X' and X'', and X' with X'' and X''', which the equation gives, are known at the ends of every step. The quintic
errs by h^6 / 46080 of the sixth derivative beyond that. In Bernstein's form it lies within the range of its control
points, so a step that stays away from the belt needs no search for a root (G. Farin, Curves and Surfaces for CAGD, 5th
ed. 2002, ch. 6).
"""

from __future__ import annotations

from typing import NamedTuple

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import State

HALVINGS = 52
CONVERGED = 1e-9  # of a step, between two iterates of a root: Newton has doubled the digits by then


class Quintic(NamedTuple):
    """Control points of a quintic over a step, of which the fraction t runs from 0 to 1."""

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


@compiled()
def velocity(y0: State, y1: State) -> Quintic:
    """X' over a step."""
    return quintic(y1.tau - y0.tau, y0.u, y0.a, y0.j, y1.u, y1.a, y1.j)


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
