"""Slip: from X' = V with one sign of the sliding velocity until X' = V again.

sigma = sign(V - X') is constant in a slip phase, so the right-hand side is smooth in every step and nothing is
regularised. Steps end at the nodes of the friction path, where its second derivative jumps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from roughslip.oscillator.dense import (
    Quintic,
    draw,
    first_zero,
    lowest,
    quintic,
    sign_changes,
    slope,
    stationary,
    value,
    velocity,
)
from roughslip.oscillator.equation import State, completed, cut, place
from roughslip.oscillator.pairs import ORDERS, step
from roughslip.oscillator.path import Path, Piece, piece_at, reaches
from roughslip.oscillator.system import Coefficients

AT_BELT, TIME_OVER, PATH_OVER, STEPS_OVER, NO_SLIP, NODES_OVER, NEGATIVE = 0, 1, 2, 3, 4, 5, 6
FIRST_STEP = 1e-2  # of a slip phase, in units of 1/omega
LONGEST_STEP = 0.5  # so that the quintic dense output sees every extreme of X'
SHORTEST_SLIP = 1e-7  # a phase back at the belt after so short a time is none: V h^2 / 2 drowns in the rounding of V
SLACK = 1e-3  # of a node spacing: a step that ends so close to a node ends at it
GRAZING = 1e-5  # of V + F: an extreme of X' so close to the belt is judged by a step that ends there
REACHED = 1e-15  # of V: X' is the belt's
NEAR = 1e-5  # of a step: from so close the series of X' to the jerk meets the belt, to 1e-15 of what the step does


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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True)
def gap_over(y: State, end: State, h: float, sigma: float, p: Coefficients) -> Quintic:
    """sigma (V - X') over a step h: zero at the belt."""
    start, stop = sigma * (p.V - y.u), sigma * (p.V - end.u)
    return quintic(h, start, -sigma * y.a, -sigma * y.j, stop, -sigma * end.a, -sigma * end.j)


@njit(cache=True)
def belt_bracket(y: State, end: State, h: float, sigma: float, p: Coefficients) -> float:
    """How much of a step h from y to `end` is to be taken again to tell whether X' = V; 0 if it stays away.

    Where the dense output has one root, up to the end; where it has an extreme near the belt, up to there; where it
    is not clear, half the step. A step taken again that does not meet the belt stands, and the next begins there.
    """
    gap = gap_over(y, end, h, sigma, p)
    if gap.b5 <= 0.0:
        return h if sign_changes(gap) <= 1 else 0.5 * h
    if lowest(gap) > 0.0:
        return 0.0
    if slope(gap, 0.0) < 0.0 < slope(gap, 1.0):
        t = stationary(gap)
        margin = GRAZING * (p.V + p.F) * (4.0 * t * (1.0 - t)) ** 3  # the quintic errs as t^3 (1 - t)^3
        return t * h if value(gap, t) <= margin else 0.0
    return 0.5 * h


@njit(cache=True, error_model="numpy")
def to_belt(y: State, sigma: float, p: Coefficients) -> float:
    """The time from near the belt until X' = V by the series of X' to the jerk; infinite where it turns away."""
    gap, rate = sigma * (p.V - y.u), sigma * y.a
    root = rate * rate + 2.0 * sigma * y.j * gap
    return 2.0 * gap / (rate + math.sqrt(root)) if rate > 0.0 and root > 0.0 else np.inf


@njit(cache=True)
def arrival(y: State, dt: float, sigma: float, p: Coefficients) -> State:
    """The state at the belt a short time dt after, or before, y."""
    dx = dt * (y.u + dt * (y.a / 2 + dt * y.j / 6))
    return State(y.tau + dt, y.x + dx, p.V, y.s + sigma * (p.V * dt - dx), y.a + dt * y.j, y.j)


@njit(cache=True, error_model="numpy")
def meet_belt(
    y: State, end: State, h: float, late: float, sigma: float, piece: Piece, p: Coefficients, pair: int
) -> tuple[bool, State, float, float, int]:  # fmt: skip
    """Shorten a step h from y to `end` so that X' = V to rounding: Newton on re-taken steps in the bracket (0, late].

    Returns whether it meets the belt, else the step that ends at late and has not reached it; the end, the error and
    the length of the step, and how many were taken.
    """
    low, high, taken, error = 0.0, late, 0, 0.0
    trial = late if late < h else h * first_zero(gap_over(y, end, h, sigma, p))
    while taken < 100:
        h = trial
        end, error = step(pair, y, h, sigma, piece, p)
        taken += 1
        gap = sigma * (p.V - end.u)
        if gap > 0.0 and h == late:
            return False, end, error, h, taken
        left = to_belt(end, sigma, p)
        if abs(left) <= NEAR * h and h + left <= late:
            return True, arrival(end, left, sigma, p), error, h + left, taken
        if gap > 0.0:
            low = h
        else:
            high = h
        trial = h + left if low < h + left < high else 0.5 * (low + high)
        if abs(gap) <= REACHED * p.V or abs(trial - h) <= 1e-15 * late:
            break
    return True, State(end.tau, end.x, p.V, end.s, end.a, end.j), error, h, taken


@njit(cache=True, error_model="numpy")
def to_node(y: State, h: float, right: float, sigma: float, p: Coefficients) -> float:
    """The largest step up to h that passes no further along the path than to its coordinate `right`."""
    if p.advance > 0.0:
        return min(h, (right - p.advance * y.tau) / p.advance)
    return step_to_node(h, right - y.s, sigma * (p.V - y.u), -sigma * y.a, -sigma * y.j)


@njit(cache=True)
def turns_backwards(y: State, end: State) -> bool:
    """Whether X' < 0 in a step."""
    if end.u < 0.0:
        return True
    if y.a < 0.0 < end.a:
        u = velocity(y, end)
        return lowest(u) < 0.0 and value(u, stationary(u)) < 0.0
    return False


@njit(cache=True, error_model="numpy")
def excess(error: float, h: float, end: State, p: Coefficients, numerics: Numerics) -> float:
    """The error of a step over what is allowed."""
    return error / (h * numerics.tolerance * (p.F + max(abs(end.x), abs(end.u))))


@njit(cache=True)
def growth(ratio: float, pair: int) -> float:
    """How many times as long a step may be whose error is `ratio` of what is allowed, 0.2 to 5."""
    if not ratio < np.inf:
        return 0.2
    return min(5.0, max(0.2, 0.9 * max(ratio, 1e-9) ** (-1.0 / (ORDERS[pair] - 1))))


@njit(cache=True)
def shorter(pace: Pace, h: float) -> Pace:
    """The pace after a step that was too long: the next one has the length h."""
    return Pace(h, pace.grown, pace.length)


@njit(cache=True, error_model="numpy")
def next_pace(pace: Pace, h: float, ratio: float, pair: int) -> Pace:
    """The pace after a step of length h whose error is `ratio` of what is allowed.

    Where steps shrink from one to the next, as before the belt, the one to come is to shrink likewise, or every other
    one would be refused (K. Gustafsson, ACM Trans. Math. Softw. 20 (1994) 496).
    """
    grown = growth(ratio, pair)
    trend = grown / pace.grown * (h / pace.length) if pace.grown > 0.0 else 1.0
    return Pace(min(h * grown * min(1.0, trend), LONGEST_STEP), grown, h)


@njit(cache=True, error_model="numpy")
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
    pair = numerics.pair
    slack = SLACK * path.spacing
    piece = piece_at(path, place(start.tau, start.s, p) + slack)
    y = completed(start.tau, start.x, p.V if pace.allowed == 0.0 else start.u, start.s, sigma, piece, p)
    pace = pace if pace.allowed > 0.0 else Pace(FIRST_STEP, 0.0, 0.0)
    backwards, total, steps, cuts = False, 0.0, 0, 0
    while steps < step_limit:
        first = y.tau == since
        z = place(y.tau, y.s, p)
        if z >= piece.right - slack:
            if path.ends and z >= (path.first + path.nodes.size - 1 - SLACK) * path.spacing:
                return Slip(PATH_OVER, y, backwards, steps, total, pace, cuts)
            if not reaches(path, z + slack):
                return Slip(NODES_OVER, y, backwards, steps, total, pace, cuts)
            piece = piece_at(path, z + slack)
            y = completed(y.tau, y.x, y.u, y.s, sigma, piece, p)
        h = min(pace.allowed, tau_end - y.tau)
        if path.nodes.size > 0:
            h = to_node(y, h, piece.right, sigma, p)
        last, whole = h == tau_end - y.tau, h == pace.allowed

        end, error = step(pair, y, h, sigma, piece, p)
        steps += 1
        ratio = excess(error, h, end, p, numerics)
        if not ratio <= 1.0:
            pace = shorter(pace, h * growth(ratio, pair))
            continue
        arrived = False
        if first:
            if sigma * (p.V - end.u) <= 0.0:
                if h < SHORTEST_SLIP:
                    return Slip(NO_SLIP, y, False, steps, 0.0, pace, cuts)
                pace = shorter(pace, 0.25 * h)
                continue
        else:
            late = belt_bracket(y, end, h, sigma, p)
            if late > 0.0:
                arrived, end, error, length, taken = meet_belt(y, end, h, late, sigma, piece, p, pair)
                steps += taken
                met = excess(error, length, end, p, numerics)
                if not met <= 1.0:  # friction may rise steeply at the belt, which the longer step passed over
                    pace = shorter(pace, length * growth(met, pair))
                    continue
                last, whole = last and late == h, whole and late == h
        if x_drawn.size > 0:
            draw(y, end, interval, x_drawn, u_drawn)
        backwards = backwards or turns_backwards(y, end)
        total += error
        if cut(end, sigma, piece, p):
            cuts += 1
            if numerics.refuse:
                return Slip(NEGATIVE, end, backwards, steps, total, pace, cuts)
        if arrived or last:
            return Slip(AT_BELT if arrived else TIME_OVER, end, backwards, steps, total, pace, cuts)
        if whole:
            pace = next_pace(pace, h, ratio, pair)
        y = end
    return Slip(STEPS_OVER, y, backwards, steps, total, pace, cuts)
