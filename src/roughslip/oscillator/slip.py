"""Slip: from X' = V with one sign of the sliding velocity until X' = V again.

sigma = sign(V - X') is constant in a slip phase, so the right-hand side is smooth in every step and nothing is
regularised. Steps end at the nodes of the friction path, where its second derivative jumps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roughslip.compilation import compiled
from roughslip.oscillator.dense_output import lowest, stationary, value, velocity
from roughslip.oscillator.equation import State, completed, cut, place
from roughslip.oscillator.integrators import ORDERS, step
from roughslip.oscillator.path import Path, Piece, largest_kink, offset, piece_at, reaches
from roughslip.oscillator.switching_events import (
    LOWER,
    NONE,
    Branch,
    behind,
    branch_at,
    may_cut,
    on_piece,
    stays_within,
    within_bounds,
)
from roughslip.oscillator.system import Coefficients

AT_BELT, TIME_OVER, PATH_OVER, STEPS_OVER, NO_SLIP, NODES_OVER, NEGATIVE = 0, 1, 2, 3, 4, 5, 6
FIRST_STEP = 0.1  # of a slip phase, in units of 1/omega; one that hides in it is smaller than its error may be
MOST_TRIED = 5  # steps, until one ends at a node
LONGEST_STEP = 0.75  # so that the quintic dense output, which errs by h^6 / 46080, sees every extreme of X'
SHORTEST_SLIP = 1e-7  # a phase back at the belt after so short a time is none: V h^2 / 2 drowns in the rounding of V
SLACK = 1e-3  # of a node spacing: a step that ends so close to a node ends at it, if friction is that of either side
AT_NODE = 1e-9  # of a node spacing: no distance
MISPLACED = 0.1  # of the error allowed: what friction of the wrong side of a node may do
LARGEST_GROWTH, LEAST_GROWTH = 5.0, 0.2  # of a step


class Numerics(NamedTuple):
    """How slip is integrated.

    pair : of pairs.py
    tolerance : [-] of a unit of tau
    refuse : whether negative friction ends the run, else it is cut to zero
    """

    pair: int
    tolerance: float
    refuse: bool


class Pace(NamedTuple):
    """How long the next step of a slip phase may be, all zero before the first one.

    allowed : its length
    grown, length : what the error of the last step that was no shorter than allowed let it grow by, and its length
    """

    allowed: float
    grown: float
    length: float


START = Pace(0.0, 0.0, 0.0)


class Slip(NamedTuple):
    """The end of a slip phase: why and where, whether X' < 0 occurred, steps taken, sum of the local errors [m].

    steps : taken and tried, those that locate the end among them
    pace : for a phase that goes on once more nodes are at hand
    cuts : steps that ended where friction was cut to zero
    """

    status: int
    y: State
    backwards: bool
    steps: int
    error: float
    pace: Pace
    cuts: int


@compiled(error_model="numpy")
def step_to_node(h: float, distance: float, s1: float, s2: float, s3: float) -> float:
    """The largest step up to h that slips no further than distance [m], from three derivatives of s (guarded Newton).

    The next term of the series is left out; it moves the end by some 1e-4 of the distance at a tolerance of 1e-9.
    """
    low, high, step = 0.0, h, h
    if s1 > 0.0:  # the reverted series, which mostly is near enough
        e, c2, c3 = distance / s1, 0.5 * s2 / s1, s3 / (6.0 * s1)
        step = min(h, e * max(0.0, 1.0 - e * (c2 - e * (2.0 * c2 * c2 - c3))))
    for _ in range(60):
        excess = step * (s1 + step * (s2 / 2 + step * s3 / 6)) - distance
        if (excess <= 0.0 and step == h) or abs(excess) <= 1e-2 * SLACK * distance:
            break
        if excess > 0.0:
            high = step
        else:
            low = step
        rate = s1 + step * (s2 + step * s3 / 2)
        newton = step - excess / rate if rate > 0.0 else low
        step = newton if low < newton < high else 0.5 * (low + high)
    return step


@compiled(error_model="numpy")
def to_node(y: State, h: float, right: float, sigma: float, path: Path, p: Coefficients) -> float:
    """The largest step up to h that passes no further along the path, if any, than to its coordinate `right`."""
    if path.nodes.size == 0:
        return h
    if p.advance > 0.0:
        return min(h, (right - p.advance * y.tau) / p.advance)
    return step_to_node(h, right - y.s, sigma * (p.V - y.u), -sigma * y.a, -sigma * y.j)


@compiled()
def turns_backwards(y: State, end: State) -> bool:
    """Whether X' < 0 in a step."""
    if end.u < 0.0:
        return True
    if y.a < 0.0 < end.a:
        u = velocity(y, end)
        return lowest(u) < 0.0 and value(u, stationary(u)) < 0.0
    return False


