"""Stick and slip in turn with a memory of the contact: `event_loop` and `slip`, with psi of `memory_law` as a variable.

In stick the limit rises with the logarithm of time and the force in proportion to it, which has one root, the
departure. A step of slip that passes an event is repeated until it ends there.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients
from roughslip.oscillator.event_loop import (
    CROSSING,
    DEPARTURE,
    HELD,
    LOWER,
    REATTACHMENT,
    UPPER,
    Events,
    RunState,
    record,
    sample_stick,
    side_at,
    stick_force,
)
from roughslip.oscillator.memory_law import aged, friction_of, steady_psi
from roughslip.oscillator.memory_step import MemoryState, rates, rosenbrock, scattered
from roughslip.oscillator.path import Path, Piece, mu_s_at, piece_at, reaches
from roughslip.oscillator.slip import LONGEST_STEP, SHORTEST_SLIP, Horizon, Samples, Status, step_to_node
from roughslip.oscillator.slip_orbit import next_step

FIRST_STEP = 1e-3  # of a slip phase, shortened until it is accurate
MOST_TRIED = 100  # Newton steps to an event; halvings alone take 52
AT_NODE = 1e-4  # of a node spacing: a step that ends so close to a node ends at it
AT_EVENT = 4e-16  # relative, of a time
GRAZING = 1e-3  # of w at the ends of a step, or of V: an extreme so close to the belt, or to X' = 0, ends a step


@compiled(error_model="numpy")
def limit_of(y: MemoryState, path: Path, p: Coefficients) -> float:
    """The largest friction deflection F mu [m] that stick transmits at the age of y."""
    return p.F * scattered(friction_of(0.0, y.psi, p.law), mu_s_at(piece_at(path, y.s), y.s), p)


@compiled(error_model="numpy")
def stick_left(y: MemoryState, path: Path, p: Coefficients) -> float:
    """The time t [-] of stick from y to the departure: the root of V t = spare + growth ln(1 + t per_time).

    The difference is convex, so that Newton's method falls to the root from any point beyond the minimum.
    """
    limit = limit_of(y, path, p)
    if limit == 0.0 or p.V == 0.0:
        return 0.0 if limit == 0.0 else np.inf
    spare, growth = max(limit - stick_force(y.tau, y.x, p), 0.0), p.F * p.law.ageing
    if p.multiplies is not None:
        growth *= limit / (p.F * friction_of(0.0, y.psi, p.law))
    per_time = p.law.cutoff / (p.law.length * p.omega) * math.exp(-y.psi)
    t = max(spare / p.V, 2.0 * (growth / p.V - 1.0 / per_time))
    for trial in range(MOST_TRIED):
        gap = p.V * t - spare - growth * math.log1p(per_time * t)
        left = gap / (p.V - growth * per_time / (1.0 + per_time * t)) if gap != 0.0 else 0.0
        if left == 0.0 or (trial > 0 and left <= AT_EVENT * t):
            break
        t -= left
    return t


@compiled(error_model="numpy")
def stuck(y: MemoryState, dt: float, p: Coefficients) -> MemoryState:
    """The state on the belt a time dt of stick after y."""
    return MemoryState(y.tau + dt, y.x + p.V * dt, y.s, 0.0, aged(y.psi, dt / p.omega, p.law))


@compiled()
def start_with_memory(x: float, u: float, path: Path, p: Coefficients) -> tuple[RunState, Events]:
    """A run that starts at X = x and X' = u [m]: on the belt with fresh contacts, else with those of steady sliding."""
    w, sigma = abs(p.V - u), UPPER if u < p.V else LOWER
    y = MemoryState(0.0, x, 0.0, w, steady_psi(p.omega * w, p.law) if w > 0.0 else 0.0)
    if w == 0.0:
        sigma = side_at(0.0, x, limit_of(y, path, p), p)
    events = Events(np.empty(64, np.int64), np.empty((64, 4)), 0)
    if sigma != HELD:
        events = record(events, DEPARTURE, y, False)
    return RunState(y, sigma, 0.0, 0.0 if w == 0.0 else -1.0, (FIRST_STEP, 0), u < 0.0, 0, 0.0, 0), events


@compiled(error_model="numpy")
def ratio_of(end: MemoryState, errors: tuple[float, float, float], p: Coefficients) -> float:
    """The largest error of a step in its unit: F + |X| of s, what changes friction by 1 of w, and 1 of psi."""
    w = max(end.w, 0.0)
    slow = (w + p.law.rest / p.omega) / p.law.direct if p.law.direct > 0.0 else np.inf
    return max(errors[0] / (p.F + abs(end.x)), errors[1] / min(p.V + w, slow), errors[2])


@compiled(error_model="numpy")
def to_belt(
    y: MemoryState, end: MemoryState, late: float, sigma: float, piece: Piece, p: Coefficients
) -> tuple[MemoryState, int]:
    """Repeat a step of length `late` that passes the belt until it ends there, and the steps taken."""
    low, high, h, taken = 0.0, late, late, 0
    while taken < MOST_TRIED:
        low, high = (h, high) if end.w > 0.0 else (low, h)
        rate = rates(end, sigma, piece, p)[1]
        newton = h - end.w / rate if rate < 0.0 else low
        new = newton if low < newton < high else 0.5 * (low + high)
        if min(abs(new - h), high - low) <= AT_EVENT * late:
            break
        end, h, taken = rosenbrock(y, new, sigma, piece, p)[0], new, taken + 1
    return MemoryState(end.tau, end.x, end.s, 0.0, end.psi), taken


