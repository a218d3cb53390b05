"""Stick and slip in turn with a memory of the contact: `event_loop` and `slip`, with psi of `memory_law` as a variable.

In stick the limit rises with the logarithm of time and the force in proportion to time, which has one root, the
departure. Slip is stiff, so it has a method of its own (`memory_step`). Its steps end at nodes of the path, and are
repeated where they pass an event, until they end there.
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
from roughslip.oscillator.slip import LONGEST_STEP, SHORTEST_SLIP, Horizon, Samples, Slip, Status, step_to_node
from roughslip.oscillator.slip_orbit import next_step

FIRST = (1e-3, 0)  # `Slip.pace` of a phase, whose first step is shortened until it is accurate
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
    return RunState(y, sigma, 0.0, 0.0 if w == 0.0 else -1.0, FIRST, u < 0.0, 0, 0.0, 0), events


@compiled(error_model="numpy")
def ratio_of(end: MemoryState, errors: tuple[float, float, float], p: Coefficients) -> float:
    """The largest error of a step in its unit: F + |X| of s, what changes friction by 1 of w, and 1 of psi."""
    w = max(end.w, 0.0)
    slow = (w + p.law.rest / p.omega) / p.law.direct if p.law.direct > 0.0 else np.inf
    return max(errors[0] / (p.F + abs(end.x)), errors[1] / min(p.V + w, slow), errors[2])


@compiled(error_model="numpy")
def to_belt(
    y: MemoryState, end: MemoryState, late: float, sigma: float, piece: Piece, p: Coefficients
) -> tuple[MemoryState, float, int]:
    """Repeat a step of length `late` that passes the belt until it ends there; its length, and the steps taken."""
    low, high, h, taken = 0.0, late, late, 0
    while taken < MOST_TRIED:
        low, high = (h, high) if end.w > 0.0 else (low, h)
        rate = rates(end, sigma, piece, p)[1]
        newton = h - end.w / rate if rate < 0.0 else low
        new = newton if low < newton < high else 0.5 * (low + high)
        if min(abs(new - h), high - low) <= AT_EVENT * late:
            break
        end, h, taken = rosenbrock(y, new, sigma, piece, p)[0], new, taken + 1
    return MemoryState(end.tau, end.x, end.s, 0.0, end.psi), h, taken


@compiled(error_model="numpy")
def to_extreme(y: MemoryState, end: MemoryState, h: float, sigma: float, piece: Piece, p: Coefficients) -> float:
    """The length of a step h, shorter where it has an extreme of w next to the belt or to X' = 0, and ends there."""
    out, into = rates(y, sigma, piece, p)[1], rates(end, sigma, piece, p)[1]
    t = out / (out - into) if out * into < 0.0 else 0.0
    w = y.w + 0.5 * t * h * out
    near = w > p.V * (1.0 - GRAZING) and max(y.w, end.w) <= p.V if out > 0.0 else w < GRAZING * min(y.w, end.w)
    return t * h if near and GRAZING < t < 1.0 - GRAZING else h


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
def slip_with_memory(
    y: MemoryState, since: float, pace: tuple[float, int], backwards: bool, sigma: float, path: Path, p: Coefficients,
    tolerance: float, horizon: Horizon, samples: Samples,
) -> Slip:  # fmt: skip
    """A slip phase that began at tau = since, until X' = V again or another case of `Status`.

    A step is accepted when its error is below the tolerance (`ratio_of`), and is so short that the method does not damp
    an unstable motion about steady sliding. It ends within AT_NODE of a node.
    """
    total, steps, cuts, allowed = 0.0, 0, 0, pace[0]
    longest, shorter = LONGEST_STEP / max(1.0, math.sqrt(p.F * p.law.ageing / p.law.length)), np.inf
    near = AT_NODE * path.spacing
    piece, status = piece_at(path, y.s + near), Status.STEPS_OVER
    while steps < horizon.steps:
        if y.s >= piece.right - near:
            if path.ends and y.s >= (path.first + path.nodes.size - 1 - AT_NODE) * path.spacing:
                status = Status.PATH_OVER
                break
            piece = piece_at(path, y.s + near)
        if not reaches(path, y.s + near):
            status = Status.NODES_OVER
            break
        left, first = horizon.tau - y.tau, y.tau == since
        h = min(allowed, longest, left, shorter)
        if path.nodes.size > 0:
            h = step_to_node(h, piece.right - y.s, y.w, rates(y, sigma, piece, p)[1], 0.0)
        whole = h == min(allowed, longest)
        if not y.tau + h > y.tau:
            status = Status.STEP_LOST
            break
        end, errors = rosenbrock(y, h, sigma, piece, p)
        ratio, steps = ratio_of(end, errors, p) / tolerance, steps + 1
        if not ratio <= 1.0:
            allowed = next_step(h, ratio)
            continue
        if first and end.w <= 0.0:
            if h < SHORTEST_SLIP:
                status = Status.NO_SLIP
                break
            allowed = 0.25 * h
            continue
        shorter = h if first or end.w <= 0.0 else to_extreme(y, end, h, sigma, piece, p)
        if end.s > piece.right + near:
            shorter = min(shorter, h * (piece.right - y.s) / (end.s - y.s))
        if shorter < h:
            continue
        shorter = np.inf
        if end.w <= 0.0:
            end, h, taken = to_belt(y, end, h, sigma, piece, p)
            steps += taken
        if samples.x.size > 0:
            sample_step(y, end, sigma, piece, p, samples)
        backwards, total, y = backwards or sigma * end.w > p.V, total + max(errors[0], errors[1]), end
        cuts += scattered(friction_of(p.omega * y.w, y.psi, p.law), mu_s_at(piece, y.s), p) == 0.0
        if y.w == 0.0 or h == left:
            status = Status.AT_BELT if y.w == 0.0 else Status.TIME_OVER
            break
        allowed = next_step(h, ratio) if whole else allowed
    return Slip(status, y, backwards, steps, total, (allowed, 0), cuts)


