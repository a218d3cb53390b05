"""Slip: from X' = V with one sign of the sliding velocity until X' = V again.

sigma = sign(V - X') [-] is constant in a slip phase, so that the equation is smooth in every step and needs no
regularisation. Further symbols:

- tau : omega t [-], and h a step of it
- y, end : states (`equation.State`) at the two ends of a step
- p : coefficients of the equation
- s : slipped distance [m], the coordinate of the friction path
- piece : part of the path between two nodes. A step ends there, because the second derivative jumps
- here : smooth branch of the equation that holds y
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, gain, slip_state, total_friction, with_jerk
from roughslip.oscillator.path import Path, Piece, mu_s_at, piece_at, reaches
from roughslip.oscillator.runge_kutta import error_ratio, lowest, quintic, single_step, stationary, step, value
from roughslip.oscillator.switching_events import (
    LOWER,
    NONE,
    Branch,
    Sliding,
    branch_at,
    cross_bound,
    end_at_first_bound,
    stays_within,
)
from roughslip.oscillator.wide_step import wide_step

FIRST_STEP = 0.1  # of a slip phase, in units of 1/omega; a phase that ends within it moves less than the error allowed
MOST_TRIED = 5  # trial steps until one ends at a node of the path
LONGEST_STEP = 0.75  # so that the quintic dense output, which errs by h^6 / 46080, sees every extreme of X'
SHORTEST_SLIP = 1e-7  # a shorter phase does not count as slip: V h^2 / 2 is below the rounding of V
SLACK = 1e-3  # of a node spacing: a step that ends so close to a node ends at it, where both sides give equal friction
AT_NODE = 1e-9  # of a node spacing: counts as zero
MISPLACED = 0.1  # of the error allowed: the largest effect of using friction from the wrong side of a node
LARGEST_GROWTH, LEAST_GROWTH = 5.0, 0.2  # of a step
START, FIRST = (0.0, -1), (FIRST_STEP, -1)  # `Slip.pace` before a phase, and of its first step


class Status(IntEnum):
    """Why a slip phase or a run ends."""

    AT_BELT = 0  # X' is the velocity of the belt again
    TIME_OVER = 1
    PATH_OVER = 2
    STEPS_OVER = 3
    NO_SLIP = 4  # the mass is pulled back to the belt at once
    NODES_OVER = 5  # the motion needs more nodes of the path than are present
    STEP_LOST = 6  # the next step is too short to change tau
    GOES_ON = 7  # it does not end


class Horizon(NamedTuple):
    """Up to which tau a motion runs, and for how many steps at most; from `after` the first departure on, only until a
    cycle ends or a slip is longer than `longest`."""

    tau: float
    steps: int
    after: float = math.inf
    longest: float = math.inf


class Samples(NamedTuple):
    """Arrays x, u : (samples,) that receive X and X' at the multiples of interval; empty ones receive nothing."""

    interval: float
    x: np.ndarray
    u: np.ndarray


class Slip(NamedTuple):
    """The end of a slip phase.

    status, y : why and where it ends
    backwards : whether X' < 0 occurred, in this phase or before
    steps : number of steps, with the rejected ones and those that locate the end
    error : [m] sum of the local errors
    pace : for a phase that continues when more nodes are present: the longest next step, and `level` of `wide_step`
    cuts : steps that ended where friction was cut to zero
    """

    status: Status
    y: State
    backwards: bool
    steps: int
    error: float
    pace: tuple[float, int]
    cuts: int


@compiled(error_model="numpy")
def step_to_node(h: float, distance: float, s1: float, s2: float, s3: float) -> float:
    """The largest step up to h that slips no further than distance [m], from three derivatives of s by guarded Newton.

    The next term of the series would move the end by some 1e-4 of the distance at a tolerance of 1e-9.
    """
    low, high, step = 0.0, h, h
    if s1 > 0.0:  # the reverted series, which is usually accurate enough
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
    """The largest step up to h that does not slip beyond `right` [m], if there is a path."""
    if path.nodes.size == 0:
        return h
    return step_to_node(h, right - y.s, sigma * (p.V - y.u), -sigma * y.a, -sigma * y.j)


@compiled()
def turns_backwards(y: State, end: State) -> bool:
    """Whether X' < 0 in a step."""
    if end.u < 0.0:
        return True
    if y.a < 0.0 < end.a:
        u = quintic(end.tau - y.tau, y.u, y.a, y.j, end.u, end.a, end.j)
        return lowest(u) < 0.0 and value(u, stationary(u)) < 0.0
    return False


