"""Stick and slip in turn with a memory of the contact, as `event_loop` and `slip`; page docs/background/memory.md.

Slip in s, w = sigma (V - X') and psi is stiff. RODAS has order 4 with an estimate of order 3, and takes the Jacobian,
exact here (E. Hairer & G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. 1996, IV.7 and VI.4).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, scattered
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
from roughslip.oscillator.memory_law import aged, direct_slope, friction_of, steady_psi
from roughslip.oscillator.path import Path, Piece, mu_s_at, mu_s_slope, piece_at, reaches
from roughslip.oscillator.slip import LONGEST_STEP, SHORTEST_SLIP, Horizon, Samples, Status, step_to_node
from roughslip.oscillator.slip_orbit import next_step

FIRST_STEP = 1e-3  # of a slip phase, shortened until it is accurate
MOST_TRIED = 100  # Newton steps to a departure
ROUNDED = 1e-15  # relative, of a time
AT_NODE = 1e-4  # of a node spacing: a step that ends so close to a node ends at it
COARSE = 0.1  # largest error of psi in a step, however little of it friction shows: else a small b lets it run away
GRAZING = 1e-3  # of w at the ends of a step, or of V: an extreme so close to the belt, or to X' = 0, ends a step

# RODAS in the form of its authors' code: times, of their derivative, rows of stages, and of sums on the right-hand side
GAMMA = 0.25
TIMES = (0.386, 0.21, 0.63)
OF_TIME = (0.25, -0.1043, 0.1035, -0.0362)
ROWS = (
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
)
SUMS = (
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)
Triple = tuple[float, float, float]


class MemoryState(NamedTuple):
    """tau [-], X, slipped distance s, sliding speed w [m], and psi [-]."""

    tau: float
    x: float
    s: float
    w: float
    psi: float


@compiled(forceinline=True, error_model="numpy")
def rates(y: MemoryState, sigma: float, piece: Piece, p: Coefficients) -> tuple[float, float, float, float]:
    """s', w' and psi', and friction mu."""
    speed = p.omega * y.w
    mu = scattered(friction_of(speed, y.psi, p.law), mu_s_at(piece, y.s), p)
    renewal = ((speed + p.law.cutoff) * math.exp(-y.psi) - speed) / (p.law.length * p.omega)
    return y.w, sigma * (y.x + 2.0 * p.D * p.V) - 2.0 * p.D * y.w - p.F * mu, renewal, mu


@compiled(forceinline=True, error_model="numpy")
def combined(row: Any, k: Any) -> Triple:
    """The sum of stages, each of s, w and psi, as a row of the tableau weighs them."""
    s, w, psi = 0.0, 0.0, 0.0
    for i in range(len(row)):
        s, w, psi = s + row[i] * k[i][0], w + row[i] * k[i][1], psi + row[i] * k[i][2]
    return s, w, psi