@compiled()
def continue_with_memory(
    run: RunState, events: Events, path: Path, p: Coefficients, tolerance: float, horizon: Horizon, samples: Samples
) -> tuple[Status, RunState, Events]:
    """Continue a run until time, steps, the path or its present nodes are over, as `event_loop.continue_run`."""
    status = Status.TIME_OVER
    y, sigma, limit, since, pace, backwards, steps, error, cuts = run
    while horizon.tau - y.tau > SHORTEST_SLIP:
        known = events.rows[0, 0] + horizon.after if events.filled > 0 else math.inf
        if sigma == HELD:
            if backwards and y.tau > known:
                break
            stick, left, held = stick_left(y, path, p), horizon.tau - y.tau, y
            y = stuck(held, min(stick, left), p)
            if samples.x.size > 0 and y.tau > held.tau:
                sample_stick(held.tau, held.x, y.tau, p, samples)
            if stick >= left:
                break
            events = record(events, DEPARTURE, y, False)
            sigma, since, pace, backwards = UPPER, y.tau, FIRST, False
            continue
        until = Horizon(min(horizon.tau, max(known, since + horizon.longest)), horizon.steps - steps)
        phase = slip_with_memory(y, since, pace, backwards, float(sigma), path, p, tolerance, until, samples)
        status, y, backwards, taken, of_slip, pace, cut = phase
        steps, error, cuts = steps + taken, error + of_slip, cuts + cut
        if status != Status.AT_BELT and status != Status.NO_SLIP:
            break
        since, pace, side = (
            y.tau,
            FIRST,
            HELD if status == Status.NO_SLIP else side_at(y.tau, y.x, limit_of(y, path, p), p),
        )
        if side == HELD:
            events = record(events, REATTACHMENT, y, backwards)
        elif side != sigma:
            events = record(events, CROSSING, y, False)
        sigma = side
        if status == Status.NO_SLIP:  # stick lasts as long as the shortest slip, so that the run advances
            y = stuck(y, SHORTEST_SLIP, p)
        status = Status.TIME_OVER
    return status, RunState(y, sigma, limit, since, pace, backwards, steps, error, cuts), events