@compiled(error_model="numpy")
def to_extreme(y: MemoryState, end: MemoryState, h: float, sigma: float, piece: Piece, p: Coefficients) -> float:
    """The length of a step h, or up to an extreme of w within it that is next to the belt or to X' = 0."""
    out, into = rates(y, sigma, piece, p)[1], rates(end, sigma, piece, p)[1]
    t = out / (out - into) if out * into < 0.0 else 0.0
    w = y.w + 0.5 * t * h * out
    near = w > p.V * (1.0 - GRAZING) and max(y.w, end.w) <= p.V if out > 0.0 else w < GRAZING * min(y.w, end.w)
    return t * h if near and GRAZING < t < 1.0 - GRAZING else h


@compiled(error_model="numpy")
def tried_step(
    y: MemoryState, h: float, first: bool, near: float, sigma: float, piece: Piece, p: Coefficients, tolerance: float
) -> tuple[MemoryState, float, float, int]:
    """A step h of slip: its end, its error [m], the length of the next step, and the steps taken.

    first : whether it departs from the belt. A step that is to be repeated at another length ends at y.
    """
    end, errors = rosenbrock(y, h, sigma, piece, p)
    ratio, taken = ratio_of(end, errors, p) / tolerance, 1
    again = next_step(h, ratio) if not ratio <= 1.0 else h
    if again == h and first and end.w <= 0.0:
        again = 0.25 * h
    elif again == h and end.w > 0.0 and not first:
        again = to_extreme(y, end, h, sigma, piece, p)
    if end.s > piece.right + near:
        again = min(again, h * (piece.right - y.s) / (end.s - y.s))
    if again < h:
        return y, 0.0, again, taken
    if end.w <= 0.0:
        end, more = to_belt(y, end, h, sigma, piece, p)
        taken += more
    return end, max(errors[0], errors[1]), next_step(h, ratio), taken


@compiled()
def sample_step(
    y: MemoryState, end: MemoryState, sigma: float, piece: Piece, p: Coefficients, samples: Samples
) -> None:
    """Store X and X' of one step at the multiples of interval in (tau, tau at its end], each by a shorter step."""
    for k in range(int(y.tau / samples.interval), min(int(end.tau / samples.interval) + 2, samples.x.size)):
        if y.tau < k * samples.interval <= end.tau:
            at, _ = rosenbrock(y, k * samples.interval - y.tau, sigma, piece, p)
            samples.x[k], samples.u[k] = at.x, p.V - sigma * at.w


@compiled(error_model="numpy")
def continue_with_memory(
    run: RunState, events: Events, path: Path, p: Coefficients, tolerance: float, horizon: Horizon, samples: Samples
) -> tuple[Status, RunState, Events]:
    """Continue a run as `event_loop.continue_run`; each turn of the loop is a stick or a step of slip.

    Steps are so short that the method does not damp an unstable motion about steady sliding.
    """
    y, sigma, limit, since, paces, backwards, steps, error, cuts = run
    longest = LONGEST_STEP / max(1.0, math.sqrt(p.F * p.law.ageing / p.law.length))
    near, status, pace = AT_NODE * path.spacing, Status.STEPS_OVER, paces[0]
    piece = piece_at(path, y.s + near)
    while steps < horizon.steps:
        known = events.rows[0, 0] + horizon.after if events.filled > 0 else math.inf
        until = horizon.tau if sigma == HELD else min(horizon.tau, max(known, since + horizon.longest))
        left, held = until - y.tau, y
        if left <= SHORTEST_SLIP or (sigma == HELD and backwards and y.tau > known):
            status = Status.TIME_OVER
            break
        if sigma == HELD:
            stick = stick_left(y, path, p)
            y = stuck(held, min(stick, left), p)
            if samples.x.size > 0:
                sample_stick(held.tau, held.x, y.tau, p, samples)
            if stick < left:
                events = record(events, DEPARTURE, y, False)
                sigma, since, pace, backwards = UPPER, y.tau, FIRST_STEP, False
            continue
        if y.s >= piece.right - near:
            if path.ends and y.s >= (path.first + path.nodes.size - 1 - AT_NODE) * path.spacing:
                status = Status.PATH_OVER
                break
            piece = piece_at(path, y.s + near)
        if not reaches(path, y.s + near):
            status = Status.NODES_OVER
            break
        h, sign = min(pace, longest, left), float(sigma)
        if path.nodes.size > 0:
            h = step_to_node(h, piece.right - y.s, y.w, rates(y, sign, piece, p)[1], 0.0)
        first = y.tau == since
        if first and h < SHORTEST_SLIP:  # no slip: stick lasts as long as the shortest one, so that the run advances
            events, sigma = record(events, REATTACHMENT, y, backwards), HELD
            y = stuck(y, SHORTEST_SLIP, p)
            continue
        if not y.tau + h > y.tau:
            status = Status.STEP_LOST
            break
        y, wrong, following, taken = tried_step(held, h, first, near, sign, piece, p, tolerance)
        steps, error = steps + taken, error + wrong
        pace = following if y.tau == held.tau or h == min(pace, longest) else pace
        if y.tau == held.tau:
            continue
        if samples.x.size > 0:
            sample_step(held, y, sign, piece, p, samples)
        backwards = backwards or sign * y.w > p.V
        cuts += scattered(friction_of(p.omega * y.w, y.psi, p.law), mu_s_at(piece, y.s), p) == 0.0
        if y.w == 0.0:
            side = side_at(y.tau, y.x, limit_of(y, path, p), p)
            if side != sigma:
                kind = REATTACHMENT if side == HELD else CROSSING
                events = record(events, kind, y, backwards and side == HELD)
            sigma, since, pace = side, y.tau, FIRST_STEP
    return status, RunState(y, sigma, limit, since, (pace, 0), backwards, steps, error, cuts), events
