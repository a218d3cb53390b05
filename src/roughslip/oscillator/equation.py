"""The equation of slip: the state, its acceleration and jerk for one sign of the sliding velocity."""

from __future__ import annotations

import math
from typing import NamedTuple

from roughslip.compilation import compiled
from roughslip.oscillator.law import CONTRACTED, excess_force, sliding, sliding_slope
from roughslip.oscillator.path import Piece, offset, offset_slope
from roughslip.oscillator.system import Coefficients


class State(NamedTuple):
    """tau [-], X, X', slipped distance s, X'' and X''' [m]."""

    tau: float
    x: float
    u: float
    s: float
    a: float
    j: float


@compiled()
def place(tau: float, s: float, p: Coefficients) -> float:
    """The coordinate of the friction path: slipped distance s [m], or travel of the belt [m] or time [s]."""
    return p.advance * tau if p.advance > 0.0 else s


@compiled(error_model="numpy", fastmath=CONTRACTED)
def acceleration(tau: float, x: float, u: float, sigma: float, mu_s: float, p: Coefficients) -> float:
    """X'' [m] in slip of sign sigma, continued smoothly through v_rel = 0 and friction = 0."""
    drive = p.q * math.cos(p.r * tau) if p.q > 0.0 else 0.0
    return excess_force(sigma * p.F, sigma * p.omega * (p.V - u), mu_s, 2.0 * p.D * u + x - drive, p.law)


@compiled(error_model="numpy", fastmath=CONTRACTED)
def jerk(tau: float, u: float, s: float, a: float, sigma: float, piece: Piece, p: Coefficients) -> float:
    """X''' [m] in slip of sign sigma, continued likewise."""
    speed, along = sigma * p.omega * (p.V - u), p.advance if p.advance > 0.0 else sigma * (p.V - u)
    mu_rate = offset_slope(piece, place(tau, s, p)) * along - sliding_slope(speed, p.law) * sigma * p.omega * a
    drive = p.q * p.r * math.sin(p.r * tau) if p.q > 0.0 else 0.0
    return sigma * p.F * mu_rate - 2.0 * p.D * a - u - drive


@compiled()
def completed(tau: float, x: float, u: float, s: float, sigma: float, piece: Piece, p: Coefficients) -> State:
    """The state in slip with its acceleration and jerk."""
    a = acceleration(tau, x, u, sigma, offset(piece, place(tau, s, p)), p)
    return State(tau, x, u, s, a, jerk(tau, u, s, a, sigma, piece, p))


@compiled(error_model="numpy")
def friction(y: State, sigma: float, piece: Piece, p: Coefficients) -> float:
    """mu_D + mu_S in slip, below zero where it is cut."""
    return sliding(sigma * p.omega * (p.V - y.u), p.law) + offset(piece, place(y.tau, y.s, p))


@compiled()
def cut(y: State, sigma: float, piece: Piece, p: Coefficients) -> bool:
    """Whether friction in slip would be negative, and is cut to zero."""
    return p.law.least + offset(piece, place(y.tau, y.s, p)) < 0.0 and friction(y, sigma, piece, p) < 0.0