@compiled(error_model="numpy")
def excess(error: float, h: float, end: State, p: Coefficients, numerics: Numerics) -> float:
    """The error of a step over what is allowed."""
    return error / (h * numerics.tolerance * (p.F + max(abs(end.x), abs(end.u)))) if error != 0.0 else 0.0


@compiled(error_model="numpy")
def misplaced(
    y: State, h: float, sigma: float, piece: Piece, path: Path, p: Coefficients, numerics: Numerics
) -> bool:  # fmt: skip
    """Whether friction of the other side of the node that ends a piece matters at a state beside it, in a step h.

    It errs in proportion to the distance from the node, and X' by half of that times the time there.
    """
    left = piece.right - place(y.tau, y.s, p)
    rate = p.advance if p.advance > 0.0 else sigma * (p.V - y.u)
    if abs(left) <= AT_NODE * path.spacing + 1e-15 * rate * y.tau:
        return False
    passed = min(rate * h, path.spacing) if rate > 0.0 else rate * h
    half = 0.5 * p.F * abs(left)
    if excess(half * largest_kink(path, abs(left) * piece.per_spacing), passed, y, p, numerics) <= MISPLACED:
        return False  # mostly: the piece to come need not be known
    z = piece.right - left
    wrong = abs(offset(piece_at(path, piece.right + SLACK * path.spacing), z) - offset(piece, z))
    return not excess(half * wrong, passed, y, p, numerics) <= MISPLACED


@compiled(forceinline=True, error_model="numpy")
def tried(
    y: State, h: float, sigma: float, piece: Piece, here: Branch, path: Path, p: Coefficients, numerics: Numerics
) -> tuple[State, float, float, float, int]:  # fmt: skip
    """A step h, taken again where it passes a node: its end, error, length, error over what is allowed, and how many
    were taken."""
    taken = 0
    while True:
        end, error = step(numerics.pair, y, h, sigma, piece, here.p)
        ratio, taken = excess(error, h, end, p, numerics), taken + 1
        passed = place(end.tau, end.s, p) - piece.right
        if passed <= 0.0 or not ratio <= 1.0 or taken == MOST_TRIED:
            break
        if not misplaced(end, h, sigma, piece, path, p, numerics):
            break
        rate = p.advance if p.advance > 0.0 else sigma * (p.V - end.u)
        h = h - passed / rate if 0.0 < passed < rate * h else 0.5 * h
    return end, error, h, ratio, taken


@compiled()
def growth(ratio: float, pair: int) -> float:
    """How many times as long a step may be whose error is `ratio` of what is allowed."""
    if not ratio < np.inf:
        return LEAST_GROWTH
    return min(LARGEST_GROWTH, max(LEAST_GROWTH, 0.9 * max(ratio, 1e-9) ** (-1.0 / (ORDERS[pair] - 1))))


@compiled()
def shorter(pace: Pace, h: float) -> Pace:
    """The pace after a step that was too long: the next one has the length h."""
    return Pace(h, pace.grown, pace.length)


@compiled(error_model="numpy")
def next_pace(pace: Pace, h: float, ratio: float, pair: int) -> Pace:
    """The pace after a step of length h whose error is `ratio` of what is allowed.

    Where steps shrink from one to the next, as before the belt, the one to come is to shrink likewise, or every other
    one would be refused (K. Gustafsson, ACM Trans. Math. Softw. 20 (1994) 496). A step that may grow by more than it
    is let tells no trend.
    """
    grown = growth(ratio, pair)
    trend = 1.0
    if pace.grown > 0.0 and grown < LARGEST_GROWTH:
        trend = min(1.0, grown / pace.grown * (h / pace.length))
    return Pace(min(h * max(grown * trend, LEAST_GROWTH), LONGEST_STEP), grown, h)


@compiled()
def draw_slip(
    y: State, end: State, interval: float, sigma: float, piece: Piece, here: Branch, pair: int,
    x_drawn: np.ndarray, u_drawn: np.ndarray,
) -> None:  # fmt: skip
    """X and X' of one step at the multiples of interval in (tau, tau at its end], each by a shorter step: as good as
    the step itself, which a polynomial through its ends is not."""
    for k in range(int(y.tau / interval), min(int(end.tau / interval) + 2, x_drawn.size)):
        if y.tau < k * interval <= end.tau:
            at, _ = step(pair, y, k * interval - y.tau, sigma, piece, here.p)
            x_drawn[k], u_drawn[k] = at.x, at.u


@compiled()
def steady(path: Path, piece: Piece, p: Coefficients) -> bool:
    """Whether acceleration and jerk go on steadily from the piece before."""
    return path.cubic and not may_cut(piece, p)


