"""Equilibrium, limit cycle and the dampings at which they change."""

import math
from dataclasses import replace

import pytest
from scipy.optimize import brentq

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator.fehlberg import acceleration
from roughslip.oscillator.law import CoulombLaw, StribeckLaw
from roughslip.oscillator.limits import equilibrium, existence_limit, limit_cycle
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.pure_slip import hopf_damping
from roughslip.oscillator.system import Oscillator, coefficients

STUDY = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(0.3)


def test_values_of_the_study():
    """m = 1 kg, omega = 316/s, v0 = 0.948 m/s, N = 2.5 kN, fit = 0.3: the four digits known from an earlier trial."""
    assert hopf_damping(STUDY, LAW) == pytest.approx(0.2311, abs=5e-5)
    assert existence_limit(STUDY, LAW) == pytest.approx(0.3244, abs=5e-5)


def test_equilibrium_and_hopf_from_the_right_hand_side():
    """X'' vanishes at the equilibrium, and its derivative by X' there changes sign at the Hopf damping."""
    oscillator = replace(STUDY, damping_ratio=hopf_damping(STUDY, LAW))
    p = coefficients(oscillator, LAW)
    x = equilibrium(oscillator, LAW)
    assert acceleration(0.0, x, 0.0, 1.0, 0.0, p) == pytest.approx(0.0, abs=1e-15 * p.F)
    h = 1e-4 * p.V  # central difference: error h^2 mu''' ~ 1e-8
    slope = (acceleration(0.0, x, h, 1.0, 0.0, p) - acceleration(0.0, x, -h, 1.0, 0.0, p)) / (2 * h)
    assert slope == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize(("jump", "limit"), [(0.5, 0.017938), (1.0, 0.057829), (2.0, 0.145359), (5.0, 0.322719)])
def test_coulomb_s_cycle_dies_at_the_published_damping(jump, limit):
    """Jump of the friction deflection over V: departure at y = jump, then linear slip about F kinetic."""
    law = CoulombLaw(0.3, 0.3 + jump * STUDY.V / STUDY.F)
    assert existence_limit(STUDY, law) == pytest.approx(limit, abs=5e-7)


@pytest.mark.parametrize("jump", [0.5, 5.0])
def test_coulomb_s_limit_in_closed_form(jump):
    """Linear slip from y = jump - 2 D, w = 1 peaks at w = 1: w = e^(-D t) (cos b t - c sin b t) with b^2 = 1 - D^2 and
    c = (D + y) / b, whose rate vanishes where tan b t = -(D + c b) / (c D - b) on the way up."""

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


def test_existence_limit_does_not_hang_on_its_tolerance():
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
    assert simulate(below, LAW, None, 0.0, 30.0, 1e-11).cycles > 20
    assert simulate(above, LAW, None, 0.0, 30.0, 1e-11).cycles == 0


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
    motion = simulate(STUDY, LAW, None, 0.0, 5.0, tolerance=1e-11)
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
