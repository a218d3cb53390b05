"""The embedded Runge-Kutta pairs for slip: a tableau each, and one step by it.

Fehlberg's pair of order 5 with an estimate of order 4 (E. Fehlberg, NASA TR R-315, 1969), and the pair of Dormand and
Prince of order 8 with estimates of order 5 and 3 (E. Hairer, S. P. Nørsett & G. Wanner, Solving Ordinary Differential
Equations I, 2nd ed. 1993, II.5 and II.10: the coefficients of their code DOP853, rounded to doubles). The second has
twice the stages, and steps several times as long where the motion is smooth; where nodes of a path bound the steps it
does not pay.

The rows of the tableaux are tuples without their zeros, so that the compiler writes out their sums. A step is written
into its callers (`forceinline`): passing the thirty numbers of state, path and coefficients takes a quarter of the time
of a motion.
"""

from __future__ import annotations

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, State, acceleration, completed, path_coordinate
from roughslip.oscillator.laws import CONTRACTED
from roughslip.oscillator.path import Piece, mu_s_at

FEHLBERG45, DORMAND_PRINCE853 = 0, 1
PAIRS = {"fehlberg45": FEHLBERG45, "dormand_prince853": DORMAND_PRINCE853}
STAGES = (6, 12)  # evaluations of X'' in a step
ORDERS = (5, 8)  # by which power of the step its error estimate goes

# Fehlberg: nodes, rows, weights of order 5, and the weights less those of order 4.
FEHLBERG_NODES = (0.0, 1 / 4, 3 / 8, 12 / 13, 1.0, 1 / 2)
FEHLBERG_ROWS = (
    (1 / 4,),
    (3 / 32, 9 / 32),
    (1932 / 2197, -7200 / 2197, 7296 / 2197),
    (439 / 216, -8.0, 3680 / 513, -845 / 4104),
    (-8 / 27, 2.0, -3544 / 2565, 1859 / 4104, -11 / 40),
)
FEHLBERG_WEIGHTS = (16 / 135, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55)
FEHLBERG_ERROR = (1 / 360, -128 / 4275, -2197 / 75240, 1 / 50, 2 / 55)