@compiled(error_model="numpy")
def node_side_matters(
    y: State, h: float, sigma: float, piece: Piece, path: Path, p: Coefficients, tolerance: float
) -> bool:  # fmt: skip
    """Whether it matters, for a state close to the end of a piece, from which side of the node friction is taken.

    The error of friction is proportional to the distance from the node, that of X' to half of it times the time there.
    At the belt that time follows from X'', because the speed vanishes.
    """
    left = piece.right - y.s
    rate = sigma * (p.V - y.u)
    rate = rate if rate > 0.0 else np.sqrt(0.5 * abs(y.a * left))
    if abs(left) <= AT_NODE * path.spacing + 1e-15 * rate * y.tau:
        return False
    passed = min(rate * h, path.spacing)
    half = 0.5 * p.F * gain(sigma * p.omega * (p.V - y.u), p) * abs(left)
    z = piece.right - left
    wrong = abs(mu_s_at(piece_at(path, piece.right + SLACK * path.spacing), z) - mu_s_at(piece, z))
    return not error_ratio(half * wrong, passed, y, p, tolerance) <= MISPLACED


@compiled(forceinline=True, error_model="numpy")
def try_step(
    y: State, h: float, sigma: float, piece: Piece, here: Branch, path: Path, p: Coefficients, tolerance: float
) -> tuple[State, float, float, float, int]:  # fmt: skip
    """Trial step, shortened at nodes; returns end, error, length, error over the error allowed, number of trials."""
    taken = 0
    while True:
        end, error = step(y, h, sigma, piece, here.p)
        ratio, taken = error_ratio(error, h, end, p, tolerance), taken + 1
        passed = end.s - piece.right
        if passed <= 0.0 or not ratio <= 1.0 or taken == MOST_TRIED:
            break
        if not node_side_matters(end, h, sigma, piece, path, p, tolerance):
            break
        rate = sigma * (p.V - end.u)
        h = h - passed / rate if 0.0 < passed < rate * h else 0.5 * h
    return end, error, h, ratio, taken


@compiled()
def growth(ratio: float) -> float:
    """The growth factor of a step whose error is `ratio` times the error allowed."""
    if not ratio < np.inf:
        return LEAST_GROWTH
    return min(LARGEST_GROWTH, max(LEAST_GROWTH, 0.9 * max(ratio, 1e-9) ** (-1.0 / 4.0)))


@compiled()
def sample_slip(y: State, end: State, here: Branch, sliding: Sliding, samples: Samples) -> None:
    """Store X and X' of one step at the multiples of interval in (tau, tau at its end].

    Each sample is the end of a shorter step, as accurate as the step; a polynomial through its ends is not.
    """
    if samples.x.size == 0:
        return
    interval = samples.interval
    for k in range(int(y.tau / interval), min(int(end.tau / interval) + 2, samples.x.size)):
        if y.tau < k * interval <= end.tau:
            at, _ = single_step(y, k * interval - y.tau, sliding.sigma, sliding.piece, here.p)
            samples.x[k], samples.u[k] = at.x, at.u


@compiled()
def sample_wide(
    y: State, end: State, here: Branch, sigma: float, path: Path, p: Coefficients, samples: Samples
) -> None:
    """The same for a step over many nodes, from node to node."""
    while samples.x.size > 0 and y.tau < end.tau:
        piece = piece_at(path, y.s + SLACK * path.spacing)
        y = with_jerk(y, sigma, piece, here.p)
        h = to_node(y, end.tau - y.tau, piece.right, sigma, path, p)
        node, _ = single_step(y, h, sigma, piece, here.p)
        sample_slip(y, node, here, Sliding(sigma, piece, p), samples)
        y = node


@compiled()
def start_phase(start: State, allowed: float, sigma: float, path: Path, p: Coefficients) -> tuple[Piece, Branch, State]:
    """Piece of the path, branch and state at the start of a slip phase, or where it continues after a pause."""
    goes_on = allowed > 0.0
    piece = piece_at(path, start.s + (SLACK if goes_on else AT_NODE) * path.spacing)
    u = start.u if goes_on else p.V
    here = branch_at(u, sigma, p)
    if goes_on:
        return piece, here, start
    return piece, here, slip_state(start.tau, start.x, u, start.s, sigma, piece, here.p)


@compiled(forceinline=True, error_model="numpy")
def next_piece(
    y: State, allowed: float, level: int, piece: Piece, sigma: float, path: Path, p: Coefficients, tolerance: float
) -> tuple[Status, int, Piece]:  # fmt: skip
    """Status, level and piece of the next step: those given, or the next ones where the piece is over."""
    slack = SLACK * path.spacing
    over = y.s >= piece.right - slack
    if not over or (y.s < piece.right and node_side_matters(y, allowed, sigma, piece, path, p, tolerance)):
        return Status.GOES_ON, level, piece
    level += level < 0
    if path.ends and y.s >= (path.first + path.nodes.size - 1 - SLACK) * path.spacing:
        return Status.PATH_OVER, level, piece
    if not reaches(path, y.s + slack):
        return Status.NODES_OVER, level, piece
    return Status.GOES_ON, level, piece_at(path, y.s + slack)


