"""One step of slip: the right-hand side, the embedded Runge-Kutta-Fehlberg pair 4(5), and its dense output."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from roughslip.oscillator.law import stribeck, stribeck_slope
from roughslip.oscillator.path import Piece, offset, offset_slope
from roughslip.oscillator.system import Coefficients


class State(NamedTuple):
    """tau [-], X, X', slipped distance s and X'' [m]."""

    tau: float
    x: float
    u: float
    s: float
    a: float


@njit(cache=True)
def acceleration(tau: float, x: float, u: float, sigma: float, mu_s: float, p: Coefficients) -> float:
    """X'' [m] in slip of sign sigma, continued smoothly through v_rel = 0."""
    speed = sigma * p.omega * (p.V - u)
    mu = max(stribeck(speed, p.fit, p.static, p.decay, p.quadratic) + mu_s, 0.0)
    drive = p.q * math.cos(p.r * tau) if p.q > 0.0 else 0.0
    return sigma * p.F * mu - 2.0 * p.D * u - x + drive


@njit(cache=True)
def jerk(y: State, sigma: float, piece: Piece, p: Coefficients) -> float:
    """X''' [m] in slip of sign sigma."""
    speed = sigma * p.omega * (p.V - y.u)
    slope = stribeck_slope(speed, p.fit, p.decay, p.quadratic)
    mu_rate = -slope * sigma * p.omega * y.a + offset_slope(piece, y.s) * sigma * (p.V - y.u)
    drive = p.q * p.r * math.sin(p.r * y.tau) if p.q > 0.0 else 0.0
    return sigma * p.F * mu_rate - 2.0 * p.D * y.a - y.u - drive


@njit(cache=True)
def fehlberg_step(y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state of fifth order after a step h and the error of the fourth [m] (E. Fehlberg, NASA TR R-315, 1969).

    The slipped distance needs no equation of its own: s + sigma (X - V tau) is constant in slip.
    """
    tau, x, u, a = y.tau, y.x, y.u, y.a

    def slipped(step: float, x_then: float) -> float:
        return y.s + sigma * (p.V * step - (x_then - x))

    def slope(c: float, x_then: float, u_then: float) -> float:
        return acceleration(tau + c * h, x_then, u_then, sigma, offset(piece, slipped(c * h, x_then)), p)

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
    s_new = slipped(h, x_new)
    a_new = acceleration(tau + h, x_new, u_new, sigma, offset(piece, s_new), p)
    return State(tau + h, x_new, u_new, s_new, a_new), max(abs(x_error), abs(u_error))


@njit(cache=True)
def hermite(t: float, h: float, y0: float, d0: float, y1: float, d1: float) -> float:
    """Cubic Hermite interpolation at the fraction t of a step h."""
    return (1 - t) ** 2 * ((1 + 2 * t) * y0 + t * h * d0) + t * t * ((3 - 2 * t) * y1 - (1 - t) * h * d1)


@njit(cache=True)
def extreme_velocity(y0: State, y1: State) -> tuple[float, float]:
    """After which step the Hermite cubic X' is stationary, and X' there, given that X'' changes its sign."""
    h = y1.tau - y0.tau
    mean = (y1.u - y0.u) / h
    # X'' = a0 + b t + c t^2 with t = step / h; of its two roots the one that passes from the sign of a0 to that of a1
    b, c = 6.0 * mean - 4.0 * y0.a - 2.0 * y1.a, 3.0 * (y0.a + y1.a) - 6.0 * mean
    t = 2.0 * y0.a / (-b + math.copysign(math.sqrt(max(b * b - 4.0 * y0.a * c, 0.0)), y0.a))
    return t * h, hermite(t, h, y0.u, y0.a, y1.u, y1.a)


@njit(cache=True)
def draw(y0: State, y1: State, interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray) -> None:
    """Dense output of one step at the multiples of interval in (tau0, tau1]; exact on stick lines."""
    h = y1.tau - y0.tau
    for k in range(int(y0.tau / interval), min(int(y1.tau / interval) + 2, x_drawn.size)):
        t = (k * interval - y0.tau) / h
        if 0.0 < t <= 1.0:
            x_drawn[k] = hermite(t, h, y0.x, y0.u, y1.x, y1.u)
            u_drawn[k] = hermite(t, h, y0.u, y0.a, y1.u, y1.a)
