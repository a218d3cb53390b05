"""Friction laws: eq. (13), Coulomb's, a table."""

import math

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from roughslip.errors import ParameterError
from roughslip.oscillator.law import CoulombLaw, StribeckLaw, TableLaw, sliding, sliding_slope
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.system import Oscillator


def test_published_law():
    """Eq. (13) with mu_fit = 0.3 at the belt speed of the study, term by term."""
    law = StribeckLaw(fit=0.3)
    assert float(law.mu(0.948)) == pytest.approx(0.3 / (1 + 1.42 * 0.948) + 0.1 + 0.01 * 0.948**2, rel=1e-15)
    assert float(law.mu(0.0)) == pytest.approx(0.4, rel=1e-15)


def test_even_in_velocity():
    law = StribeckLaw(fit=0.25)
    velocity = np.linspace(0.0, 3.0, 31)
    assert np.array_equal(law.mu(velocity), law.mu(-velocity))
    assert np.array_equal(law.slope(velocity), law.slope(-velocity))


def test_slope_is_the_derivative():
    """Complex step: no subtraction, so the derivative is exact to rounding."""
    law = StribeckLaw(fit=0.3, static=0.45, decay_s_per_m=2.0, quadratic_s2_per_m2=0.03)
    for speed in (0.0, 0.2, 0.948, 2.5):
        z = speed + 1e-30j
        exact = (law.fit / (1 + 2.0 * z) + 0.15 + 0.03 * z * z).imag / 1e-30
        assert float(law.slope(speed)) == pytest.approx(exact, rel=1e-13)


@pytest.mark.parametrize("name", ["fit", "static", "decay_s_per_m", "quadratic_s2_per_m2"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_refuses(name, value):
    with pytest.raises(ParameterError, match=name):
        StribeckLaw(**({"fit": 0.3} | {name: value}))


SPEEDS, VALUES = (0.0, 0.1, 0.4, 1.0, 2.0), (0.4, 0.33, 0.3, 0.28, 0.31)


def test_coulomb_slides_at_one_value():
    law = CoulombLaw(0.3, 0.4)
    assert np.array_equal(law.mu(np.array([0.0, -1.0, 5.0])), np.full(3, 0.3))
    assert np.array_equal(law.slope(np.array([0.0, -1.0, 5.0])), np.zeros(3))


def test_table_is_scipy_s_monotone_cubic():
    """And a constant beyond its last speed."""
    law = TableLaw(SPEEDS, VALUES)
    peer = PchipInterpolator(SPEEDS, VALUES)
    v = np.linspace(0.0, 2.0, 401)
    assert law.mu(-v) == pytest.approx(peer(v), abs=1e-15)
    inside = v[v < 2.0]
    assert law.slope(inside) == pytest.approx(peer(inside, 1), abs=1e-14)
    assert law.mu(np.array([2.0, 7.0])) == pytest.approx([0.31, 0.31], rel=1e-15)
    assert law.slope(7.0) == 0.0
    assert np.all(np.diff(law.mu(v[v <= 1.0])) < 0.0)  # no extreme of its own
    assert law.static == 0.4


def test_linear_table_is_its_chords():
    law = TableLaw(SPEEDS, VALUES, static=0.5, interpolation="linear")
    v = np.linspace(0.0, 3.0, 301)
    assert law.mu(v) == pytest.approx(np.interp(v, SPEEDS, VALUES), abs=1e-15)
    assert law.slope(0.2) == pytest.approx(-0.1, rel=1e-13)
    assert law.static == 0.5


@pytest.mark.parametrize("law", [StribeckLaw(0.3), CoulombLaw(0.3, 0.4), TableLaw(SPEEDS, VALUES)])
def test_compiled_law_is_the_law(law):
    """And is nowhere below what it says to be least."""
    compiled = law.compiled()
    v = np.linspace(0.0, 3.0, 61)
    assert [sliding(speed, compiled) for speed in v] == pytest.approx(law.mu(v), rel=1e-15)
    assert [sliding_slope(speed, compiled) for speed in v] == pytest.approx(law.slope(v), rel=1e-15)
    assert compiled.static == law.static
    assert compiled.rest == pytest.approx(float(law.mu(0.0)), rel=1e-15)
    assert np.all(law.mu(v) >= compiled.least)


def test_a_fine_table_of_eq_13_moves_like_eq_13():
    """Cubics over 0.01 m/s err by some 1e-9 of mu, and the motion by as much times the growth over two cycles."""
    oscillator = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
    law = StribeckLaw(0.3)
    speeds = np.arange(0.0, 3.0, 0.01)
    table = TableLaw(tuple(speeds), tuple(law.mu(speeds)))
    closed, found = (simulate(oscillator, one, None, 0.0, 4.0, 1e-10) for one in (law, table))
    assert np.array_equal(found.kind, closed.kind)
    assert found.position == pytest.approx(closed.position, abs=1e-6 * oscillator.F)


def test_a_kinked_table_costs_steps_and_no_accuracy():
    """Steps end nowhere in particular, so the error control finds the kinks of straight lines: error ~ tolerance."""
    oscillator = Oscillator(1.0, 316.0, 0.0, 0.948, 2500.0)
    law = TableLaw(SPEEDS, VALUES, interpolation="linear")
    exact = simulate(oscillator, law, None, 0.0, 2.0, 1e-13).position[1]
    for tolerance in (1e-6, 1e-8, 1e-10):
        motion = simulate(oscillator, law, None, 0.0, 2.0, tolerance)
        assert abs(motion.position[1] - exact) < 10.0 * tolerance * oscillator.F


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: CoulombLaw(0.4, 0.3), "at least kinetic"),
        (lambda: CoulombLaw(-0.1, 0.3), "kinetic"),
        (lambda: CoulombLaw(0.3, math.inf), "static"),
        (lambda: TableLaw((0.0,), (0.4,)), "at least two"),
        (lambda: TableLaw((0.0, 1.0), (0.4,)), "one for each"),
        (lambda: TableLaw((0.0, math.nan), (0.4, 0.3)), "finite"),
        (lambda: TableLaw((0.1, 1.0), (0.4, 0.3)), "from 0"),
        (lambda: TableLaw((0.0, 1.0, 1.0), (0.4, 0.3, 0.2)), "strictly"),
        (lambda: TableLaw((0.0, 1.0), (0.4, -0.1)), "negative"),
        (lambda: TableLaw((0.0, 1.0), (0.4, 0.3), static=0.3), "first value"),
        (lambda: TableLaw((0.0, 1.0), (0.4, 0.3), interpolation="cubic"), "monotone_cubic"),
    ],
)
def test_other_laws_refuse(call, message):
    with pytest.raises(ParameterError, match=message):
        call()