@compiled()
def tried_again(
    end: State, error: float, length: float, sigma: float, piece: Piece, path: Path, p: Coefficients, tolerance: float
) -> tuple[float, float]:
    """Error ratio of a step that ends at a bound, or beyond a node not seen, and length of another try, 0 for none."""
    ratio = error_ratio(error, length, end, p, tolerance)
    if not ratio <= 1.0:
        return ratio, length * growth(ratio)
    beyond = end.s > piece.right
    return ratio, 0.5 * length if beyond and node_side_matters(end, length, sigma, piece, path, p, tolerance) else 0.0


@compiled(error_model="numpy")
def slip(
    start: State, since: float, pace: tuple[float, int], backwards: bool, sigma: float, path: Path, p: Coefficients,
    tolerance: float, horizon: Horizon, samples: Samples,
) -> Slip:  # fmt: skip
    """A slip phase of sign sigma that began at X' = V and tau = since, until X' = V again or another case of `Status`.

    A step h is accepted when its error in X and in X' is below h tolerance (F + max(|X|, |X'|)). Such an
    error per unit step does not grow with the number of nodes. A turn of the loop: (1) take the next piece where one is
    over; (2) step over many nodes where that is accurate enough; else (3) limit the step to node and time; (4) try it,
    shorter where the error is too large; (5) a first step that is pulled back to the belt is no slip; (6) end it at the
    first bound of the branch; (7) accept it, and end the phase or cross the bound.
    """
    total, steps, cuts = 0.0, 0, 0
    piece, here, y = start_phase(start, pace[0], sigma, path, p)
    allowed, level = pace if pace[0] > 0.0 else FIRST
    while steps < horizon.steps:
        first = y.tau == since
        status, level, piece = next_piece(y, allowed, level, piece, sigma, path, p, tolerance)  # 1
        if status != Status.GOES_ON:
            return Slip(status, y, backwards, steps, total, (allowed, level), cuts)
        if level >= 0:  # 2
            end, error, level, trials = wide_step(y, level, backwards, sigma, here, path, p, tolerance, horizon.tau)
            steps += trials
            if level >= 0:
                sample_wide(y, end, here, sigma, path, p, samples)
                backwards, total, y = backwards or end.u < 0.0, total + error, end
                continue
            y = with_jerk(y, sigma, piece, here.p)
        h = to_node(y, min(allowed, horizon.tau - y.tau), piece.right, sigma, path, p)  # 3
        if not y.tau + h > y.tau:
            return Slip(Status.STEP_LOST, y, backwards, steps, total, (allowed, level), cuts)
        last, whole = h == horizon.tau - y.tau, h == allowed
        end, error, h, ratio, trials = try_step(y, h, sigma, piece, here, path, p, tolerance)  # 4
        steps += trials
        if not ratio <= 1.0:
            allowed = h * growth(ratio)
            continue
        if first and sigma * (p.V - end.u) <= 0.0:  # 5
            if h < SHORTEST_SLIP:
                return Slip(Status.NO_SLIP, y, backwards, steps, 0.0, (allowed, level), cuts)
            allowed = 0.25 * h
            continue
        met, length, sliding = NONE, h, Sliding(sigma, piece, p)  # 6
        if not stays_within(y, end, h, first, here, sliding, tolerance):
            met, end, error, length, trials = end_at_first_bound(y, end, error, h, first, here, sliding, tolerance)
            steps += trials
            ratio, shorter = tried_again(end, error, length, sigma, piece, path, p, tolerance)
            if shorter > 0.0:
                allowed = shorter
                continue
            last, whole = last and length == h, whole and length == h
        sample_slip(y, end, here, sliding, samples)  # 7
        backwards = backwards or turns_backwards(y, end)
        total += error
        cuts += total_friction(sigma * p.omega * (p.V - end.u), mu_s_at(piece, end.s), p) == 0.0
        if met == LOWER and here.row == 0:  # the lower end of the first row of a law is the belt
            return Slip(Status.AT_BELT, end, backwards, steps, total, (allowed, level), cuts)
        if last:
            return Slip(Status.TIME_OVER, end, backwards, steps, total, (allowed, level), cuts)
        if whole:
            allowed = min(h * growth(ratio), LONGEST_STEP)
        y = end
        if met != NONE:
            y, here = cross_bound(end, met, here, sigma, piece, p)
    return Slip(Status.STEPS_OVER, y, backwards, steps, total, (allowed, level), cuts)
