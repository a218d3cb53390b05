"""One step of slip by the embedded Runge-Kutta pair of Dormand and Prince of order 8 with estimates of order 5 and 3.

E. Hairer, S. P. Nørsett & G. Wanner, Solving Ordinary Differential Equations I, 2nd ed. 1993, II.5 and II.10: the
coefficients of their code DOP853, rounded to doubles. Twice the stages of Fehlberg's pair a step, and steps several
times as long where the motion is smooth; where nodes of a path bound the steps it does not pay.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from roughslip.oscillator.equation import State, acceleration, completed, place
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


@njit(cache=True, error_model="numpy")
def dormand_prince_step(
    y: State, h: float, sigma: float, piece: Piece, p: Coefficients, stages: np.ndarray
) -> tuple[State, float]:
    """The state of eighth order after a step h and its error [m], which goes with h^8.

    stages : (2, STAGES) room for X' and X'' of the stages
    """
    us, accelerations = stages[0], stages[1]
    us[0], accelerations[0] = y.u, y.a
    for i in range(1, STAGES):
        x, u = 0.0, 0.0
        for k in range(i):
            x += A[i, k] * us[k]
            u += A[i, k] * accelerations[k]
        x, u, step = y.x + h * x, y.u + h * u, C[i] * h
        us[i] = u
        z = place(y.tau + step, y.s + sigma * (p.V * step - (x - y.x)), p)
        accelerations[i] = acceleration(y.tau + step, x, u, sigma, offset(piece, z), p)
    dx, du, x5, u5, x3, u3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(STAGES):
        dx += B[k] * us[k]
        du += B[k] * accelerations[k]
        x5 += E5[k] * us[k]
        u5 += E5[k] * accelerations[k]
        x3 += E3[k] * us[k]
        u3 += E3[k] * accelerations[k]
    s = y.s + sigma * (p.V * h - h * dx)
    end = completed(y.tau + h, y.x + h * dx, y.u + h * du, s, sigma, piece, p)
    return end, h * max(_estimate(x5, x3), _estimate(u5, u3))


@njit(cache=True, error_model="numpy")
def _estimate(fifth: float, third: float) -> float:
    """Of order 7 from differences of order 5 and 3, as DOP853 combines them."""
    size = fifth * fifth + 0.01 * third * third
    return fifth * fifth / np.sqrt(size) if size > 0.0 else 0.0
