"""How far mass and belt velocity may move: against the return map, closed forms and the scaling of the equation."""

from dataclasses import replace

import numpy as np
import pytest

from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import existence_limit, hopf_damping
from roughslip.stages.result_tables.oscillator_ranges import LONGEST, PARAMETERS, cycle_period, range_variables

BELT = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(fit=0.3)
DAMPINGS = [0.05, 0.17, 0.4]
MASS, VELOCITY = range(2)
LOW, HIGH = range(2)
STANDS, CHANGES = range(2)


def ranges(belt=BELT, law=LAW, dampings=DAMPINGS):
    return {name: variable.values for name, variable in range_variables(belt, law, dampings).items()}


@pytest.fixture(scope="module")
def found():
    return ranges()


def test_the_cycle_at_the_paper_s_damping_exists_up_to_1_96_kg(found):
    """By the motion itself; the root of the return map there is the damping again, at either parameter."""
    assert list(found["parameter"]) == list(PARAMETERS)
    assert found["cycle_range"][MASS, HIGH, STANDS] == pytest.approx(1.96, abs=0.005)
    for row, parameter in enumerate(PARAMETERS):
        factor = found["cycle_range"][row, HIGH].mean()
        moved = replace(BELT, **{parameter: factor * getattr(BELT, parameter)})
        assert existence_limit(moved, LAW) == pytest.approx(BELT.damping_ratio, rel=1e-5)


def test_sliding_is_unstable_up_to_the_mass_of_the_hopf_point(found):
    """-mu_D' N / (2 m omega) falls as 1 / m."""
    assert found["unstable_range"][MASS, HIGH].mean() == pytest.approx(hopf_damping(BELT, LAW) / 0.17, rel=2e-6)


def test_the_list_has_both_sides_between_the_masses_of_its_ends(found):
    for damping, end in ((DAMPINGS[-1], LOW), (DAMPINGS[0], HIGH)):
        limit = existence_limit(replace(BELT, mass_kg=found["sides_range"][MASS, end].mean()), LAW)
        assert limit == pytest.approx(damping, rel=1e-5)


def test_at_both_numbers_of_an_end_the_cycle_is_told_apart(found):
    for row, parameter in enumerate(PARAMETERS):
        stands, changes = found["cycle_range"][row, HIGH] * getattr(BELT, parameter)
        assert cycle_period(replace(BELT, **{parameter: stands}), LAW) < LONGEST
        assert cycle_period(replace(BELT, **{parameter: changes}), LAW) == np.inf


def test_force_and_mass_in_proportion_are_one(found):
    """N / (m omega v0) is the only place where either stands."""
    twice = ranges(replace(BELT, mass_kg=3.0, normal_force_n=7500.0))
    for name in ("cycle_range", "unstable_range", "sides_range"):
        np.testing.assert_allclose(twice[name], found[name], rtol=4e-6)


def test_nothing_within_a_factor_of_ten_is_nan(found):
    """A lighter mass slides less steadily yet, and its cycle goes on."""
    for name in ("cycle_range", "unstable_range"):
        np.testing.assert_allclose(found[name][MASS, LOW], [0.1, np.nan], rtol=1e-12)


@pytest.mark.parametrize("change", [{"excitation_force_n": 10.0}, {"belt_velocity_m_per_s": 0.0}])
def test_an_oscillator_without_limits_of_its_own_has_no_ranges(change):
    driven = ranges(replace(BELT, excitation_frequency_rad_per_s=300.0, **change))
    for name in ("cycle_range", "unstable_range", "sides_range"):
        assert driven[name].shape == (2, 2, 2)
        assert np.isnan(driven[name]).all()


def test_sliding_under_coulomb_s_law_is_never_unstable():
    """mu_D' = 0, and the Hopf point lies at no damping; the cycle ends with the mass all the same."""
    belt, law = replace(BELT, damping_ratio=0.02), CoulombLaw(kinetic=0.3, static=0.4)
    found = ranges(belt, law)
    np.testing.assert_allclose(found["unstable_range"][MASS], [[0.1, np.nan], [10.0, np.nan]], rtol=1e-12)
    limit = existence_limit(replace(belt, mass_kg=found["cycle_range"][MASS, HIGH].mean()), law)
    assert limit == pytest.approx(0.02, rel=1e-5)


def test_a_cycle_that_is_too_long_to_be_counted_is_not_told():
    """On a belt a hundred times slower stick takes most of the time, and the closing periods may hold no cycle."""
    slow = replace(BELT, belt_velocity_m_per_s=0.948e-2)
    assert LONGEST < cycle_period(slow, LAW) < np.inf
    assert np.isnan(ranges(slow)["cycle_range"][VELOCITY]).all()