@compiled()
def begun(start: State, pace: Pace, sigma: float, path: Path, p: Coefficients) -> tuple[Piece, Branch, State]:
    """Piece of the path, branch and state that a slip phase begins with, or goes on with behind the end of a piece."""
    goes_on, z = pace.allowed > 0.0, place(start.tau, start.s, p)
    piece = piece_at(path, z + (SLACK if goes_on else AT_NODE) * path.spacing)
    u = start.u if goes_on else p.V
    here = branch_at(State(start.tau, start.x, u, start.s, 0.0, 0.0), sigma, piece, p)
    if goes_on and steady(path, piece, p):
        return piece, here, start
    return piece, here, completed(start.tau, start.x, u, start.s, sigma, piece, here.p)


@compiled()
def done(
    y: State, z: float, pace: Pace, sigma: float, piece: Piece, path: Path, p: Coefficients, numerics: Numerics
) -> bool:  # fmt: skip
    """Whether a piece of the path that ends close to z, where a motion is, is done with."""
    return not (z < piece.right and misplaced(y, pace.allowed, sigma, piece, path, p, numerics))


@compiled(error_model="numpy")
def slip(
    start: State, since: float, pace: Pace, sigma: float, tau_end: float, path: Path, p: Coefficients,
    numerics: Numerics, step_limit: int, interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray,
) -> Slip:  # fmt: skip
    """A slip phase of sign sigma from X' = V until X' = V again, or until time, path, nodes at hand or steps are over.

    since : tau at which the phase began
    pace : of the phase, all zero at its beginning

    A step h is accepted when its error in X and in X' is below h tolerance (F + max(|X|, |X'|)): error per unit step,
    so that the sum does not grow with the number of nodes that end a step.
    """
    slack = SLACK * path.spacing
    piece, here, y = begun(start, pace, sigma, path, p)
    pace = pace if pace.allowed > 0.0 else Pace(FIRST_STEP, 0.0, 0.0)
    backwards, total, steps, cuts = False, 0.0, 0, 0
    while steps < step_limit:
        first, z = y.tau == since, place(y.tau, y.s, p)
        if z >= piece.right - slack and done(y, z, pace, sigma, piece, path, p, numerics):
            if path.ends and z >= (path.first + path.nodes.size - 1 - SLACK) * path.spacing:
                return Slip(PATH_OVER, y, backwards, steps, total, pace, cuts)
            if not reaches(path, z + slack):
                return Slip(NODES_OVER, y, backwards, steps, total, pace, cuts)
            piece = piece_at(path, z + slack)
            here = on_piece(here, y, sigma, piece, p, numerics.tolerance)
            if not steady(path, piece, p):
                y = completed(y.tau, y.x, y.u, y.s, sigma, piece, here.p)
        h = to_node(y, min(pace.allowed, tau_end - y.tau), piece.right, sigma, path, p)
        if not y.tau + h > y.tau:
            break
        last, whole = h == tau_end - y.tau, h == pace.allowed

        end, error, h, ratio, taken = tried(y, h, sigma, piece, here, path, p, numerics)
        steps += taken
        if not ratio <= 1.0:
            pace = shorter(pace, h * growth(ratio, numerics.pair))
            continue
        if first and sigma * (p.V - end.u) <= 0.0:
            if h < SHORTEST_SLIP:
                return Slip(NO_SLIP, y, False, steps, 0.0, pace, cuts)
            pace = shorter(pace, 0.25 * h)
            continue
        met, length = NONE, h
        if not stays_within(y, end, h, first, here, sigma, piece, p, numerics.tolerance):
            met, end, error, length, taken = within_bounds(
                y, end, error, h, first, here, sigma, piece, p, numerics.pair, numerics.tolerance
            )
            steps += taken
            ratio = excess(error, length, end, p, numerics)
            if not ratio <= 1.0:  # friction may rise steeply at the belt, which the longer step passed over
                pace = shorter(pace, length * growth(ratio, numerics.pair))
                continue
            last, whole = last and length == h, whole and length == h
        if x_drawn.size > 0:
            draw_slip(y, end, interval, sigma, piece, here, numerics.pair, x_drawn, u_drawn)
        backwards = backwards or turns_backwards(y, end)
        total += error
        cuts += cut(end, sigma, piece, p)
        if numerics.refuse and cuts > 0:
            return Slip(NEGATIVE, end, backwards, steps, total, pace, cuts)
        arrived = met == LOWER and here.row == 0
        if arrived or last:
            return Slip(AT_BELT if arrived else TIME_OVER, end, backwards, steps, total, pace, cuts)
        if whole:
            pace = next_pace(pace, h, ratio, numerics.pair)
        y = end
        if met != NONE:
            y, here = behind(end, met, here, sigma, piece, p)
            pace = Pace(pace.allowed, 0.0, 0.0)
    return Slip(STEPS_OVER, y, backwards, steps, total, pace, cuts)