@compiled(error_model="numpy")
def rosenbrock(y: MemoryState, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[MemoryState, Triple]:
    """The state a step h after y, and its errors in s, w [m] and psi."""
    speed, fresh, mu_s, diagonal = p.omega * y.w, math.exp(-y.psi), mu_s_at(piece, y.s), 1.0 / (h * GAMMA)
    mean = friction_of(speed, y.psi, p.law)
    gain, share = (mean, 1.0 + mu_s) if p.multiplies is not None else (1.0, 1.0)
    pull = p.F if y.w == 0.0 < share or scattered(mean, mu_s, p) > 0.0 else 0.0  # friction cut at rest rises at once
    ws, wp = -1.0 - pull * gain * mu_s_slope(piece, y.s), -pull * share * p.law.ageing  # d w' / d s and d psi
    ww = -2.0 * p.D - pull * share * p.omega * direct_slope(speed, p.law)
    pw, pp = (fresh - 1.0) / p.law.length, -(speed + p.law.cutoff) * fresh / (p.law.length * p.omega)
    of_psi = diagonal - pp
    of_w = diagonal - ww - ws / diagonal - wp * pw / of_psi

    def solved(s: float, w: float, psi: float) -> Triple:
        w = (w + ws * s / diagonal + wp * psi / of_psi) / of_w
        return (s + w) / diagonal, w, (psi + pw * w) / of_psi

    def moved(time: float, by: Any) -> MemoryState:
        x = y.x + p.V * time * h - sigma * by[0]
        return MemoryState(y.tau + time * h, x, y.s + by[0], y.w + by[1], y.psi + by[2])

    def stage(at: MemoryState, of_time: float, sums: Any, k: Any) -> Triple:
        rate, carried = rates(at, sigma, piece, p), combined(sums, k)
        push = of_time * h * sigma * p.V
        return solved(rate[0] + carried[0] / h, rate[1] + carried[1] / h + push, rate[2] + carried[2] / h)

    a = stage(y, OF_TIME[0], (0.0,), ((0.0, 0.0, 0.0),))
    b = stage(moved(TIMES[0], combined(ROWS[0], (a,))), OF_TIME[1], SUMS[0], (a,))
    c = stage(moved(TIMES[1], combined(ROWS[1], (a, b))), OF_TIME[2], SUMS[1], (a, b))
    d = stage(moved(TIMES[2], combined(ROWS[2], (a, b, c))), OF_TIME[3], SUMS[2], (a, b, c))
    by = combined(ROWS[3], (a, b, c, d))
    e = stage(moved(1.0, by), 0.0, SUMS[3], (a, b, c, d))
    by = by[0] + e[0], by[1] + e[1], by[2] + e[2]
    f = stage(moved(1.0, by), 0.0, SUMS[4], (a, b, c, d, e))
    return moved(1.0, (by[0] + f[0], by[1] + f[1], by[2] + f[2])), (abs(f[0]), abs(f[1]), abs(f[2]))


@compiled(error_model="numpy")
def limit_of(y: MemoryState, path: Path, p: Coefficients) -> float:
    """The largest friction deflection F mu [m] that stick transmits at the age of y."""
    return p.F * scattered(friction_of(0.0, y.psi, p.law), mu_s_at(piece_at(path, y.s), y.s), p)


@compiled(error_model="numpy")
def stick_left(y: MemoryState, path: Path, p: Coefficients) -> float:
    """The time t of stick from y, root of V t = spare + growth ln(1 + t per_time); convex, so Newton's method falls."""
    limit = limit_of(y, path, p)
    if limit == 0.0 or p.V == 0.0:
        return np.inf if p.V == 0.0 else 0.0
    spare, growth = max(limit - stick_force(y.tau, y.x, p), 0.0), p.F * p.law.ageing
    if p.multiplies is not None:
        growth *= limit / (p.F * friction_of(0.0, y.psi, p.law))
    per_time = p.law.cutoff / (p.law.length * p.omega) * math.exp(-y.psi)
    t = max(spare / p.V, 2.0 * (growth / p.V - 1.0 / per_time))
    for _ in range(MOST_TRIED):
        gap = p.V * t - spare - growth * math.log1p(per_time * t)
        excess = gap / (p.V - growth * per_time / (1.0 + per_time * t)) if gap != 0.0 else 0.0
        t -= excess
        if abs(excess) <= ROUNDED * t:
            break
    return t


@compiled(error_model="numpy")
def stuck(y: MemoryState, dt: float, p: Coefficients) -> MemoryState:
    """The state on the belt a time dt of stick after y."""
    return MemoryState(y.tau + dt, y.x + p.V * dt, y.s, 0.0, aged(y.psi, dt / p.omega, p.law))


@compiled()
def start_at(y: MemoryState, sigma: int, p: Coefficients) -> tuple[RunState, Events]:
    """A run from a state at tau = 0 on: in stick, at a departure, or in slip as if it had departed just before."""
    events = Events(np.empty(64, np.int64), np.empty((64, 4)), 0)
    if sigma != HELD:
        events = record(events, DEPARTURE, y, False)
    since = 0.0 if y.w == 0.0 else -SHORTEST_SLIP
    return RunState(y, sigma, 0.0, since, (FIRST_STEP, 0), sigma * y.w > p.V, 0, 0.0, 0), events


@compiled()
def start_with_memory(x: float, u: float, age: float, path: Path, p: Coefficients) -> tuple[RunState, Events]:
    """A run that starts at X = x and X' = u [m] with contacts of an age [s]; NaN for fresh ones, or in slip steady."""
    w, usual = abs(p.V - u), math.isnan(age)
    psi = aged(0.0, 0.0 if usual else age, p.law) if w == 0.0 or not usual else steady_psi(p.omega * w, p.law)
    y = MemoryState(0.0, x, 0.0, w, psi)
    sigma = side_at(0.0, x, limit_of(y, path, p), p) if w == 0.0 else UPPER if u < p.V else LOWER
    return start_at(y, sigma, p)


@compiled(error_model="numpy")
def error_ratio(end: MemoryState, errors: Triple, p: Coefficients, tolerance: float) -> float:
    """Errors of a step over those allowed: of s and w in F + |X|, and of w and psi by what they change in friction."""
    of_w = errors[1] * max(1.0 / (p.F + abs(end.x)), p.law.direct / (max(end.w, 0.0) + p.law.rest / p.omega))
    of_psi = max(p.law.ageing * errors[2] / tolerance, errors[2] / COARSE)
    return max(max(errors[0] / (p.F + abs(end.x)), of_w) / tolerance, of_psi)


@compiled(error_model="numpy")
def growth_at(y: MemoryState, mu: float, p: Coefficients) -> float:
    """The largest rate in tau at which small motions about y can grow, at least 1; of friction that is cut, 1."""
    if mu == 0.0:
        return 1.0
    damping = p.F * p.omega * direct_slope(p.omega * y.w, p.law) + 2.0 * p.D
    weakening = p.F * p.law.ageing / p.law.length
    lost = max(damping, 0.0) + y.w / p.law.length
    return max(1.0, -damping, min(math.sqrt(weakening), weakening / max(lost, ROUNDED)))


@compiled(error_model="numpy")
def shortened(
    y: MemoryState, end: MemoryState, h: float, first: bool, out: float, into: float, piece: Piece, p: Coefficients
) -> float:
    """The length at which a step h is tried again, from w' at its ends: up to an event; h where it passes none.

    Events: the belt, by Newton's method or, if stiff, a chord; slip to a node; an extreme of w by the belt or X' = 0.
    """
    again = h * (piece.right - y.s) / (end.s - y.s) if end.s > piece.right + AT_NODE / piece.per_spacing else h
    if end.w < 0.0 or (first and end.w == 0.0):
        met = min(h - end.w / into, h * y.w / (y.w - end.w)) if into < 0.0 and not first else 0.25 * h
        return min(again, max(met, 0.1 * h))
    t = out / (out - into) if out * into < 0.0 and not first else 0.0
    w = y.w + 0.5 * t * h * out
    near = w > p.V * (1.0 - GRAZING) and max(y.w, end.w) <= p.V if out > 0.0 else w < GRAZING * min(y.w, end.w)
    return min(again, t * h) if near and GRAZING < t < 1.0 - GRAZING and t * h > SHORTEST_SLIP else again


@compiled()
def sample_step(y: MemoryState, tau: float, sigma: float, piece: Piece, p: Coefficients, samples: Samples) -> None:
    """Store X and X' of a step from y to tau at the multiples of interval within it, each by a shorter step."""
    for k in range(int(y.tau / samples.interval), min(int(tau / samples.interval) + 2, samples.x.size)):
        if y.tau < k * samples.interval <= tau:
            at, _ = rosenbrock(y, k * samples.interval - y.tau, sigma, piece, p)
            samples.x[k], samples.u[k] = at.x, p.V - sigma * at.w


@compiled(error_model="numpy")
def continue_with_memory(
    run: RunState, events: Events, path: Path, p: Coefficients, tolerance: float, horizon: Horizon, samples: Samples
) -> tuple[Status, RunState, Events]:
    """`event_loop.continue_run`, a stick or a step at a time; steps are so short that no unstable motion is damped."""
    y, sigma, limit, since, paces, backwards, steps, error, cuts = run
    near, pace = AT_NODE * path.spacing, paces[0]
    piece, status = piece_at(path, y.s + near), Status.STEPS_OVER
    while steps < horizon.steps:
        known = events.rows[0, 0] + horizon.after if events.filled > 0 else math.inf
        until = horizon.tau if sigma == HELD else min(horizon.tau, max(known, max(since, 0.0) + horizon.longest))
        left, held, first = until - y.tau, y, y.tau == since
        if left <= SHORTEST_SLIP or (sigma == HELD and backwards and y.tau > known):
            status = Status.TIME_OVER
            break
        if sigma == HELD:
            stick = max(stick_left(y, path, p), SHORTEST_SLIP)  # so that the run advances where no slip begins
            y = stuck(held, min(stick, left), p)
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
        sign, here = float(sigma), rates(y, float(sigma), piece, p)
        longest = min(pace, LONGEST_STEP / growth_at(y, here[3], p))
        h = min(longest, left)
        if path.nodes.size > 0:
            h = step_to_node(h, piece.right - y.s, y.w, here[1], 0.0)
        if not y.tau + h > y.tau:
            status = Status.STEP_LOST
            break
        end, errors = rosenbrock(y, h, sign, piece, p)
        ratio, steps, there = error_ratio(end, errors, p, tolerance), steps + 1, rates(end, sign, piece, p)
        if first and h < SHORTEST_SLIP and end.w <= 0.0:  # no slip
            events, sigma = record(events, REATTACHMENT, y, backwards), HELD
            continue
        again = shortened(y, end, h, first, here[1], there[1], piece, p) if ratio <= 1.0 else next_step(h, ratio)
        if again < h:
            pace = again
            continue
        pace = next_step(h, ratio) if h == longest else pace
        y, error = end, error + max(errors[0], errors[1])
        sample_step(held, y.tau, sign, piece, p, samples)
        backwards = backwards or sign * y.w > p.V
        cuts += there[3] == 0.0
        if y.w <= max(-there[1] * ROUNDED * y.tau, 0.0):  # no time is left
            y = stuck(y, 0.0, p)
            side = side_at(y.tau, y.x, limit_of(y, path, p), p)
            if side != sigma:
                kind = REATTACHMENT if side == HELD else CROSSING
                events = record(events, kind, y, backwards and side == HELD)
            sigma, since, pace = side, y.tau, FIRST_STEP
    return status, RunState(y, sigma, limit, since, (pace, 0), backwards, steps, error, cuts), events
