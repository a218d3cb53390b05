"""A step of slip with a memory of the contact, by Rosenbrock's method.

The page docs/background/memory.md has the equations for s, w = sigma (V - X') and psi, and why slip is stiff. RODAS has
order 4 with an estimate of order 3, and takes the Jacobian, which is exact here (E. Hairer & G. Wanner, Solving
Ordinary Differential Equations II, 2nd ed. 1996, IV.7 and VI.4).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients
from roughslip.oscillator.memory_law import direct_slope, friction_of
from roughslip.oscillator.path import Piece, mu_s_at, mu_s_slope

# Coefficients of RODAS in the form of its authors' code: those of time and of its derivative, rows of stages and of
# their sums on the right-hand side.
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


class MemoryState(NamedTuple):
    """tau [-], X, slipped distance s, sliding speed w [m], and psi [-]."""

    tau: float
    x: float
    s: float
    w: float
    psi: float


@compiled(forceinline=True, error_model="numpy")
def scattered(mean: float, mu_s: float, p: Coefficients) -> float:
    """Friction with its scatter, never below zero."""
    return max(mean * (1.0 + mu_s) if p.multiplies is not None else mean + mu_s, 0.0)


@compiled(forceinline=True, error_model="numpy")
def rates(y: MemoryState, sigma: float, piece: Piece, p: Coefficients) -> tuple[float, float, float]:
    """s', w' and psi'."""
    speed = p.omega * y.w
    mu = scattered(friction_of(speed, y.psi, p.law), mu_s_at(piece, y.s), p)
    renewal = ((speed + p.law.cutoff) * math.exp(-y.psi) - speed) / (p.law.length * p.omega)
    return y.w, sigma * (y.x + 2.0 * p.D * p.V) - 2.0 * p.D * y.w - p.F * mu, renewal


@compiled(forceinline=True, error_model="numpy")
def combined(row: Any, k: Any) -> tuple[float, float, float]:
    """The sum of stages, each of s, w and psi, as a row of the tableau weighs them."""
    s, w, psi = 0.0, 0.0, 0.0
    for i in range(len(row)):
        s, w, psi = s + row[i] * k[i][0], w + row[i] * k[i][1], psi + row[i] * k[i][2]
    return s, w, psi


@compiled(error_model="numpy")
def rosenbrock(
    y: MemoryState, h: float, sigma: float, piece: Piece, p: Coefficients
) -> tuple[MemoryState, tuple[float, float, float]]:
    """The state a step h after y, and its errors in s, w [m] and psi."""
    speed, fresh, mu_s, diagonal = p.omega * y.w, math.exp(-y.psi), mu_s_at(piece, y.s), 1.0 / (h * GAMMA)
    mean = friction_of(speed, y.psi, p.law)
    gain, share = (mean, 1.0 + mu_s) if p.multiplies is not None else (1.0, 1.0)
    pull = p.F if scattered(mean, mu_s, p) > 0.0 else 0.0
    ws, wp = -1.0 - pull * gain * mu_s_slope(piece, y.s), -pull * share * p.law.ageing  # d w' / d s and d psi
    ww = -2.0 * p.D - pull * share * p.omega * direct_slope(speed, p.law)
    pw, pp = (fresh - 1.0) / p.law.length, -(speed + p.law.cutoff) * fresh / (p.law.length * p.omega)
    of_psi = diagonal - pp
    of_w = diagonal - ww - ws / diagonal - wp * pw / of_psi

    def solved(s: float, w: float, psi: float) -> tuple[float, float, float]:
        w = (w + ws * s / diagonal + wp * psi / of_psi) / of_w
        return (s + w) / diagonal, w, (psi + pw * w) / of_psi

    def moved(time: float, by: Any) -> MemoryState:
        x = y.x + p.V * time * h - sigma * by[0]
        return MemoryState(y.tau + time * h, x, y.s + by[0], y.w + by[1], y.psi + by[2])

    def stage(at: MemoryState, of_time: float, sums: Any, k: Any) -> tuple[float, float, float]:
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
