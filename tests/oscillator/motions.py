"""What tests of motions share: the oscillator of the study, a machine, Coulomb friction of some drop, equal steps."""

from __future__ import annotations

import numpy as np

from roughslip.friction.paths import Friction
from roughslip.oscillator.equation import Oscillator, slip_state
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.laws import StribeckLaw
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.path import piece_at
from roughslip.oscillator.runge_kutta import step

STUDY = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(0.3)
NEARLY_GAUSSIAN = (200.0, 200.0)
F, V = STUDY.F, STUDY.V


def machine(deviation=0.03, length=3e-4, belt=STUDY, law=LAW, shapes=NEARLY_GAUSSIAN, **changes):
    """A machine whose friction scatters so. changes : of its parameters"""
    return Machine(belt, law, Friction(0.3, deviation, length, shapes)).changed(changes)


def ends(motion):
    """Time, position and slipped distance of every reattachment."""
    keep = motion.kind == REATTACHMENT
    return np.column_stack((motion.time[keep], motion.position[keep], motion.slipped_distance[keep]))


def equal_steps(p, path, x, u, duration, steps, sigma=1.0):
    """The state after so many equal steps of slip from tau = 0, each on the piece of the path at its middle."""
    h = duration / steps
    y = slip_state(0.0, x, u, 0.0, sigma, piece_at(path, 0.0), p)
    for _ in range(steps):
        piece = piece_at(path, y.s + 0.5 * h * sigma * (p.V - y.u))
        y = slip_state(y.tau, y.x, y.u, y.s, sigma, piece, p)
        y, _ = step(y, h, sigma, piece, p)
    return y
