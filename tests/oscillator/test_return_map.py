"""The return map of slip: linear slip in closed form, its monotony, and the ends of its reach."""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator import return_map as module
from roughslip.oscillator.equation import State, acceleration
from roughslip.oscillator.law import CoulombLaw, StribeckLaw, TableLaw
from roughslip.oscillator.path import Piece
from roughslip.oscillator.return_map import falling_root, growth, slip_flow, turn, turn_from
from roughslip.oscillator.switching_events import branch_at
from roughslip.oscillator.system import Oscillator, coefficients

STUDY = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(0.3)
TABLE = TableLaw((0.0, 0.4, 1.0, 2.0, 4.0), (0.4, 0.3, 0.24, 0.25, 0.27))
ACCURACY = 1e-10  # some 60 steps of 1e-12, and dense output of one order less


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.4, 0.9])
@pytest.mark.parametrize("peak", [1e-3, 1.0])
def test_constant_friction_is_a_damped_oscillation(damping, peak):
    """X' falls by exp(-2 pi D / sqrt(1 - D^2)) a turn, in the damped period."""
    around = turn(slip_flow(replace(STUDY, damping_ratio=damping), CoulombLaw(0.3, 0.3)), peak)
    root = math.sqrt(1 - damping**2)
    assert around.peak == pytest.approx(peak * math.exp(-2 * math.pi * damping / root), rel=ACCURACY)
    assert around.duration == pytest.approx(2 * math.pi / root, rel=1e-9)  # roots of w' lose a digit to its own error


@pytest.mark.parametrize("damping", [1.0, 1.7])
def test_an_overdamped_mass_comes_to_rest(damping):
    assert turn(slip_flow(replace(STUDY, damping_ratio=damping), CoulombLaw(0.3, 0.3)), 0.5).peak == 0.0


@pytest.mark.parametrize("law", [LAW, CoulombLaw(0.3, 0.4), TABLE])
def test_the_flow_is_the_motion_s_right_hand_side(law):
    """X'' of the compiled motion, in units of V, on a grid of states; rounding of X / V, some 4, alone."""
    p, flow = coefficients(STUDY, law), slip_flow(STUDY, law)
    for w in (-3.0, -0.5, 0.0, 0.7, 1.0):
        for y in (-2.0, 0.3, 1.5):
            expected = acceleration(0.0, flow.position(y), w * p.V, 1.0, 0.0, p) / p.V
            assert flow.at_peak(w) - y == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("law", [LAW, TABLE])
def test_slope_is_the_derivative_of_the_force(law):
    flow, h = slip_flow(STUDY, law), 1e-5
    for w in (-2.0, 0.0, 0.6):
        assert flow.slope(w) == pytest.approx((flow.force(w + h) - flow.force(w - h)) / (2 * h), rel=1e-7)


def test_negative_friction_is_cut_as_in_the_motion():
    law = StribeckLaw(fit=0.6, static=0.4)  # below zero from 1.4 m/s on
    p, flow = coefficients(STUDY, law), slip_flow(STUDY, law)
    for w in (-2.0, 0.5):
        y = State(0.0, flow.position(0.1), w * p.V, 0.0, 0.0, 0.0)
        here = branch_at(y, 1.0, Piece(0.0, 0.0, 0.0, 0.0, 0.0, math.inf, 1.0), p)
        assert here.cut == (w < 0.0)
        expected = acceleration(0.0, y.x, y.u, 1.0, 0.0, here.p) / p.V
        assert flow.at_peak(w) - 0.1 == pytest.approx(expected, abs=1e-13)
    assert flow.slope(-2.0) == 0.0


def test_growth_is_the_derivative_of_the_map():
    """On a cycle, where a turn maps the curve of peaks on itself at one point, exp(growth) is the slope there."""
    flow = slip_flow(replace(STUDY, damping_ratio=0.3), LAW)
    low, high = 0.3, 0.99
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if turn(flow, middle).peak < middle else (low, middle)
    h = 1e-3
    after = [turn(flow, low + k * h).peak for k in (-2, -1, 1, 2)]
    slope = (after[0] - 8 * after[1] + 8 * after[2] - after[3]) / (12 * h)
    found = growth(flow, low, turn(flow, low).duration)
    assert math.exp(found) == pytest.approx(slope, rel=1e-6)  # h^4 of the fifth derivative, and 1e-11 / h


def test_the_next_peak_falls_with_damping():
    """A rotated family; at every peak, on any grid."""
    for peak in (0.05, 0.6, 1.0):
        following = [turn(slip_flow(replace(STUDY, damping_ratio=d), LAW), peak).peak for d in np.linspace(0, 0.8, 9)]
        assert np.all(np.diff(following) < 0)


def test_falling_root_is_found_from_any_start():
    for start in (-1.0, 0.0, 0.7, 5.0):
        assert falling_root(lambda ratio: 0.7 - ratio, start, 1e-12) == pytest.approx(0.7, abs=1e-12)
    assert falling_root(lambda ratio: -ratio, 0.1, 1e-12) is None


def test_a_cycle_at_any_damping_is_an_error(monkeypatch):
    monkeypatch.setattr(module, "LARGEST_DAMPING", 0.4)
    with pytest.raises(ConvergenceError, match="every damping ratio"):
        falling_root(lambda ratio: 1.0, 0.1, 1e-12)


def test_stiff_slip_ends_with_a_message(monkeypatch):
    monkeypatch.setattr(module, "MOST_EVALUATIONS", 3000)
    with pytest.raises(ConvergenceError, match="too stiff"):
        turn(slip_flow(replace(STUDY, damping_ratio=1e3), LAW), 0.5)


def test_a_turn_begins_at_a_peak_or_beyond_it():
    flow = slip_flow(STUDY, LAW)
    for y, w in ((math.nan, 0.5), (0.0, 0.0), (flow.at_peak(0.5) - 0.1, 0.5)):
        with pytest.raises(ParameterError, match="turn of slip"):
            turn_from(flow, y, w)
