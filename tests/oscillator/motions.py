"""What tests of motions share: the oscillator of the study, Coulomb friction of a given drop, steps of equal length."""

import numpy as np

from roughslip.oscillator.equation import Oscillator, path_coordinate, slip_state
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.path import piece_at
from roughslip.oscillator.runge_kutta import step

STUDY = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(0.3)
F, V = STUDY.F, STUDY.V


def ends(motion):
    """Time, position and slipped distance of every reattachment."""
    keep = motion.kind == REATTACHMENT
    return np.column_stack((motion.time[keep], motion.position[keep], motion.slipped_distance[keep]))


def coulomb(ratio: float, kinetic: float = 0.3) -> CoulombLaw:
    """Friction that drops by r = F (static - kinetic) / V on leaving stick."""
    return CoulombLaw(kinetic, kinetic + ratio * V / F)


def equal_steps(pair, p, path, x, u, duration, steps, sigma=1.0):
    """The state after so many equal steps of slip from tau = 0, each on the piece of the path at its middle."""
    h = duration / steps
    y = slip_state(0.0, x, u, 0.0, sigma, piece_at(path, 0.0), p)
    for _ in range(steps):
        ahead = path_coordinate(y.tau + 0.5 * h, y.s + 0.5 * h * sigma * (p.V - y.u), p)
        piece = piece_at(path, ahead)
        y = slip_state(y.tau, y.x, y.u, y.s, sigma, piece, p)
        y, _ = step(pair, y, h, sigma, piece, p)
    return y
