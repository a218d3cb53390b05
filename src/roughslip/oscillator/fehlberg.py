"""One step of slip by the embedded Runge-Kutta-Fehlberg pair 4(5)."""

from __future__ import annotations

from roughslip.compilation import compiled
from roughslip.oscillator.equation import State, acceleration, completed, place
from roughslip.oscillator.law import CONTRACTED
from roughslip.oscillator.path import Piece, offset
from roughslip.oscillator.system import Coefficients

STAGES, ORDER = 6, 5


@compiled(forceinline=True, error_model="numpy", fastmath=CONTRACTED)
def fehlberg_step(y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state of fifth order after a step h and the error of the fourth [m] (E. Fehlberg, NASA TR R-315, 1969).

    The slipped distance needs no equation of its own: s + sigma (X - V tau) is constant in slip.
    """
    tau, x, u, a = y.tau, y.x, y.u, y.a

    def slipped(step: float, x_then: float) -> float:
        return y.s + sigma * (p.V * step - (x_then - x))

    def slope(c: float, x_then: float, u_then: float) -> float:
        z = place(tau + c * h, slipped(c * h, x_then), p)
        return acceleration(tau + c * h, x_then, u_then, sigma, offset(piece, z), p)

    u2 = u + h * (a / 4)
    x2 = x + h * (u / 4)
    a2 = slope(1 / 4, x2, u2)
    u3 = u + h * (3 / 32 * a + 9 / 32 * a2)
    x3 = x + h * (3 / 32 * u + 9 / 32 * u2)
    a3 = slope(3 / 8, x3, u3)
    u4 = u + h * (1932 / 2197 * a - 7200 / 2197 * a2 + 7296 / 2197 * a3)
    x4 = x + h * (1932 / 2197 * u - 7200 / 2197 * u2 + 7296 / 2197 * u3)
    a4 = slope(12 / 13, x4, u4)
    u5 = u + h * (439 / 216 * a - 8 * a2 + 3680 / 513 * a3 - 845 / 4104 * a4)
    x5 = x + h * (439 / 216 * u - 8 * u2 + 3680 / 513 * u3 - 845 / 4104 * u4)
    a5 = slope(1.0, x5, u5)
    u6 = u + h * (-8 / 27 * a + 2 * a2 - 3544 / 2565 * a3 + 1859 / 4104 * a4 - 11 / 40 * a5)
    x6 = x + h * (-8 / 27 * u + 2 * u2 - 3544 / 2565 * u3 + 1859 / 4104 * u4 - 11 / 40 * u5)
    a6 = slope(1 / 2, x6, u6)
    x_new = x + h * (16 / 135 * u + 6656 / 12825 * u3 + 28561 / 56430 * u4 - 9 / 50 * u5 + 2 / 55 * u6)
    u_new = u + h * (16 / 135 * a + 6656 / 12825 * a3 + 28561 / 56430 * a4 - 9 / 50 * a5 + 2 / 55 * a6)
    x_error = h * (1 / 360 * u - 128 / 4275 * u3 - 2197 / 75240 * u4 + 1 / 50 * u5 + 2 / 55 * u6)
    u_error = h * (1 / 360 * a - 128 / 4275 * a3 - 2197 / 75240 * a4 + 1 / 50 * a5 + 2 / 55 * a6)
    return completed(tau + h, x_new, u_new, slipped(h, x_new), sigma, piece, p), max(abs(x_error), abs(u_error))
