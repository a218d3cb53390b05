"""The embedded Runge-Kutta pairs that slip may be integrated with.

A step and what is asked after each are written into their callers (`forceinline`): handing over the thirty numbers of
state, path and coefficients takes a quarter of the time of a motion.
"""

from __future__ import annotations

from roughslip.compilation import compiled
from roughslip.oscillator import dormand_prince, fehlberg
from roughslip.oscillator.dormand_prince import dormand_prince_step
from roughslip.oscillator.equation import State
from roughslip.oscillator.fehlberg import fehlberg_step
from roughslip.oscillator.path import Piece
from roughslip.oscillator.system import Coefficients

FEHLBERG45, DORMAND_PRINCE853 = 0, 1
PAIRS = {"fehlberg45": FEHLBERG45, "dormand_prince853": DORMAND_PRINCE853}
STAGES = (fehlberg.STAGES, dormand_prince.STAGES)  # evaluations of X'' in a step
ORDERS = (fehlberg.ORDER, dormand_prince.ORDER)  # by which power of the step its error estimate goes


@compiled(forceinline=True)
def step(pair: int, y: State, h: float, sigma: float, piece: Piece, p: Coefficients) -> tuple[State, float]:
    """The state after a step h, with its acceleration and jerk, and the estimated error [m]."""
    if pair == FEHLBERG45:
        return fehlberg_step(y, h, sigma, piece, p)
    return dormand_prince_step(y, h, sigma, piece, p)
