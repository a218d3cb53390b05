"""The deterministic motion: return map, equilibrium, limit cycle, limits in damping, counts by the period."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator import return_map as module
from roughslip.oscillator.equation import State, acceleration, coefficients
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.limits import counts_by_period, equilibrium, existence_limit, hopf_damping, limit_cycle
from roughslip.oscillator.motion import MotionOptions, ensemble_counts, simulate
from roughslip.oscillator.path import Piece
from roughslip.oscillator.return_map import falling_root, slip_flow, turn, turn_from
from roughslip.oscillator.switching_events import branch_at
from tests.oscillator.motions import LAW, STUDY

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


def test_equilibrium_and_hopf_from_the_right_hand_side():
    """X'' vanishes at the equilibrium, and its derivative by X' there changes sign at the Hopf damping."""
    oscillator = replace(STUDY, damping_ratio=hopf_damping(STUDY, LAW))
    p = coefficients(oscillator, LAW)
    x = equilibrium(oscillator, LAW)
    assert acceleration(0.0, x, 0.0, 1.0, 0.0, p) == pytest.approx(0.0, abs=1e-15 * p.F)
    h = 1e-4 * p.V  # central difference: error h^2 mu''' ~ 1e-8
    slope = (acceleration(0.0, x, h, 1.0, 0.0, p) - acceleration(0.0, x, -h, 1.0, 0.0, p)) / (2 * h)
    assert slope == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("jump", [0.5, 5.0])
def test_coulomb_s_limit_in_closed_form(jump):
    """Linear slip from y = jump - 2 D, w = 1 has its next peak at w = 1.

    It is w = e^(-D t) (cos b t - c sin b t). Here b^2 = 1 - D^2 and c = (D + y) / b. Its rate vanishes where
    tan b t = -(D + c b) / (c D - b).
    """

    def next_peak(d):
        b = math.sqrt(1 - d * d)
        c = (d + jump - 2 * d) / b
        angle = math.atan2(d + c * b, -(b - c * d))
        times = [(angle + k * math.pi) / b for k in range(1, 5)]
        rise = [t for t in times if math.cos(b * t) - c * math.sin(b * t) > 0]
        return math.exp(-d * rise[0]) * (math.cos(b * rise[0]) - c * math.sin(b * rise[0]))

    root = brentq(lambda d: next_peak(d) - 1, 1e-3, 0.9, xtol=1e-14)
    law = CoulombLaw(0.3, 0.3 + jump * STUDY.V / STUDY.F)
    assert existence_limit(STUDY, law) == pytest.approx(root, abs=2e-10)


def test_existence_limit_does_not_depend_on_its_tolerance():
    """Two hundred steps a turn at 1e-9 each, of which the peak and so the damping take some 1e-8 at most."""
    fine = existence_limit(STUDY, LAW)
    assert existence_limit(STUDY, LAW, tolerance=1e-9) == pytest.approx(fine, abs=2e-8)
    assert existence_limit(replace(STUDY, damping_ratio=0.9), LAW) == fine


def test_cycle_on_either_side_of_the_existence_limit():
    """Both attract between Hopf and existence limit; beyond it no motion returns to stick. The motion has an integrator
    of its own, so that 1e-8 on either side is its word on the limit."""
    limit = existence_limit(STUDY, LAW)
    below, above = (replace(STUDY, damping_ratio=limit + side * 1e-8) for side in (-1.0, 1.0))
    assert limit_cycle(below, LAW).period > 2.0 * math.pi
    with pytest.raises(IllPosedError, match="no stick-slip cycle"):
        limit_cycle(above, LAW)
    assert simulate(below, LAW, None, 0.0, 30.0, MotionOptions(1e-11)).cycles > 20
    assert simulate(above, LAW, None, 0.0, 30.0, MotionOptions(1e-11)).cycles == 0


def test_cycle_of_the_study():
    """Values of an independent trial with DOP853 at 1e-13, to their last digit."""
    cycle = limit_cycle(STUDY, LAW)
    assert cycle.period == pytest.approx(6.868535, abs=5e-7)
    assert cycle.reattachment == pytest.approx(0.003280209, abs=5e-10)
    assert cycle.departure == pytest.approx(0.008994421, abs=5e-10)
    assert existence_limit(STUDY, LAW) == pytest.approx(0.3244, abs=5e-5)


def test_limit_cycle_closes():
    """What the second return of a run from rest on the belt gives; stick joins the ends."""
    cycle = limit_cycle(STUDY, LAW)
    motion = simulate(STUDY, LAW, None, 0.0, 5.0, MotionOptions(1e-11))
    assert motion.position[1] == pytest.approx(cycle.reattachment, abs=1e-10 * STUDY.F)
    assert motion.time[3] - motion.time[1] == pytest.approx(cycle.period, abs=1e-9)
    assert cycle.departure == pytest.approx(0.4 * STUDY.F - 2 * 0.17 * STUDY.V, rel=1e-14)
    slipped = STUDY.V * cycle.slip_duration - (cycle.reattachment - cycle.departure)
    assert cycle.slipped_distance == pytest.approx(slipped, rel=1e-12)


def test_published_damping_needs_a_light_mass():
    """D = 0.17 lies just above the limit at 1.96 kg: N / (m omega) scales the negative slope."""
    assert (
        existence_limit(replace(STUDY, mass_kg=1.95), LAW) > 0.17 > existence_limit(replace(STUDY, mass_kg=1.96), LAW)
    )


def test_no_cycle_without_falling_friction():
    with pytest.raises(IllPosedError, match="fall with sliding speed"):
        existence_limit(STUDY, StribeckLaw(fit=0.0, quadratic_s2_per_m2=0.1))


def test_refuses_excitation_and_bad_accuracy():
    driven = replace(STUDY, excitation_force_n=1.0, excitation_frequency_rad_per_s=100.0)
    for function in (equilibrium, limit_cycle, existence_limit):
        with pytest.raises(ParameterError, match="free oscillator"):
            function(driven, LAW)
    for accuracy in (0.0, math.nan, 2.0):
        with pytest.raises(ParameterError, match="accuracy"):
            existence_limit(STUDY, LAW, accuracy)


DAMPINGS = [0.0, 0.05, 0.17, 0.23, 0.3, 0.324, 0.325, 0.34, 0.6, 0.99, 1.5]


@pytest.mark.parametrize("law", [LAW, CoulombLaw(0.3, 0.4)])
@pytest.mark.parametrize("periods", [0.3, 1.7, 40.3, 97.0])
def test_counts_are_those_of_the_whole_motion(law, periods):
    """On both sides of the end of the cycle, for runs that end in stick, in slip and before the first slip."""
    whole = ensemble_counts(STUDY, law, None, 0.0, periods, DAMPINGS)
    found = counts_by_period(STUDY, law, periods, DAMPINGS)
    assert np.array_equal(found.cycles, whole.cycles)
    assert np.array_equal(found.micro_slips, whole.micro_slips)
    assert found.last_cycle == pytest.approx(whole.last_cycle, abs=1e-7)
    if periods > 40.0:
        assert found.steps < 0.3 * whole.steps


def test_excitation_is_refused():
    driven = replace(STUDY, excitation_force_n=10.0, excitation_frequency_rad_per_s=300.0)
    with pytest.raises(ParameterError, match="excitation"):
        counts_by_period(driven, LAW, 10.0, [0.1])
