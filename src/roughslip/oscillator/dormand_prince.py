"""One step of slip by the embedded Runge-Kutta pair of Dormand and Prince of order 8 with estimates of order 5 and 3.

E. Hairer, S. P. Nørsett & G. Wanner, Solving Ordinary Differential Equations I, 2nd ed. 1993, II.5 and II.10: the
coefficients of their code DOP853, rounded to doubles. Twice the stages of Fehlberg's pair a step, and steps several
times as long where the motion is smooth; where nodes of a path bound the steps it does not pay.
"""

from __future__ import annotations

import numpy as np

from roughslip.compilation import compiled
from roughslip.oscillator.equation import State, acceleration, completed, place
from roughslip.oscillator.law import CONTRACTED
from roughslip.oscillator.path import Piece, offset
from roughslip.oscillator.system import Coefficients

STAGES, ORDER = 12, 8

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
A = np.array([(*row, *(STAGES - len(row)) * (0.0,)) for row in ((), *_ROWS)])
B = np.array((
    0.054293734116568765, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,
))  # fmt: skip
# The weights less those of order 5, and less those of order 3.
E5 = np.array((
    0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294,
))  # fmt: skip
E3 = B.copy()
E3[[0, 8, 11]] -= 0.2440944881889764, 0.7338466882816118, 0.022058823529411766


# Without their zeros, as the step reads them: sums of constant length, which the compiler writes out.
ROWS = tuple(tuple(value for value in row if value != 0.0) for row in _ROWS)
WEIGHTS, ERROR5, ERROR3 = (tuple(map(float, row[[0, *range(5, STAGES)]])) for row in (B, E5, E3))
NODES = tuple(map(float, C))


@compiled(error_model="numpy", fastmath=CONTRACTED)
def weighted(row: tuple[float, ...], values: tuple[float, ...]) -> float:
    """The sum of products of two tuples of the same length."""
    total = row[0] * values[0]
    for i in range(1, len(row)):
        total += row[i] * values[i]
    return total


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def dormand_prince_step(y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state of eighth order after a step h and its error [m], which goes with h^8."""
    tau, x, u, a = y.tau, y.x, y.u, y.a

    def slope(c: float, x_then: float, u_then: float) -> float:
        z = place(tau + c * h, y.s + sigma * (p.V * (c * h) - (x_then - x)), p)
        return acceleration(tau + c * h, x_then, u_then, sigma, offset(piece, z), p)

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


@compiled(error_model="numpy")
def _estimate(fifth: float, third: float) -> float:
    """Of order 7 from differences of order 5 and 3, as DOP853 combines them."""
    size = fifth * fifth + 0.01 * third * third
    return fifth * fifth / np.sqrt(size) if size > 0.0 else 0.0
