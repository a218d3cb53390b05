"""A step of slip over many nodes of the friction path, with the slipped distance s as independent variable.

With the sliding speed w = sigma (V - X') > 0 and K = w^2 / 2, slip obeys

    d tau / ds = 1 / w,    dK / ds = -sigma X'',    X = X0 + V (tau - tau0) - sigma (s - s0).

X'' is linear in mu_S. So the path enters the equation of K + F J, with J the running integral of mu_S, through w alone,
one order smoother. The step takes the quadratic of a `Wide` piece in place of mu_S. Let e be the running integral of
what this leaves out. It is zero at both ends of the step, and orthogonal to straight lines. So the error at the end of
the step comes from products of F e with itself and with the curvature of 1 / w^3.

Where mu_S multiplies mu_D, F e has the factor mu_D(w). As e is orthogonal to straight lines, the change of mu_D within
the step adds only a share of F e times that change to the error of K. The quadratic then enters dK / ds, and not K by
its running integral.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, acceleration, gain, least_friction, slip_state
from roughslip.oscillator.laws import CONTRACTED, row_ends
from roughslip.oscillator.path import WIDTHS, Path, Piece, Wide, piece_at, wide_piece
from roughslip.oscillator.runge_kutta import ERROR, NODES, ROWS, WEIGHTS, error_ratio, weighted
from roughslip.oscillator.switching_events import Branch

SLOWED, QUICKENED = 0.3, 10.0  # K at the end over K at the start, outside of which no step is tried
LONGEST = 0.5  # of tau
NEXT_WIDER = 0.08  # of the error allowed: at twice the width it is then below it
FAR, LONGEST_WAIT = 4.0, 30.0  # of the error allowed: how far off a refused step is, and nodes until the next is tried
CHANGE = 0.1  # share of the change of mu_D: with it 95 % of steps on rough paths err by less than 1.2 of the estimate
BEND, SQUARE = 0.3, 1.5  # shares of the two products in the error of tau, by the series of (1 + x)^(-3/2)
SPARE = 3.0  # root mean squares of F e / w, by which X' may differ within the step


class WideStep(NamedTuple):
    """The outcome of `wide_step`.

    end, error : state and error [m] of the step
    level : of the next step; where every width was refused, -1 less the number of nodes at which none is tried
    tried : number of widths tried
    """

    end: State
    error: float
    level: int
    tried: int


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def step_by_distance(
    y: State, sigma: float, wide: Wide, mu_s: float, beyond: Piece, p: Coefficients
) -> tuple[State, float, float]:
    """The state of fifth order at the end of a wide piece, its error [m], and the deviation of X' within the step [m].

    By Fehlberg's pair for tau and K + F J. The wide piece begins at y but for a small share of a spacing.

    mu_s : at the first node
    beyond : piece of the path behind the last node
    """
    piece, c, rows = wide.piece, NODES, ROWS
    h, w0 = piece.right - y.s, sigma * (p.V - y.u)
    start, force = 0.5 * w0 * w0, 0.0 if p.multiplies is not None else p.F * h
    c0, c1, c2 = piece.c0, piece.c1 / 2, piece.c2 / 3

    def rates(c: float, passed: float, gained: float) -> tuple[float, float]:
        w = math.sqrt(2.0 * (start + gained - force * (c * (c0 + c * (c1 + c * c2)))))
        x, mu_s = y.x + p.V * passed - sigma * (c * h), 0.0
        if p.multiplies is not None:
            mu_s = c0 + c * (2.0 * c1 + c * 3.0 * c2)
        return 1.0 / w, -sigma * acceleration(y.tau + passed, x, p.V - sigma * w, sigma, mu_s, p)

    t1, k1 = rates(0.0, 0.0, 0.0)
    t2, k2 = rates(c[1], h * weighted(rows[0], (t1,)), h * weighted(rows[0], (k1,)))
    t3, k3 = rates(c[2], h * weighted(rows[1], (t1, t2)), h * weighted(rows[1], (k1, k2)))
    t4, k4 = rates(c[3], h * weighted(rows[2], (t1, t2, t3)), h * weighted(rows[2], (k1, k2, k3)))
    t5, k5 = rates(c[4], h * weighted(rows[3], (t1, t2, t3, t4)), h * weighted(rows[3], (k1, k2, k3, k4)))
    t6, k6 = rates(c[5], h * weighted(rows[4], (t1, t2, t3, t4, t5)), h * weighted(rows[4], (k1, k2, k3, k4, k5)))
    ts, ks = (t1, t3, t4, t5, t6), (k1, k3, k4, k5, k6)
    mean, late = c0 + c1 + c2, y.s - piece.left
    of_start = gain(p.omega * w0, p)
    missed = of_start * late * (mean - mu_s)
    k = start + h * weighted(WEIGHTS, ks) - force * mean - p.F * missed
    w, passed = math.sqrt(2.0 * k), h * weighted(WEIGHTS, ts)
    x = y.x + p.V * passed - sigma * h
    end = slip_state(y.tau + passed, x, p.V - sigma * w, piece.right, sigma, beyond, p)
    tau_error, k_error = abs(h * weighted(ERROR, ts)), abs(h * weighted(ERROR, ks))
    slowest, steep = min(w, w0), abs(end.a) / w
    of_end = gain(p.omega * w, p)
    deviation, bend = p.F * max(of_start, of_end) * wide.rough / slowest, (k - start) / (k + start)
    left_out = passed * deviation * (BEND * bend * bend + SQUARE * deviation / slowest)
    k_error += CHANGE * p.F * wide.rough * abs(of_end - of_start)
    error = max(w * tau_error, k_error / w + abs(end.a) * tau_error) + left_out * (1.0 + steep)
    return end, error, deviation


@compiled(error_model="numpy")
def keeps_branch(
    y: State, end: State, deviation: float, backwards: bool, sigma: float, row: int, p: Coefficients
) -> bool:
    """Whether the speed certainly stays on the row of its law, and X' on its side of zero or `backwards` is known."""
    spare = SPARE * deviation
    if y.a * end.a < 0.0:  # a parabola has its extreme within the step
        spare += 0.25 * (end.tau - y.tau) * min(abs(y.a), abs(end.a))
    slowest, fastest = min(y.u, end.u) - spare, max(y.u, end.u) + spare
    low, high = row_ends(row, p.law)
    ends = sigma * p.omega * (p.V - slowest), sigma * p.omega * (p.V - fastest)
    return low < min(ends) and max(ends) < high and (backwards or end.u < 0.0 or slowest > 0.0)


