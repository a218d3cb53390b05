"""Alternation of stick and slip: a run from event to event, which can pause for more nodes of its friction path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, completed, path_coordinate
from roughslip.oscillator.path import Path, mu_s_at, piece_at
from roughslip.oscillator.slip import (
    FIRST_STEP,
    SHORTEST_SLIP,
    START,
    Horizon,
    Samples,
    Settings,
    Status,
    StepControl,
    slip,
)
from roughslip.oscillator.stick import (
    HELD,
    LOWER,
    PAUSED,
    UPPER,
    departure,
    passage,
    sample_stick,
    static_limit,
    stick_force,
)
from roughslip.oscillator.switching_events import branch_at

DEPARTURE, REATTACHMENT, CROSSING = 0, 1, 2


class RunState(NamedTuple):
    """The state of a run between two calls of `continue_run`.

    y : the motion
    sigma : HELD in stick, else the sign of slip
    limit : [m] static limit of stick
    since, control : of the slip phase, arguments of `slip`
    backwards : whether X' < 0 occurred since the departure
    steps, error : number of steps, sum of the local errors [m]
    cuts : steps of slip and starts of stick at which friction was cut to zero
    """

    y: State
    sigma: int
    limit: float
    since: float
    control: StepControl
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
def _record(events: Events, kind: int, y: State, backwards: bool) -> Events:
    """Append an event; the arrays double when they are full."""
    kinds, rows, count = events.kinds, events.rows, events.filled
    if count == kinds.size:
        kinds = np.concatenate((kinds, np.empty_like(kinds)))
        rows = np.concatenate((rows, np.empty_like(rows)))
    kinds[count] = kind
    rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = y.tau, y.x, y.s, backwards
    return Events(kinds, rows, count + 1)


@compiled()
def _side(tau: float, x: float, limit: float, p: Coefficients) -> int:
    """What follows at X' = V: stick where friction balances the force, else slip in the direction of the force."""
    force = stick_force(tau, x, p)
    if abs(force) <= limit:
        return HELD
    return UPPER if force > 0.0 else LOWER


@compiled()
def start_on_belt(x: float, path: Path, stochastic: bool, p: Coefficients) -> tuple[RunState, Events]:
    """A run that starts at X' = V and X = x [m]."""
    y = State(0.0, x, p.V, 0.0, 0.0, 0.0)
    limit = static_limit(mu_s_at(piece_at(path, 0.0), 0.0), stochastic, p)
    sigma = _side(0.0, x, limit, p)
    events = Events(np.empty(64, np.int64), np.empty((64, 4)), 0)
    if sigma != HELD:
        events = _record(events, DEPARTURE, y, False)
    return RunState(y, sigma, limit, 0.0, START, False, 0, 0.0, 0), events


@compiled()
def _leave(
    held: State, limit: float, tau_end: float, path: Path, stochastic: bool, p: Coefficients
) -> tuple[int, State]:
    """The side of departure (or HELD, PAUSED), and the state at the end of stick."""
    if p.advance > 0.0:
        side, tau, x = passage(held.tau, held.x, tau_end, path, stochastic, p)
    else:
        side, tau, x = departure(held.tau, held.x, limit, tau_end, p)
    return side, State(tau, x, p.V, held.s, 0.0, 0.0)


@compiled()
def start_in_slip(x: float, u: float, path: Path, p: Coefficients) -> tuple[RunState, Events]:
    """A run that starts in slip at X = x and X' = u [m], u not V, as if the mass had departed just before."""
    sigma = UPPER if u < p.V else LOWER
    piece = piece_at(path, 0.0)
    y = State(0.0, x, u, 0.0, 0.0, 0.0)
    y = completed(0.0, x, u, 0.0, float(sigma), piece, branch_at(y, float(sigma), piece, p).p)
    events = _record(Events(np.empty(64, np.int64), np.empty((64, 4)), 0), DEPARTURE, y, False)
    return RunState(y, sigma, 0.0, -1.0, StepControl(FIRST_STEP, 0.0, 0.0), u < 0.0, 0, 0.0, 0), events


@compiled()
def continue_run(
    run: RunState, events: Events, path: Path, p: Coefficients, settings: Settings, horizon: Horizon, samples: Samples
) -> tuple[Status, RunState, Events]:
    """Continue a run until time, steps, the path or its present nodes are over; returns why, with state and events."""
    status, stochastic = Status.TIME_OVER, settings.stochastic
    y, sigma, limit, since, control, backwards, steps, error, cuts = run
    while horizon.tau - y.tau > SHORTEST_SLIP:
        if sigma == HELD:
            held = y
            side, y = _leave(held, limit, horizon.tau, path, stochastic, p)
            if samples.x.size > 0 and y.tau > held.tau:
                sample_stick(held.tau, held.x, y.tau, samples.interval, p, samples.x, samples.u)
            if side == PAUSED:
                status = Status.PATH_OVER if path.ends else Status.NODES_OVER
                break
            if side == HELD:
                break
            events = _record(events, DEPARTURE, y, False)
            sigma, since, control, backwards = side, y.tau, START, False
            continue
        left = Horizon(horizon.tau, horizon.steps - steps)
        phase = slip(y, since, control, float(sigma), path, p, settings, left, samples)
        y, control = phase.y, phase.control
        steps += phase.steps
        error += phase.error
        cuts += phase.cuts
        backwards = backwards or phase.backwards
        if phase.status != Status.AT_BELT and phase.status != Status.NO_SLIP:
            status = phase.status
            break
        y = State(y.tau, y.x, p.V, y.s, 0.0, 0.0)
        since, control = y.tau, START
        z = path_coordinate(y.tau, y.s, p)
        limit = static_limit(mu_s_at(piece_at(path, z), z), stochastic, p)
        if limit == 0.0:
            cuts += 1
            if settings.refuse:
                status = Status.NEGATIVE
                break
        side = HELD if phase.status == Status.NO_SLIP else _side(y.tau, y.x, limit, p)
        if side == HELD:
            events = _record(events, REATTACHMENT, y, backwards)
        elif side != sigma:
            events = _record(events, CROSSING, y, False)
        sigma = side
        if phase.status == Status.NO_SLIP:  # stick lasts as long as the shortest slip, so that the run advances
            y = State(y.tau + SHORTEST_SLIP, y.x + p.V * SHORTEST_SLIP, p.V, y.s, 0.0, 0.0)
    return status, RunState(y, sigma, limit, since, control, backwards, steps, error, cuts), events
