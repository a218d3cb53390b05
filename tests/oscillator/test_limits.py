"""Equilibrium, limit cycle and the dampings at which they change."""

import math
from dataclasses import replace

import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator import limits as module
from roughslip.oscillator.fehlberg import acceleration
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.limits import equilibrium, existence_limit, hopf_damping, limit_cycle
from roughslip.oscillator.motion import simulate
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


def test_existence_limit_against_scipy():
    """At the limit the largest X' of the first loop is V itself: root in D of a shooting with DOP853."""

    def overshoot(damping):
        F, V = STUDY.F, STUDY.V

        def slip(tau, y):
            return [y[1], F * float(LAW.mu(316.0 * (V - y[1]))) - 2.0 * damping * y[1] - y[0]]

        def top(tau, y):
            return slip(tau, y)[1]

        top.terminal, top.direction = True, -1.0
        h = 1e-3  # off the belt: X' = V - V tau^2 / 2
        y = [0.4 * F - 2 * damping * V + V * h - V * h**3 / 6, V - V * h**2 / 2]
        run = solve_ivp(slip, (h, 12.0), y, method="DOP853", rtol=1e-11, atol=1e-15, events=top)
        return run.y[1, -1] / V - 1.0

    root = brentq(overshoot, 0.32, 0.33, xtol=1e-9)
    # the Taylor start leaves 1e-12 of F in X, 1e-11 in D; DOP853 some 1e-9 of V
    assert existence_limit(STUDY, LAW) == pytest.approx(root, abs=3e-8)


def test_cycle_on_either_side_of_the_existence_limit():
    """Both attract between Hopf and existence limit; beyond it no motion returns to stick."""
    limit = existence_limit(STUDY, LAW)
    below, above = (replace(STUDY, damping_ratio=limit + side * 1e-6) for side in (-1.0, 1.0))
    assert limit_cycle(below, LAW).period > 2.0 * math.pi
    with pytest.raises(IllPosedError, match="no stick-slip cycle"):
        limit_cycle(above, LAW)
    assert simulate(below, LAW, None, 0.0, 30.0).cycles > 20
    assert simulate(above, LAW, None, 0.0, 30.0).cycles == 0


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


def test_no_upper_bracket_is_an_error(monkeypatch):
    monkeypatch.setattr(module, "LARGEST_DAMPING", 0.4)  # the first bracket, 0.23, still has the cycle
    with pytest.raises(ConvergenceError, match="every damping ratio"):
        existence_limit(STUDY, LAW)


def test_refuses_excitation_and_bad_accuracy():
    driven = replace(STUDY, excitation_force_n=1.0, excitation_frequency_rad_per_s=100.0)
    for function in (equilibrium, hopf_damping, limit_cycle, existence_limit):
        with pytest.raises(ParameterError, match="free oscillator"):
            function(driven, LAW)
    for accuracy in (0.0, math.nan, 2.0):
        with pytest.raises(ParameterError, match="accuracy"):
            existence_limit(STUDY, LAW, accuracy)
