"""A step of slip over many nodes of the friction path, with the slipped distance s as independent variable.

With the sliding speed w = sigma (V - X') > 0 and K = w^2 / 2, slip obeys

    d tau / ds = 1 / w,    dK / ds = -sigma X'',    X = X0 + V (tau - tau0) - sigma (s - s0).

X'' is linear in mu_S. The step takes a quadratic with the same integrals in place of mu_S. Let e be the running
integral of what this leaves out. It is zero at both ends of the step, and orthogonal to straight lines. So the error of
tau comes from products of F e with itself and with the curvature of 1 / w^3. Where mu_S multiplies mu_D, F e has the
factor mu_D(w), whose change within the step adds a share of F e times that change to the error of K.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import legendre, polynomial

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, acceleration, gain, slip_state, total_friction
from roughslip.oscillator.laws import CONTRACTED, row_ends
from roughslip.oscillator.path import WIDTHS, Path, Piece, mu_s_at, piece_at
from roughslip.oscillator.runge_kutta import ERROR, NODES, ROWS, WEIGHTS, error_ratio, weighted
from roughslip.oscillator.switching_events import Branch

SLOWED, QUICKENED = 0.3, 10.0  # K at the end over K at the start, outside of which no step is tried
LONGEST = 0.5  # of tau
NEXT_WIDER = 0.08  # of the error allowed: at twice the width it is then below it
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


@compiled(error_model="numpy", fastmath={"contract", "reassoc", "nnan", "nsz"})
def wide_piece(path: Path, first: int, level: int) -> tuple[Piece, float, float]:
    """The quadratic with the integrals of mu_S, against all quadratics, over WIDTHS[level] spacings from a node on.

    Returns it with the root mean square of e / F at its nodes [m], and a number that mu_S does not fall below.
    The node before it and the one behind it are present. Sums are reordered, so that several nodes are taken at once.
    """
    n, table = WIDTHS[level], PROJECTIONS[level]
    t0, t1, t2 = table[0], table[1], table[2]
    nodes = path.nodes[first - path.first - 1 : first - path.first + n + 2]
    c0, c1, c2, low, high = 0.0, 0.0, 0.0, np.inf, -np.inf
    for i in range(nodes.size):
        mu_s = nodes[i]
        c0 += t0[i] * mu_s
        c1 += t1[i] * mu_s
        c2 += t2[i] * mu_s
        low, high = min(low, mu_s), max(high, mu_s)
    total, squares = (nodes[2] - nodes[0]) / 24, 0.0
    for k in range(1, n):
        total += 0.5 * (nodes[k] + nodes[k + 1])
        e = total - (nodes[k + 2] - nodes[k]) / 24 - k * (c0 + k / n * (c1 / 2 + k / n * c2 / 3))
        squares += e * e
    piece = Piece(c0, c1, c2, 0.0, first * path.spacing, (first + n) * path.spacing, 1.0 / (n * path.spacing))
    return piece, path.spacing * math.sqrt(squares / (n - 1)), low - (high - low) / 6.0


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def step_by_distance(
    y: State, sigma: float, wide: Piece, rough: float, path: Path, p: Coefficients
) -> tuple[State, float, float]:
    """The state of fifth order at the end of a wide piece, its error [m], and the deviation of X' within the step [m].

    By Fehlberg's pair for tau and K. The piece begins at y but for a small share of a spacing. rough : of `wide_piece`
    """
    c, rows, h, w0 = NODES, ROWS, wide.right - y.s, sigma * (p.V - y.u)
    start = 0.5 * w0 * w0

    def rates(c: float, passed: float, gained: float) -> tuple[float, float]:
        w, x = math.sqrt(2.0 * (start + gained)), y.x + p.V * passed - sigma * (c * h)
        mu_s = mu_s_at(wide, wide.left + c * (wide.right - wide.left))
        return 1.0 / w, -sigma * acceleration(y.tau + passed, x, p.V - sigma * w, sigma, mu_s, p)

    t1, k1 = rates(0.0, 0.0, 0.0)
    t2, k2 = rates(c[1], h * weighted(rows[0], (t1,)), h * weighted(rows[0], (k1,)))
    t3, k3 = rates(c[2], h * weighted(rows[1], (t1, t2)), h * weighted(rows[1], (k1, k2)))
    t4, k4 = rates(c[3], h * weighted(rows[2], (t1, t2, t3)), h * weighted(rows[2], (k1, k2, k3)))
    t5, k5 = rates(c[4], h * weighted(rows[3], (t1, t2, t3, t4)), h * weighted(rows[3], (k1, k2, k3, k4)))
    t6, k6 = rates(c[5], h * weighted(rows[4], (t1, t2, t3, t4, t5)), h * weighted(rows[4], (k1, k2, k3, k4, k5)))
    ts, ks, of_start = (t1, t3, t4, t5, t6), (k1, k3, k4, k5, k6), gain(p.omega * w0, p)
    late = (y.s - wide.left) * (wide.c0 + wide.c1 / 2 + wide.c2 / 3 - mu_s_at(piece_at(path, y.s), wide.left))
    k, passed = start + h * weighted(WEIGHTS, ks) - p.F * of_start * late, h * weighted(WEIGHTS, ts)
    w, x = math.sqrt(2.0 * k), y.x + p.V * passed - sigma * h
    beyond, of_end = piece_at(path, wide.right + 0.5 * path.spacing), gain(p.omega * w, p)
    end = slip_state(y.tau + passed, x, p.V - sigma * w, wide.right, sigma, beyond, p)
    slowest, steep, bend = min(w, w0), abs(end.a) / w, (k - start) / (k + start)
    deviation = p.F * max(of_start, of_end) * rough / slowest
    left_out = passed * deviation * (BEND * bend * bend + SQUARE * deviation / slowest)
    tau_error = abs(h * weighted(ERROR, ts))
    k_error = abs(h * weighted(ERROR, ks)) + CHANGE * p.F * rough * abs(of_end - of_start)
    error = max(w * tau_error, k_error / w + abs(end.a) * tau_error) + left_out * (1.0 + steep)
    return end, error, deviation


@compiled(error_model="numpy")
def keeps_branch(
    y: State, end: State, deviation: float, least: float, backwards: bool, sigma: float, row: int, p: Coefficients
) -> bool:  # fmt: skip
    """Whether the speed stays on its row of the law, friction above zero, and no X' < 0 between the ends is missed.

    deviation : of X' within the step [m]
    least : that mu_S does not fall below
    """
    spare = SPARE * deviation
    if y.a * end.a < 0.0:  # a parabola has its extreme within the step
        spare += 0.25 * (end.tau - y.tau) * min(abs(y.a), abs(end.a))
    first, last = sigma * p.omega * (p.V - y.u), sigma * p.omega * (p.V - end.u)
    low, high = row_ends(row, p.law)
    on_row = low < min(first, last) - p.omega * spare and max(first, last) + p.omega * spare < high
    not_cut = min(total_friction(first, least, p), total_friction(last, least, p)) > 0.0
    return on_row and not_cut and (backwards or end.u < 0.0 or min(y.u, end.u) > spare)


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
        if not (SLOWED * k0 < k < QUICKENED * k0 and 2.0 * h < LONGEST * (w0 + math.sqrt(2.0 * k))):
            continue
        if first + WIDTHS[at] + 1 >= path.first + path.nodes.size:
            continue
        wide, rough, least = wide_piece(path, first, at)
        end, error, deviation = step_by_distance(y, sigma, wide, rough, path, here.p)
        ratio, tried = error_ratio(error, end.tau - y.tau, end, p, tolerance), tried + 1
        wait = int(min(ratio / FAR, LONGEST_WAIT)) if ratio > 0.0 else 0
        in_time = y.tau < end.tau < tau_end
        if ratio <= 1.0 and in_time and keeps_branch(y, end, deviation, least, backwards, sigma, here.row, p):
            return end, error, min(at + (ratio < NEXT_WIDER), len(WIDTHS) - 1), tried
    return y, 0.0, -1 - wait, tried