@compiled(error_model="numpy")
def wide_step(
    y: State, level: int, backwards: bool, sigma: float, here: Branch, path: Path, p: Coefficients, tolerance: float,
    tau_end: float,
) -> WideStep:  # fmt: skip
    """Step from a state at a node over as many nodes as a level of WIDTHS has, or over fewer where that is too many.

    A width is refused where its error is above that of `slip`, and where friction might be cut, the branch or the
    direction of motion change, or the motion reach tau_end or the last node. So is a step back in time: near a stop
    between its ends 1 / w is so large that a negative weight of the pair outdoes all others.
    """
    first = int(y.s / path.spacing + 0.5)
    w0 = sigma * (p.V - y.u)
    k0, tried, wait = 0.5 * w0 * w0, 0, 0
    for at in range(level if first > path.first and not here.cut else -1, -1, -1):
        h = (first + WIDTHS[at]) * path.spacing - y.s
        k = k0 - sigma * y.a * h  # roughly, at the end
        if not (SLOWED * k0 < k < QUICKENED * k0 and 2.0 * h < LONGEST * (w0 + math.sqrt(2.0 * k))):
            continue
        if first + WIDTHS[at] + 1 >= path.first + path.nodes.size:
            continue
        wide = wide_piece(path, first, at)
        if least_friction(wide.least, p) < 0.0:
            continue
        beyond = piece_at(path, wide.piece.right + 0.5 * path.spacing)
        end, error, deviation = step_by_distance(y, sigma, wide, path.nodes[first - path.first], beyond, here.p)
        tried += 1
        ratio = error_ratio(error, end.tau - y.tau, end, p, tolerance)
        wait = int(min(ratio / FAR, LONGEST_WAIT)) if ratio > 0.0 else 0
        in_time = y.tau < end.tau < tau_end
        if ratio <= 1.0 and in_time and keeps_branch(y, end, deviation, backwards, sigma, here.row, p):
            return WideStep(end, error, min(at + (ratio < NEXT_WIDER), len(WIDTHS) - 1), tried)
    return WideStep(y, 0.0, -1 - wait, tried)
