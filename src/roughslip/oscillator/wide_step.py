"""A step of slip over many nodes of the friction path, with the slipped distance s as independent variable.

With the sliding speed w = sigma (V - X') > 0 and K = w^2 / 2, slip obeys

    d tau / ds = 1 / w,    dK / ds = -sigma X'',    X = X0 + V (tau - tau0) - sigma (s - s0).

X'' is linear in mu_S. The step takes a quadratic with the same integrals in place of mu_S. Let e be the running
integral of what this leaves out. It is zero at both ends of the step, and orthogonal to straight lines. So the error of
tau comes from products of F e with itself and with the curvature of 1 / w^3. Where mu_S multiplies mu_D, F e has the
factor mu_D(w), whose change within the step adds a share of F e times that change to the error of K. So does the
change of the slope of mu_D, which counts in the rows of a law with kinks.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import legendre, polynomial

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, acceleration, gain, total_friction
from roughslip.oscillator.laws import CONTRACTED, friction_slope, row_ends
from roughslip.oscillator.path import OVERSHOOT, WIDTHS, Path, Piece
from roughslip.oscillator.runge_kutta import ERROR, NODES, ROWS, WEIGHTS, error_ratio, weighted
from roughslip.oscillator.switching_events import Branch

SLOWED, QUICKENED = 0.3, 10.0  # K at the end over K at the start, outside of which no step is tried
LONGEST = 0.5  # of tau
WIDER = 0.3, 0.1, 0.03  # of the error allowed: at the next width, the second and the third it is then below it
FAR, LONGEST_WAIT = 4.0, 30.0  # of the error allowed: how far off a refused step is, and nodes until the next is tried
CHANGE = 0.1  # share of the change of mu_D: with it 95 % of steps on rough paths err by less than 1.2 of the estimate
BEND, SQUARE = 0.3, 1.5  # shares of the two products in the error of tau, by the series of (1 + x)^(-3/2)
SPARE = 3.0  # root mean squares of F e / w, by which X' may differ within the step


def projections() -> np.ndarray:
    """(widths, 3, nodes) : from mu_S at the nodes -1 to n + 1 of a wide piece, the coefficients of its quadratic."""
    table = np.zeros((len(WIDTHS), 3, WIDTHS[-1] + 3))
    points, weights = legendre.leggauss(3)  # exact up to degree 5: a cubic times a quadratic
    t = 0.5 * (points + 1.0)
    end, before, after = t * t * (3 - 2 * t), -t * (1 - t) ** 2 / 2, t * t * (t - 1) / 2
    piece = np.stack([before, 1 - end - after, end - before, after], axis=-1)  # by the nodes around it
    for row, n in zip(table, WIDTHS, strict=True):
        values = np.zeros((n, t.size, n + 3))
        for k in range(n):
            values[k, :, k : k + 4] = piece
        at = np.add.outer(np.arange(n), t).ravel() / n
        row[:, : n + 3] = polynomial.polyfit(at, values.reshape(-1, n + 3), 2, w=np.sqrt(np.tile(weights, n)))
    return table


PROJECTIONS = projections()


@compiled(error_model="numpy", fastmath={"contract", "reassoc"})
def wide_piece(path: Path, first: int, level: int) -> tuple[Piece, float]:
    """The quadratic with the integrals of mu_S, against all quadratics, over WIDTHS[level] spacings from a node on.

    Returns it with the root mean square of e / F at its nodes [m]. The node before it and the one behind it are
    present. Sums are reordered, so that several nodes are taken at once.
    """
    n, table = WIDTHS[level], PROJECTIONS[level]
    t0, t1, t2 = table[0], table[1], table[2]
    nodes = path.nodes[first - path.first - 1 : first - path.first + n + 2]
    c0, c1, c2 = 0.0, 0.0, 0.0
    for i in range(nodes.size):
        c0 += t0[i] * nodes[i]
        c1 += t1[i] * nodes[i]
        c2 += t2[i] * nodes[i]
    total, squares, half, third = (nodes[2] - nodes[0]) / 24, 0.0, 0.5 * c1 / n, c2 / (3.0 * n * n)
    for k in range(1, n):
        total += 0.5 * (nodes[k] + nodes[k + 1])
        e = total - (nodes[k + 2] - nodes[k]) * (1 / 24) - k * (c0 + k * (half + k * third))
        squares += e * e
    piece = Piece(c0, c1, c2, 0.0, first * path.spacing, (first + n) * path.spacing, 1.0 / (n * path.spacing))
    return piece, path.spacing * math.sqrt(squares / (n - 1))


@compiled(error_model="numpy")
def least_of(path: Path, first: int, level: int) -> float:
    """A number that mu_S does not fall below within a wide piece."""
    low, high = np.inf, -np.inf
    for i in range(first - path.first - 1, first - path.first + WIDTHS[level] + 2):
        low, high = min(low, path.nodes[i]), max(high, path.nodes[i])
    return low - OVERSHOOT * (high - low)


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def step_by_distance(
    y: State, sigma: float, first: int, level: int, wide: Piece, rough: float, path: Path, p: Coefficients
) -> tuple[State, float]:  # fmt: skip
    """The state of fifth order at the end of a wide piece, and its error [m] along the quadratic.

    By Fehlberg's pair for tau and K. The piece begins at y but for a small share of a spacing. rough : of `wide_piece`

    The end has no jerk, which another wide step does not need.
    """
    c, rows, h, w0 = NODES, ROWS, wide.right - y.s, sigma * (p.V - y.u)
    start = 0.5 * w0 * w0

    def rates(c: float, passed: float, gained: float) -> tuple[float, float]:
        w, x = math.sqrt(2.0 * (start + gained)), y.x + p.V * passed - sigma * (c * h)
        mu_s = wide.c0 + c * (wide.c1 + c * wide.c2)
        return 1.0 / w, -sigma * acceleration(y.tau + passed, x, p.V - sigma * w, sigma, mu_s, p)

    at_start, of_start = path.nodes[first - path.first], gain(p.omega * w0, p)
    t1, k1 = 1.0 / w0, -sigma * y.a - p.F * of_start * (wide.c0 - at_start)  # X'' is linear in mu_S
    t2, k2 = rates(c[1], h * weighted(rows[0], (t1,)), h * weighted(rows[0], (k1,)))
    t3, k3 = rates(c[2], h * weighted(rows[1], (t1, t2)), h * weighted(rows[1], (k1, k2)))
    t4, k4 = rates(c[3], h * weighted(rows[2], (t1, t2, t3)), h * weighted(rows[2], (k1, k2, k3)))
    t5, k5 = rates(c[4], h * weighted(rows[3], (t1, t2, t3, t4)), h * weighted(rows[3], (k1, k2, k3, k4)))
    t6, k6 = rates(c[5], h * weighted(rows[4], (t1, t2, t3, t4, t5)), h * weighted(rows[4], (k1, k2, k3, k4, k5)))
    ts, ks = (t1, t3, t4, t5, t6), (k1, k3, k4, k5, k6)
    late = (y.s - wide.left) * (wide.c0 + wide.c1 / 2 + wide.c2 / 3 - at_start)
    k, passed = start + h * weighted(WEIGHTS, ks) - p.F * of_start * late, h * weighted(WEIGHTS, ts)
    w, x = math.sqrt(2.0 * k), y.x + p.V * passed - sigma * h
    u, of_end = p.V - sigma * w, gain(p.omega * w, p)
    a = acceleration(y.tau + passed, x, u, sigma, path.nodes[first + WIDTHS[level] - path.first], p)
    tau_error = abs(h * weighted(ERROR, ts))
    k_error = abs(h * weighted(ERROR, ks)) + CHANGE * p.F * rough * abs(of_end - of_start)
    error = max(w * tau_error, k_error / w + abs(a) * tau_error)
    return State(y.tau + passed, x, u, wide.right, a, np.nan), error


@compiled(error_model="numpy")
def left_out(
    y: State, w0: float, w: float, passed: float, rough: float, here: Branch, p: Coefficients
) -> tuple[float, float]:  # fmt: skip
    """The deviation of X' from that along the quadratic within a step [m], and the error that it leaves [m].

    w0, w : sliding speeds at the ends [m]
    passed : duration of the step
    """
    slowness, steep, bend = 1.0 / min(w, w0), abs(y.a) / w, abs(w * w - w0 * w0) / (w * w + w0 * w0)
    deviation = p.F * max(gain(p.omega * w0, p), gain(p.omega * w, p)) * rough * slowness
    error = passed * deviation * (BEND * bend * bend + SQUARE * deviation * slowness) * (1.0 + steep)
    if row_ends(here.row, p.law)[1] < np.inf:
        turn = friction_slope(p.omega * w, here.p.law) - friction_slope(p.omega * w0, here.p.law)
        error += passed * p.F * p.omega * abs(turn) * deviation
    return deviation, error


@compiled(error_model="numpy")
def keeps_branch(
    y: State, end: State, deviation: float, backwards: bool, sigma: float, row: int, p: Coefficients
) -> bool:  # fmt: skip
    """Whether the speed stays on its row of the law, and no X' < 0 between the ends is missed.

    deviation : of X' within the step [m]
    """
    spare = SPARE * deviation
    if y.a * end.a < 0.0:  # a parabola has its extreme within the step
        spare += 0.25 * (end.tau - y.tau) * min(abs(y.a), abs(end.a))
    first, last = sigma * p.omega * (p.V - y.u), sigma * p.omega * (p.V - end.u)
    low, high = row_ends(row, p.law)
    on_row = low < min(first, last) - p.omega * spare and max(first, last) + p.omega * spare < high
    return on_row and (backwards or end.u < 0.0 or min(y.u, end.u) > spare)


@compiled(error_model="numpy")
def is_cut(y: State, end: State, least: float, sigma: float, p: Coefficients) -> bool:
    """Whether friction might be cut to zero between two states. least : that mu_S does not fall below"""
    speeds = sigma * p.omega * (p.V - y.u), sigma * p.omega * (p.V - end.u)
    return min(total_friction(speeds[0], least, p), total_friction(speeds[1], least, p)) == 0.0


@compiled(error_model="numpy")
def wide_step(
    y: State, level: int, backwards: bool, sigma: float, here: Branch, path: Path, p: Coefficients, tolerance: float,
    tau_end: float,
) -> tuple[State, float, int, int]:  # fmt: skip
    """Step from a state at a node over as many nodes as a level of WIDTHS has, or over fewer where that is too many.

    Returns state, error [m], level of the next step (where every width is refused, -1 less the number of nodes at which
    none is tried), and number of widths tried. A width is refused where its error is above that of `slip`, and where
    friction might be cut, the branch or the direction of motion change, or the motion reach tau_end or the last node.
    So is a step back in time: near a stop between its ends 1 / w is so large that a negative weight outdoes all others.
    """
    first, tried, wait = int(y.s / path.spacing + 0.5), 0, 0
    w0 = sigma * (p.V - y.u)
    k0 = 0.5 * w0 * w0
    for at in range(level if first > path.first else -1, -1, -1):
        h = (first + WIDTHS[at]) * path.spacing - y.s
        k = k0 - sigma * y.a * h  # roughly, at the end
        if not SLOWED * k0 < k < QUICKENED * k0 or first + WIDTHS[at] + 1 >= path.first + path.nodes.size:
            continue
        w = math.sqrt(2.0 * k)
        passed = 2.0 * h / (w0 + w)
        if passed >= LONGEST:
            continue
        wide, rough = wide_piece(path, first, at)
        deviation, lost = left_out(y, w0, w, passed, rough, here, p)
        ratio = error_ratio(lost, passed, y, p, tolerance)
        wait = int(min(ratio / FAR, LONGEST_WAIT)) if ratio > 0.0 else 0
        if ratio > 1.0:
            continue
        end, error = step_by_distance(y, sigma, first, at, wide, rough, path, here.p)
        error, tried = error + lost, tried + 1
        ratio = error_ratio(error, end.tau - y.tau, end, p, tolerance)
        wait = int(min(ratio / FAR, LONGEST_WAIT)) if ratio > 0.0 else 0
        in_time = y.tau < end.tau < tau_end
        if not (ratio <= 1.0 and in_time and keeps_branch(y, end, deviation, backwards, sigma, here.row, p)):
            continue
        if not (is_cut(y, end, path.least, sigma, p) and is_cut(y, end, least_of(path, first, at), sigma, p)):
            wider = (ratio < WIDER[0]) + (ratio < WIDER[1]) + (ratio < WIDER[2])
            return end, error, min(at + wider, len(WIDTHS) - 1), tried
    return y, 0.0, -1 - wait, tried
