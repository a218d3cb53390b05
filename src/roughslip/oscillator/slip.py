"""Slip: from X' = V with one sign of the sliding velocity until X' = V again.

sigma = sign(V - X') is constant in a slip phase, so the right-hand side is smooth in every step and nothing is
regularised. Steps end at the nodes of the friction path, where its second derivative jumps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from roughslip.oscillator.fehlberg import State, acceleration, draw, extreme_velocity, fehlberg_step, jerk
from roughslip.oscillator.path import Path, Piece, offset, piece_at, reaches
from roughslip.oscillator.system import Coefficients

AT_BELT, TIME_OVER, PATH_OVER, STEPS_OVER, NO_SLIP, NODES_OVER = 0, 1, 2, 3, 4, 5
FIRST_STEP = 1e-2  # of a slip phase, in units of 1/omega
LONGEST_STEP = 0.25  # so that the cubic dense output sees every extreme of X'
SHORTEST_SLIP = 1e-7  # a phase back at the belt after so short a time is none: V h^2 / 2 drowns in the rounding of V
SLACK = 1e-3  # of a node spacing: a step that ends so close to a node ends at it
GRAZING = 1e-6  # of V: an extreme of X' so close to the belt is judged by a step that ends there


class Slip(NamedTuple):
    """The end of a slip phase: why and where, whether X' < 0 occurred, steps tried, sum of the local errors [m].

    allowed : length of the next step, for a phase that goes on once more nodes are at hand
    """

    status: int
    y: State
    backwards: bool
    steps: int
    error: float
    allowed: float


@njit(cache=True)
def step_to_node(h: float, distance: float, s1: float, s2: float, s3: float) -> float:
    """The largest step up to h that slips no further than distance [m], from three derivatives of s (guarded Newton).

    The next term of the series is left out; it moves the end by some 1e-4 of the distance at a tolerance of 1e-9.
    """
    low, high, step = 0.0, h, min(h, distance / s1) if s1 > 0.0 else h
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
def belt_bracket(y: State, end: State, sigma: float, p: Coefficients) -> float:
    """A step length from y that may reach X' = V, at the end of the step or at an extreme of X' in it; else 0."""
    if sigma * (p.V - end.u) <= 0.0:
        return end.tau - y.tau
    if y.a * end.a < 0.0 and sigma * y.a > 0.0:
        step, extreme = extreme_velocity(y, end)
        if sigma * (p.V - extreme) <= GRAZING * p.V:
            return step
    return 0.0


@njit(cache=True)
def meet_belt(y: State, late: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[bool, State, float]:
    """Shorten a step from y so that X' = V to rounding: Newton on re-taken steps in the bracket (0, late].

    Returns (False, ...) where the step that ends at late has not reached the belt.
    """
    low, high, h = 0.0, late, late
    end, error = fehlberg_step(y, h, sigma, piece, p)
    if sigma * (p.V - end.u) > 0.0:
        return False, end, error
    for _ in range(100):
        gap = sigma * (p.V - end.u)
        if gap > 0.0:
            low = h
        else:
            high = h
        rate = -sigma * end.a
        newton = h - gap / rate if rate < 0.0 else low
        h_new = newton if low < newton < high else 0.5 * (low + high)
        if abs(gap) <= 1e-15 * p.V or abs(h_new - h) <= 1e-15 * late:
            break
        h = h_new
        end, error = fehlberg_step(y, h, sigma, piece, p)
    return True, State(end.tau, end.x, p.V, end.s, end.a), error


@njit(cache=True)
def slip(
    start: State, since: float, allowed: float, sigma: float, tau_end: float, path: Path, p: Coefficients,
    tolerance: float, step_limit: int, interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray,
) -> Slip:  # fmt: skip
    """A slip phase of sign sigma from X' = V until X' = V again, or until time, path, nodes at hand or steps are over.

    since : tau at which the phase began
    allowed : length of the next step, 0 at the beginning of the phase

    A step is accepted when its error in X and in X' is below tolerance (F + max(|X|, |X'|)).
    """
    slack = SLACK * path.spacing
    piece = piece_at(path, start.s + slack)
    y = start
    if allowed == 0.0:
        y = State(
            start.tau, start.x, p.V, start.s, acceleration(start.tau, start.x, p.V, sigma, offset(piece, start.s), p)
        )
        allowed = FIRST_STEP
    backwards, total = False, 0.0
    for attempt in range(1, step_limit + 1):
        first = y.tau == since
        if y.s >= piece.right - slack:
            if path.ends and y.s >= (path.first + path.nodes.size - 1 - SLACK) * path.spacing:
                return Slip(PATH_OVER, y, backwards, attempt, total, allowed)
            if not reaches(path, y.s + slack):
                return Slip(NODES_OVER, y, backwards, attempt - 1, total, allowed)
            piece = piece_at(path, y.s + slack)
        h = min(allowed, tau_end - y.tau)
        if path.nodes.size > 0:
            rates = sigma * (p.V - y.u), -sigma * y.a, -sigma * jerk(y, sigma, piece, p)
            h = step_to_node(h, piece.right - y.s, *rates)
        last = h == tau_end - y.tau

        end, error = fehlberg_step(y, h, sigma, piece, p)
        gap = sigma * (p.V - end.u)
        ratio = error / (tolerance * (p.F + max(abs(end.x), abs(end.u))))
        if not ratio <= 1.0:
            allowed = h * (max(0.2, 0.9 * ratio**-0.2) if ratio < np.inf else 0.2)
            continue
        if first and gap <= 0.0:
            if h < SHORTEST_SLIP:
                return Slip(NO_SLIP, y, False, attempt, 0.0, 0.0)
            allowed = 0.25 * h
            continue

        late = 0.0 if first else belt_bracket(y, end, sigma, p)
        arrived = False
        if late > 0.0:
            arrived, met, met_error = meet_belt(y, late, sigma, piece, p)
            if arrived:
                end, error = met, met_error
        if x_drawn.size > 0:
            draw(y, end, interval, x_drawn, u_drawn)
        if y.a < 0.0 < end.a:
            backwards = backwards or extreme_velocity(y, end)[1] < 0.0
        backwards = backwards or end.u < 0.0
        total += error
        if arrived or last:
            return Slip(AT_BELT if arrived else TIME_OVER, end, backwards, attempt, total, 0.0)
        if h == allowed:
            allowed = min(h * min(5.0, 0.9 * max(ratio, 1e-9) ** -0.2), LONGEST_STEP)
        y = end
    return Slip(STEPS_OVER, y, backwards, step_limit, total, allowed)