# Dormand and Prince, with zeros: nodes C, matrix A, weights B, and B less the weights of order 5 and of order 3.
C = np.array((
    0.0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333, 0.25,
    0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0,
))  # fmt: skip
_ROWS = (
    (0.05260015195876773,),
    (0.0197250569845379, 0.0591751709536137),
    (0.02958758547680685, 0.0, 0.08876275643042054),
    (0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792),
    (0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242),
    (0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
    (
        0.03709200011850479, 0.0, 0.0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
        0.008273789163814023,
    ),
    (
        0.6241109587160757, 0.0, 0.0, -3.3608926294469414, -0.868219346841726, 27.59209969944671, 20.154067550477894,
        -43.48988418106996,
    ),
    (
        0.47766253643826434, 0.0, 0.0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
        15.279233632882423, -33.28821096898486, -0.020331201708508627,
    ),
    (
        -0.9371424300859873, 0.0, 0.0, 5.186372428844064, 1.0914373489967295, -8.149787010746927, -18.52006565999696,
        22.739487099350505, 2.4936055526796523, -3.0467644718982196,
    ),
    (
        2.273310147516538, 0.0, 0.0, -10.53449546673725, -2.0008720582248625, -17.9589318631188, 27.94888452941996,
        -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636,
    ),
)  # fmt: skip
A = np.array([(*row, *(12 - len(row)) * (0.0,)) for row in ((), *_ROWS)])
B = np.array((
    0.054293734116568765, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,
))  # fmt: skip
E5 = np.array((
    0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294,
))  # fmt: skip
E3 = B.copy()
E3[[0, 8, 11]] -= 0.2440944881889764, 0.7338466882816118, 0.022058823529411766
# Without their zeros, as the step reads them: sums of constant length, which the compiler writes out.
ROWS = tuple(tuple(value for value in row if value != 0.0) for row in _ROWS)
WEIGHTS, ERROR5, ERROR3 = (tuple(map(float, row[[0, *range(5, 12)]])) for row in (B, E5, E3))
NODES = tuple(map(float, C))


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def weighted(row: tuple[float, ...], values: tuple[float, ...]) -> float:
    """The sum of products of two tuples of the same length."""
    total = row[0] * values[0]
    for i in range(1, len(row)):
        total += row[i] * values[i]
    return total


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def fehlberg_step(y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state of fifth order after a step h and the error of the fourth [m].

    The slipped distance needs no equation of its own: s + sigma (X - V tau) is constant in slip.
    """
    tau, x, u, a = y.tau, y.x, y.u, y.a
    rows, c = FEHLBERG_ROWS, FEHLBERG_NODES

    def slope(c: float, x_then: float, u_then: float) -> float:
        z = path_coordinate(tau + c * h, y.s + sigma * (p.V * (c * h) - (x_then - x)), p)
        return acceleration(tau + c * h, x_then, u_then, sigma, mu_s_at(piece, z), p)

    x2, u2 = x + h * weighted(rows[0], (u,)), u + h * weighted(rows[0], (a,))
    a2 = slope(c[1], x2, u2)
    x3, u3 = x + h * weighted(rows[1], (u, u2)), u + h * weighted(rows[1], (a, a2))
    a3 = slope(c[2], x3, u3)
    x4, u4 = x + h * weighted(rows[2], (u, u2, u3)), u + h * weighted(rows[2], (a, a2, a3))
    a4 = slope(c[3], x4, u4)
    x5, u5 = x + h * weighted(rows[3], (u, u2, u3, u4)), u + h * weighted(rows[3], (a, a2, a3, a4))
    a5 = slope(c[4], x5, u5)
    x6, u6 = x + h * weighted(rows[4], (u, u2, u3, u4, u5)), u + h * weighted(rows[4], (a, a2, a3, a4, a5))
    a6 = slope(c[5], x6, u6)
    us, accelerations = (u, u3, u4, u5, u6), (a, a3, a4, a5, a6)
    dx, du = h * weighted(FEHLBERG_WEIGHTS, us), h * weighted(FEHLBERG_WEIGHTS, accelerations)
    x_new = x + dx
    s_new = y.s + sigma * (p.V * h - (x_new - x))
    end = completed(tau + h, x_new, u + du, s_new, sigma, piece, p)
    x_error, u_error = h * weighted(FEHLBERG_ERROR, us), h * weighted(FEHLBERG_ERROR, accelerations)
    return end, max(abs(x_error), abs(u_error))


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def dormand_prince_step(y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state of eighth order after a step h and its error [m], which goes with h^8."""
    tau, x, u, a = y.tau, y.x, y.u, y.a

    def slope(c: float, x_then: float, u_then: float) -> float:
        z = path_coordinate(tau + c * h, y.s + sigma * (p.V * (c * h) - (x_then - x)), p)
        return acceleration(tau + c * h, x_then, u_then, sigma, mu_s_at(piece, z), p)

    x2, u2 = x + h * weighted(ROWS[0], (u,)), u + h * weighted(ROWS[0], (a,))
    a2 = slope(NODES[1], x2, u2)
    x3, u3 = x + h * weighted(ROWS[1], (u, u2)), u + h * weighted(ROWS[1], (a, a2))
    a3 = slope(NODES[2], x3, u3)
    x4, u4 = x + h * weighted(ROWS[2], (u, u3)), u + h * weighted(ROWS[2], (a, a3))
    a4 = slope(NODES[3], x4, u4)
    x5, u5 = x + h * weighted(ROWS[3], (u, u3, u4)), u + h * weighted(ROWS[3], (a, a3, a4))
    a5 = slope(NODES[4], x5, u5)
    x6, u6 = x + h * weighted(ROWS[4], (u, u4, u5)), u + h * weighted(ROWS[4], (a, a4, a5))
    a6 = slope(NODES[5], x6, u6)
    x7, u7 = x + h * weighted(ROWS[5], (u, u4, u5, u6)), u + h * weighted(ROWS[5], (a, a4, a5, a6))
    a7 = slope(NODES[6], x7, u7)
    x8, u8 = x + h * weighted(ROWS[6], (u, u4, u5, u6, u7)), u + h * weighted(ROWS[6], (a, a4, a5, a6, a7))
    a8 = slope(NODES[7], x8, u8)
    x9, u9 = x + h * weighted(ROWS[7], (u, u4, u5, u6, u7, u8)), u + h * weighted(ROWS[7], (a, a4, a5, a6, a7, a8))
    a9 = slope(NODES[8], x9, u9)
    x10, u10 = (
        x + h * weighted(ROWS[8], (u, u4, u5, u6, u7, u8, u9)),
        u + h * weighted(ROWS[8], (a, a4, a5, a6, a7, a8, a9)),
    )
    a10 = slope(NODES[9], x10, u10)
    x11, u11 = (
        x + h * weighted(ROWS[9], (u, u4, u5, u6, u7, u8, u9, u10)),
        u + h * weighted(ROWS[9], (a, a4, a5, a6, a7, a8, a9, a10)),
    )
    a11 = slope(NODES[10], x11, u11)
    x12, u12 = (
        x + h * weighted(ROWS[10], (u, u4, u5, u6, u7, u8, u9, u10, u11)),
        u + h * weighted(ROWS[10], (a, a4, a5, a6, a7, a8, a9, a10, a11)),
    )
    a12 = slope(NODES[11], x12, u12)
    us, accelerations = (u, u6, u7, u8, u9, u10, u11, u12), (a, a6, a7, a8, a9, a10, a11, a12)
    dx, du = h * weighted(WEIGHTS, us), h * weighted(WEIGHTS, accelerations)
    end = completed(tau + h, x + dx, u + du, y.s + sigma * (p.V * h - dx), sigma, piece, p)
    x_error = _estimate(weighted(ERROR5, us), weighted(ERROR3, us))
    u_error = _estimate(weighted(ERROR5, accelerations), weighted(ERROR3, accelerations))
    return end, h * max(x_error, u_error)


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def _estimate(fifth: float, third: float) -> float:
    """Of order 7 from differences of order 5 and 3, as DOP853 combines them."""
    size = fifth * fifth + 0.01 * third * third
    return fifth * fifth / np.sqrt(size) if size > 0.0 else 0.0


@compiled(forceinline=True)
def step(pair: int, y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state after a step h, with its acceleration and jerk, and the estimated error [m]."""
    if pair == FEHLBERG45:
        return fehlberg_step(y, h, sigma, piece, p)
    return dormand_prince_step(y, h, sigma, piece, p)
