"""Where the equation of slip changes: at the belt, and at kinks of the friction law.

Between these bounds the equation is smooth. A step follows the equation of the side that it starts from, continued
beyond the bound, and is repeated so that it ends at the bound. The reason: with stages on both sides of a kink, the
error estimate of an embedded pair may vanish where the error does not (E. Hairer, S. P. Nørsett & G. Wanner, Solving
Ordinary Differential Equations I, 2nd ed. 1993, II.6). Where friction is cut to zero no step ends.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, slip_state
from roughslip.oscillator.laws import only_row, row_at, row_ends
from roughslip.oscillator.path import Piece
from roughslip.oscillator.runge_kutta import (
    Quintic,
    first_zero,
    lowest,
    quintic,
    sign_changes,
    single_step,
    slope,
    stationary,
    value,
)

NONE, LOWER, UPPER = 0, 1, 2  # the bound that a step ends at; no sides of slip
GRAZING = 1e-5  # of V + F: an extreme of X' so close to the belt is decided by a step that ends there
REACHED = 1e-15  # of V: X' is the belt's
NEAR = 1e-5  # of a step: within this distance the series of X' up to the jerk locates the belt to 1e-15 of the step
MOST_TAKEN = 200  # steps to meet a bound
ROUNDED = 1e-14  # of belt and knot: the least distance, where the knots of a table are that close
BEYOND = 0.1  # of the tolerance: the branch changes so far beyond a kink, else rounding would alternate branches


class Branch(NamedTuple):
    """One smooth form of the equation: a row of the friction law, 0 for a law without kinks, and its coefficients p."""

    row: int
    p: Coefficients


class Sliding(NamedTuple):
    """Slip of one sign along one piece of the friction path, with the coefficients of all branches."""

    sigma: float
    piece: Piece
    p: Coefficients


class Bound(NamedTuple):
    """An end of a branch: the distance side (level - X') [m] is positive within the branch."""

    side: float
    level: float


@compiled(error_model="numpy")
def branch(row: int, p: Coefficients) -> Branch:
    """The branch of a row."""
    return Branch(row, Coefficients(p.F, p.V, p.D, p.omega, p.q, p.r, p.excited, p.multiplies, only_row(row, p.law)))


@compiled(error_model="numpy")
def branch_at(u: float, sigma: float, p: Coefficients) -> Branch:
    """The branch that holds a velocity X' [m]."""
    return branch(row_at(sigma * p.omega * (p.V - u), p.law), p)


@compiled(error_model="numpy")
def shorter_row(row: int, law: Any) -> float:
    """The length [m/s] of the shorter of a row and the next one."""
    low, middle = row_ends(row, law)
    return min(middle - low, row_ends(row + 1, law)[1] - middle)


@compiled(forceinline=True, error_model="numpy")
def bound(kind: int, here: Branch, sigma: float, tolerance: float, p: Coefficients) -> Bound:
    """A bound of a branch; that of the first row to below is the belt."""
    low, high = row_ends(here.row, p.law)
    if kind == UPPER:
        margin = max(BEYOND * tolerance * shorter_row(here.row, p.law), ROUNDED * (p.V * p.omega + high))
        return Bound(-sigma, p.V - sigma * (high + margin) / p.omega)
    if here.row == 0:
        return Bound(sigma, p.V)
    margin = max(BEYOND * tolerance * shorter_row(here.row - 1, p.law), ROUNDED * (p.V * p.omega + low))
    return Bound(sigma, p.V - sigma * (low - margin) / p.omega)


@compiled(forceinline=True)
def gap_over(y: State, end: State, h: float, to: Bound) -> Quintic:
    """The distance from a bound over a step h."""
    side = to.side
    start, stop = side * (to.level - y.u), side * (to.level - end.u)
    return quintic(h, start, -side * y.a, -side * y.j, stop, -side * end.a, -side * end.j)


@compiled(forceinline=True)
def bracket(gap: Quintic, h: float, p: Coefficients) -> float:
    """The part of a step h to repeat, given its distance `gap` from a bound; 0 if the step does not meet the bound.

    It is the whole step where the dense output has one root, and the part up to the extreme where it has an extreme
    near the bound. In other cases it is half the step, which is judged in the same way. A repeated step that ends at an
    extreme without meeting the bound is accepted, and the next step begins there.
    """
    if gap.b5 <= 0.0:
        return h if sign_changes(gap) <= 1 else 0.5 * h
    if lowest(gap) > 0.0:
        return 0.0
    if slope(gap, 0.0) < 0.0 < slope(gap, 1.0):
        t = stationary(gap)
        margin = GRAZING * (p.V + p.F) * (4.0 * t * (1.0 - t)) ** 3  # the quintic errs as t^3 (1 - t)^3
        return t * h if value(gap, t) <= margin else 0.0
    return 0.5 * h


@compiled(error_model="numpy")
def time_left(gap: float, rate: float, bend: float) -> float:
    """The time from near a bound until it is met, by the series to the second derivative; infinite where it is not."""
    root = rate * rate - 2.0 * bend * gap
    return 2.0 * gap / (math.sqrt(root) - rate) if rate < 0.0 and root > 0.0 else np.inf


@compiled()
def arrival(y: State, dt: float, to: Bound, sigma: float, p: Coefficients) -> State:
    """The state at a bound a short time dt after, or before, y."""
    dx = dt * (y.u + dt * (y.a / 2 + dt * y.j / 6))
    return State(y.tau + dt, y.x + dx, to.level, y.s + sigma * (p.V * dt - dx), y.a + dt * y.j, y.j)


@compiled(error_model="numpy")
def locate_bound(
    y: State, end: State, h: float, late: float, to: Bound, here: Branch, sliding: Sliding
) -> tuple[bool, State, float, float, int]:
    """Shorten a step h from y to `end` so that it ends at a bound, by Newton steps in the bracket (0, late].

    Returns whether the step meets the bound, its end, error and length, and the number of steps taken. A step that
    does not meet the bound has the length `late`.
    """
    sigma, piece, p = sliding
    low, high, taken, error = 0.0, late, 0, 0.0
    near = REACHED * abs(to.level)
    trial = late if late < h else h * first_zero(gap_over(y, end, h, to))
    while taken < 100:
        h = trial
        end, error = single_step(y, h, sigma, piece, here.p)
        taken += 1
        gap, rate, bend = to.side * (to.level - end.u), -to.side * end.a, -to.side * end.j
        if gap > 0.0 and h == late:
            return False, end, error, h, taken
        left = time_left(gap, rate, bend)
        if abs(left) <= NEAR * h and h + left <= late:
            return True, arrival(end, left, to, sigma, p), error, h + left, taken
        if gap > 0.0:
            low = h
        else:
            high = h
        trial = h + left if low < h + left < high else 0.5 * (low + high)
        if abs(gap) <= near or abs(trial - h) <= 1e-15 * late:
            break
    return True, arrival(end, 0.0, to, sigma, p), error, h, taken


@compiled(forceinline=True, error_model="numpy")
def stays_within(y: State, end: State, h: float, first: bool, here: Branch, sliding: Sliding, tolerance: float) -> bool:
    """Whether a step h from y to `end` certainly meets no bound of its branch, a cheap test that most steps pass.

    first : whether the step departs from the belt, so that the belt does not count as a bound
    """
    sigma, _, p = sliding
    if row_ends(here.row, p.law)[1] < np.inf:
        return False
    return (first and here.row == 0) or bracket(
        gap_over(y, end, h, bound(LOWER, here, sigma, tolerance, p)), h, p
    ) == 0.0


@compiled(error_model="numpy")
def end_at_first_bound(
    y: State, end: State, error: float, h: float, first: bool, here: Branch, sliding: Sliding, tolerance: float,
) -> tuple[int, State, float, float, int]:  # fmt: skip
    """Shorten a step h from y to `end` to where it meets the first bound of its branch; arguments as above.

    Returns the bound (NONE if the step meets none), end, error and length of the step, and the number of steps taken.
    """
    sigma, _, p = sliding
    met, taken = NONE, 0
    for kind in (LOWER, UPPER):
        if kind == LOWER and first and here.row == 0:
            continue
        if kind == UPPER and not row_ends(here.row, p.law)[1] < np.inf:
            continue
        to = bound(kind, here, sigma, tolerance, p)
        late = bracket(gap_over(y, end, h, to), h, p)
        while late > 0.0 and taken < MOST_TAKEN:
            halved = late == 0.5 * h
            arrived, end, error, h, trials = locate_bound(y, end, h, late, to, here, sliding)
            met = kind if arrived else NONE
            taken += trials
            if arrived or not halved:
                break
            late = bracket(gap_over(y, end, h, to), h, p)
    return met, end, error, h, taken


@compiled()
def cross_bound(y: State, met: int, here: Branch, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, Branch]:
    """The state at a bound, and the branch beyond the bound."""
    there = branch(here.row + (1 if met == UPPER else -1), p)
    return slip_state(y.tau, y.x, y.u, y.s, sigma, piece, there.p), there
