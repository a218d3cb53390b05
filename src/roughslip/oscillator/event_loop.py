"""Stick and slip in turn: a run from event to event, which can pause for more nodes of its friction path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roughslip.compilation import compiled
from roughslip.oscillator.equation import State, completed, place
from roughslip.oscillator.path import Path, offset, piece_at
from roughslip.oscillator.slip import (
    AT_BELT,
    FIRST_STEP,
    NEGATIVE,
    NO_SLIP,
    NODES_OVER,
    PATH_OVER,
    SHORTEST_SLIP,
    START,
    TIME_OVER,
    Numerics,
    Pace,
    slip,
)
from roughslip.oscillator.stick import (
    HELD,
    LOWER,
    PAUSED,
    UPPER,
    departure,
    draw_stick,
    passage,
    static_limit,
    stick_force,
)
from roughslip.oscillator.switching_events import branch_at
from roughslip.oscillator.system import Coefficients

DEPARTURE, REATTACHMENT, CROSSING = 0, 1, 2


class Stand(NamedTuple):
    """Where a run stands.

    y : the motion
    sigma : HELD in stick, else the sign of slip
    limit : [m] static limit of stick
    since, pace : of the slip phase, as `slip` takes them
    backwards : whether X' < 0 occurred since the departure
    steps, error : steps taken, sum of the local errors [m]
    cuts : steps of slip and starts of stick at which friction was cut to zero
    """

    y: State
    sigma: int
    limit: float
    since: float
    pace: Pace
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
    """What follows at X' = V: stick where friction balances the force, else slip to the side that the force pulls."""
    force = stick_force(tau, x, p)
    if abs(force) <= limit:
        return HELD
    return UPPER if force > 0.0 else LOWER


@compiled()
def begin(x: float, path: Path, stochastic: bool, p: Coefficients) -> tuple[Stand, Events]:
    """The run at X' = V and the place x [m], before anything happens."""
    y = State(0.0, x, p.V, 0.0, 0.0, 0.0)
    limit = static_limit(offset(piece_at(path, 0.0), 0.0), stochastic, p)
    sigma = _side(0.0, x, limit, p)
    events = Events(np.empty(64, np.int64), np.empty((64, 4)), 0)
    if sigma != HELD:
        events = _record(events, DEPARTURE, y, False)
    return Stand(y, sigma, limit, 0.0, START, False, 0, 0.0, 0), events


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
def begin_in_slip(x: float, u: float, path: Path, p: Coefficients) -> tuple[Stand, Events]:
    """The run at the place x and the velocity u [m] off the belt's: in slip, as if it had departed just before."""
    sigma = UPPER if u < p.V else LOWER
    piece = piece_at(path, 0.0)
    y = State(0.0, x, u, 0.0, 0.0, 0.0)
    y = completed(0.0, x, u, 0.0, float(sigma), piece, branch_at(y, float(sigma), piece, p).p)
    events = _record(Events(np.empty(64, np.int64), np.empty((64, 4)), 0), DEPARTURE, y, False)
    return Stand(y, sigma, 0.0, -1.0, Pace(FIRST_STEP, 0.0, 0.0), u < 0.0, 0, 0.0, 0), events


@compiled()
def go_on(
    stand: Stand, events: Events, tau_end: float, path: Path, p: Coefficients, numerics: Numerics, stochastic: bool,
    step_limit: int, interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray,
) -> tuple[int, Stand, Events]:  # fmt: skip
    """The run from where it stands until time, steps, the path or its nodes at hand are over, and the status then."""
    status = TIME_OVER
    y, sigma, limit, since, pace, backwards, steps, error, cuts = stand
    while tau_end - y.tau > SHORTEST_SLIP:
        if sigma == HELD:
            held = y
            side, y = _leave(held, limit, tau_end, path, stochastic, p)
            if x_drawn.size > 0 and y.tau > held.tau:
                draw_stick(held.tau, held.x, y.tau, interval, p, x_drawn, u_drawn)
            if side == PAUSED:
                status = PATH_OVER if path.ends else NODES_OVER
                break
            if side == HELD:
                break
            events = _record(events, DEPARTURE, y, False)
            sigma, since, pace, backwards = side, y.tau, START, False
            continue
        phase = slip(
            y, since, pace, float(sigma), tau_end, path, p, numerics, step_limit - steps, interval, x_drawn, u_drawn
        )
        y, pace = phase.y, phase.pace
        steps += phase.steps
        error += phase.error
        cuts += phase.cuts
        backwards = backwards or phase.backwards
        if phase.status != AT_BELT and phase.status != NO_SLIP:
            status = phase.status
            break
        y = State(y.tau, y.x, p.V, y.s, 0.0, 0.0)
        since, pace = y.tau, START
        z = place(y.tau, y.s, p)
        limit = static_limit(offset(piece_at(path, z), z), stochastic, p)
        if limit == 0.0:
            cuts += 1
            if numerics.refuse:
                status = NEGATIVE
                break
        side = HELD if phase.status == NO_SLIP else _side(y.tau, y.x, limit, p)
        if side == HELD:
            events = _record(events, REATTACHMENT, y, backwards)
        elif side != sigma:
            events = _record(events, CROSSING, y, False)
        sigma = side
        if phase.status == NO_SLIP:  # stick lasts as long as no slip can, so that the run goes on
            y = State(y.tau + SHORTEST_SLIP, y.x + p.V * SHORTEST_SLIP, p.V, y.s, 0.0, 0.0)
    return status, Stand(y, sigma, limit, since, pace, backwards, steps, error, cuts), events
