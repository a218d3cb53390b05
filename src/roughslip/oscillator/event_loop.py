"""Stick and slip in turn: how far stick holds, and a run from event to event that can pause for more nodes of its path.

The limit of stick is the largest friction deflection F mu [m] that holds the mass on the belt. The mass departs where
the stick force exceeds it, in closed form, as friction follows the slipped distance and stands still in stick.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, slip_state
from roughslip.oscillator.path import Path, mu_s_at, piece_at
from roughslip.oscillator.slip import FIRST, SHORTEST_SLIP, START, Horizon, Samples, Status, slip
from roughslip.oscillator.switching_events import branch_at

DEPARTURE, REATTACHMENT, CROSSING = 0, 1, 2  # of stick; start of stick; slip that changes its sign without stick
UPPER, LOWER, HELD = 1, -1, 0


@compiled()
def static_limit(mu_s: float, p: Coefficients) -> float:
    """The largest friction deflection F mu [m] that stick transmits: static friction with mu_S, and never below 0."""
    return p.F * max(0.0, p.law.static + (p.law.static if p.multiplies is not None else 1.0) * mu_s)


@compiled()
def stick_force(tau: float, x: float, p: Coefficients) -> float:
    """X + 2 D V - q cos(r tau) [m]: the deflection that friction has to balance in stick, eq. (12)."""
    return x + 2.0 * p.D * p.V - (p.q * math.cos(p.r * tau) if p.excited is not None else 0.0)


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
    if p.excited is None or p.q * p.r == 0.0:
        spare = max(limit - stick_force(tau, x, p), 0.0)
        leave = tau + (spare / p.V if p.V > 0.0 else math.inf)
        if leave >= tau_end:
            return HELD, tau_end, x + p.V * (tau_end - tau)
        return UPPER, leave, x + p.V * (leave - tau)

    rising = True
    rise = fall = stop = math.inf
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
def sample_stick(start: float, x: float, end: float, p: Coefficients, samples: Samples) -> None:
    """Store X and X' in stick from (start, x) on, at the multiples of interval in (start, end]."""
    interval = samples.interval
    for k in range(int(start / interval), min(int(end / interval) + 2, samples.x.size)):
        if start < k * interval <= end:
            samples.x[k], samples.u[k] = x + p.V * (k * interval - start), p.V


class RunState(NamedTuple):
    """The state of a run between two calls of `continue_run`.

    y : the motion
    sigma : HELD in stick, else the sign of slip, UPPER = 1 below the velocity of the belt and LOWER = -1 above it
    limit : [m] static limit of stick
    since, pace : of the slip phase, arguments of `slip`
    backwards : whether X' < 0 occurred since the departure
    steps, error : number of steps, sum of the local errors [m]
    cuts : steps of slip and starts of stick at which friction was cut to zero
    """

    y: Any
    sigma: int
    limit: float
    since: float
    pace: tuple[float, int]
    backwards: bool
    steps: int
    error: float
    cuts: int


class Events(NamedTuple):
    """The first `filled` of kinds : (room,) and rows : (room, 4) of tau, X, s and whether the mass moved backwards."""

    kinds: np.ndarray
    rows: np.ndarray
    filled: int


@compiled()
def record(events: Events, kind: int, y: Any, backwards: bool) -> Events:
    """Append an event at a state y with tau, X and s; the arrays double when they are full."""
    kinds, rows, count = events.kinds, events.rows, events.filled
    if count == kinds.size:
        kinds, rows = np.empty(2 * count, np.int64), np.empty((2 * count, 4))
        for k in range(count):
            kinds[k] = events.kinds[k]
            for i in range(4):
                rows[k, i] = events.rows[k, i]
    kinds[count] = kind
    rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = y.tau, y.x, y.s, backwards
    return Events(kinds, rows, count + 1)


@compiled()
def side_at(tau: float, x: float, limit: float, p: Coefficients) -> int:
    """What follows at X' = V: stick where friction balances the force, else slip in the direction of the force."""
    force = stick_force(tau, x, p)
    if abs(force) <= limit:
        return HELD
    return UPPER if force > 0.0 else LOWER


@compiled()
def start(x: float, u: float, path: Path, p: Coefficients) -> tuple[RunState, Events]:
    """A run that starts at X = x and X' = u [m]: on the belt, or in slip as if the mass had departed just before."""
    piece, on_belt = piece_at(path, 0.0), u == p.V
    limit = static_limit(mu_s_at(piece, 0.0), p)
    sigma = side_at(0.0, x, limit, p) if on_belt else UPPER if u < p.V else LOWER
    since, pace, y = 0.0, START, State(0.0, x, u, 0.0, 0.0, 0.0)
    if not on_belt:
        since, pace = -SHORTEST_SLIP, FIRST
        y = slip_state(0.0, x, u, 0.0, float(sigma), piece, branch_at(u, float(sigma), p).p)
    events = Events(np.empty(64, np.int64), np.empty((64, 4)), 0)
    if sigma != HELD:
        events = record(events, DEPARTURE, y, False)
    return RunState(y, sigma, limit, since, pace, u < 0.0, 0, 0.0, 0), events


@compiled()
def continue_run(
    run: RunState, events: Events, path: Path, p: Coefficients, tolerance: float, horizon: Horizon, samples: Samples
) -> tuple[Status, RunState, Events]:
    """Continue a run until time, steps, the path or its present nodes are over; returns why, with state and events."""
    status = Status.TIME_OVER
    y, sigma, limit, since, pace, backwards, steps, error, cuts = run
    while horizon.tau - y.tau > SHORTEST_SLIP:
        known = events.rows[0, 0] + horizon.after if events.filled > 0 else math.inf
        if sigma == HELD:
            if backwards and y.tau > known:
                break
            held = y
            side, tau, x = departure(held.tau, held.x, limit, horizon.tau, p)
            y = State(tau, x, p.V, held.s, 0.0, 0.0)
            if samples.x.size > 0 and y.tau > held.tau:
                sample_stick(held.tau, held.x, y.tau, p, samples)
            if side == HELD:
                break
            events = record(events, DEPARTURE, y, False)
            sigma, since, pace, backwards = side, y.tau, START, False
            continue
        left = Horizon(min(horizon.tau, max(known, max(since, 0.0) + horizon.longest)), horizon.steps - steps)
        phase = slip(y, since, pace, backwards, float(sigma), path, p, tolerance, left, samples)
        y, pace, backwards = phase.y, phase.pace, phase.backwards
        steps += phase.steps
        error += phase.error
        cuts += phase.cuts
        if phase.status != Status.AT_BELT and phase.status != Status.NO_SLIP:
            status = phase.status
            break
        y = State(y.tau, y.x, p.V, y.s, 0.0, 0.0)
        since, pace = y.tau, START
        limit = static_limit(mu_s_at(piece_at(path, y.s), y.s), p)
        if limit == 0.0:
            cuts += 1
        side = HELD if phase.status == Status.NO_SLIP else side_at(y.tau, y.x, limit, p)
        if side == HELD:
            events = record(events, REATTACHMENT, y, backwards)
        elif side != sigma:
            events = record(events, CROSSING, y, False)
        sigma = side
        if phase.status == Status.NO_SLIP:  # stick lasts as long as the shortest slip, so that the run advances
            y = State(y.tau + SHORTEST_SLIP, y.x + p.V * SHORTEST_SLIP, p.V, y.s, 0.0, 0.0)
    return status, RunState(y, sigma, limit, since, pace, backwards, steps, error, cuts), events
