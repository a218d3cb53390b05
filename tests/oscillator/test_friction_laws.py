"""Friction laws: formulas, compiled forms, refusals, and the recipe that adds a law."""

import math
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws import FRICTION_LAWS
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.laws import (
    LAWS,
    excess_force,
    friction,
    friction_curvature,
    friction_slope,
    law_from_scene,
    only_row,
    row_at,
    row_ends,
)
from roughslip.oscillator.limits import hopf_damping
from roughslip.oscillator.motion import simulate
from tests.oscillator.motions import STUDY


def test_published_law():
    """Eq. (13) with mu_fit = 0.3 at the belt speed of the study, term by term."""
    law = StribeckLaw(fit=0.3)
    assert float(law.mu(0.948)) == pytest.approx(0.3 / (1 + 1.42 * 0.948) + 0.1 + 0.01 * 0.948**2, rel=1e-15)
    assert float(law.mu(0.0)) == pytest.approx(0.4, rel=1e-15)


@pytest.fixture(params=sorted(LAWS))
def law(request):
    """An example of each registered law, with features at speeds of about 1 m/s."""
    return LAWS[request.param].example(np.random.default_rng(4), 0.4, 1.0)


def test_a_law_is_named_by_its_module():
    assert set(LAWS) == set(FRICTION_LAWS)


def test_compiled_and_plain_forms_agree(law):
    """The compiled formulas, the array functions of both signs, and the three leading parameters."""
    parameters = law.parameters()
    v = np.linspace(0.0, 3.0, 61)
    mu, slope = compiled_forms(v, parameters)
    assert mu == pytest.approx(law.mu(v), rel=1e-14)
    assert slope == pytest.approx(law.slope(v), rel=1e-13, abs=1e-15)
    assert np.array_equal(law.mu(-v), law.mu(v))
    assert np.array_equal(law.slope(-v), law.slope(v))
    assert parameters.static == law.static >= parameters.rest
    assert parameters.rest == pytest.approx(float(law.mu(0.0)), rel=1e-14)
    assert np.all(law.mu(v) >= parameters.least - 1e-15)


@numba.njit
def compiled_forms(speeds, parameters):
    mu, slope = np.empty(speeds.size), np.empty(speeds.size)
    for k in range(speeds.size):
        mu[k] = excess_force(2.0, speeds[k], 0.1, 0.2, parameters) / 2.0
        slope[k] = friction_slope(speeds[k], parameters)
    return mu, slope


def test_slope_and_curvature_are_derivatives(law):
    """Central differences within a row: h^2 / 6 of the third derivative, and rounding."""
    parameters, h = law.parameters(), 1e-4
    for speed in np.linspace(0.05, 2.5, 50):
        if row_at(speed - h, parameters) != row_at(speed + h, parameters):
            continue
        ahead, behind = speed + h, speed - h
        difference = (friction(ahead, parameters) - friction(behind, parameters)) / (2 * h)
        assert friction_slope(speed, parameters) == pytest.approx(difference, rel=1e-4, abs=1e-6)
        difference = (friction_slope(ahead, parameters) - friction_slope(behind, parameters)) / (2 * h)
        assert friction_curvature(speed, parameters) == pytest.approx(difference, rel=1e-4, abs=1e-5)


def test_rows_join_at_their_ends(law):
    """mu_D is continuous where one row ends and the next begins, and a row alone continues its own formula."""
    parameters, row = law.parameters(), 0
    while (end := row_ends(row, parameters)[1]) < math.inf:
        before, behind = only_row(row, parameters), only_row(row + 1, parameters)
        assert friction(end, before) == pytest.approx(friction(end, behind), rel=1e-13)
        row += 1
    assert row_at(1e9, parameters) == row


SPEEDS, VALUES = (0.0, 0.1, 0.4, 1.0, 2.0), (0.4, 0.33, 0.3, 0.28, 0.31)


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


def test_a_smooth_table_of_many_knots_has_few_rows():
    """A thousand speeds of Stribeck's formula cost 1.4 times the steps of the formula, as the formula changes by less
    than 1e-6 of its largest value; a measured curve that scatters keeps its knots."""
    speeds = np.linspace(0.0, 5.0, 1000)
    law = StribeckLaw(0.3)
    table = TableLaw(tuple(speeds), tuple(law.mu(speeds)))
    between = np.linspace(0.0, 5.0, 3777)
    np.testing.assert_allclose(table.mu(between), law.mu(between), rtol=0, atol=1.5e-6 * 0.4)
    one, other = simulate(STUDY, law), simulate(STUDY, table)
    assert other.steps < 1.5 * one.steps
    np.testing.assert_allclose(other.reattachments(), one.reattachments(), rtol=1e-5)
    rough = law.mu(speeds[:100]) + 1e-3 * np.random.default_rng(1).standard_normal(100)
    assert len(TableLaw(tuple(speeds[:100]), tuple(rough)).parameters().table) > 90


def test_a_steep_drop_of_a_table_is_resolved():
    """Friction falls from 0.4 to 0.2 within a width w: the motion differs from that of a jump in proportion to w.

    At 0.5 m/s rounding shifts X' by more than a share of 1e-10 of the width 1e-7, in which the branch changes there.
    """
    oscillator = Oscillator(1.0, 316.0, 0.02, 0.948, 2500.0)

    def last(width):
        law = TableLaw((0.0, 0.5, 0.5 + width, 1.0), (0.4, 0.4, 0.2, 0.2), interpolation="linear")
        motion = simulate(oscillator, law, duration_periods=6)
        assert motion.steps < 1000
        return motion.position[-1] / oscillator.F

    jump = last(1e-9)
    assert jump == pytest.approx(-0.0706593, abs=1e-6)
    for width in (1e-3, 1e-6, 1e-7, 1e-8):
        assert last(width) == pytest.approx(jump, abs=0.03 * width)


@pytest.mark.parametrize(
    ("speeds", "values", "advice"),
    [
        ((0.0, 0.5, 0.5 + 1e-11, 1.0), (0.4, 0.4, 0.2, 0.2), "space them further"),
        ((0.0, 1e-5, 1.0), (0.0, 0.4, 0.3), "start the table at 0 m/s with 0.4 and give static; scene keys"),
    ],
)
def test_knots_that_no_step_resolves_are_refused(speeds, values, advice):
    with pytest.raises(ParameterError, match=advice):
        TableLaw(speeds, values, 0.4, "linear")


def test_no_pole_beyond_the_belt():
    """Trial steps that pass the belt meet friction of at most rest + fit; eq. (13) has its pole at -1 / decay."""
    law = StribeckLaw(fit=0.3, decay_s_per_m=10.0, quadratic_s2_per_m2=0.0).parameters()
    for speed in np.linspace(-1.0, 0.0, 201):
        assert 0.4 <= friction(speed, law) <= 0.7 + 1e-15
        assert excess_force(2.0, speed, 0.1, 0.05, law) == pytest.approx(2.0 * (friction(speed, law) + 0.1) - 0.05)
    assert friction(-0.02, law) == pytest.approx(0.1 + 0.3 / 0.8, rel=1e-15)  # smooth near the belt


EXPONENTIAL = """from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from roughslip.oscillator.base_law import FrictionLaw


class ExponentialParameters(NamedTuple):
    static: float
    rest: float
    least: float
    decay: float


@dataclass(frozen=True)
class ExponentialLaw(FrictionLaw, parameters=ExponentialParameters):
    kinetic: float
    static: float
    decay_s_per_m: float

    @classmethod
    def from_scene(cls, section, mean):
        return cls(mean, section.static_friction, section.stribeck_decay_s_per_m)

    def parameters(self):
        return ExponentialParameters(self.static, self.static, self.kinetic, self.decay_s_per_m)

    @staticmethod
    def friction(speed, law):
        return law.least + (law.rest - law.least) * np.exp(-law.decay * speed)

    @staticmethod
    def slope_of_friction(speed, law):
        return -law.decay * (law.rest - law.least) * np.exp(-law.decay * speed)

    @staticmethod
    def curvature_of_friction(speed, law):
        return law.decay**2 * (law.rest - law.least) * np.exp(-law.decay * speed)


def falling(speed):
    return 0.3 + 0.1 * np.exp(-1.42 * speed)
"""


def section(law):
    return SimpleNamespace(law=law, static_friction=0.4, stribeck_decay_s_per_m=1.42)


@pytest.mark.parametrize("name", ["ExponentialLaw", "falling"])
def test_a_law_in_a_file_of_the_user(name, tmp_path):
    """As a class, or as a function of speed: D = -mu'(v0) N / (2 m omega), mu'(v0) = -decay (static - mean) exp."""
    (tmp_path / "mine.py").write_text(EXPONENTIAL)
    law = law_from_scene(section(f"{tmp_path}/mine.py:{name}"), 0.3)
    speeds = np.array([0.0, 0.2, 3.0])
    assert law.mu(speeds) == pytest.approx(0.3 + 0.1 * np.exp(-1.42 * speeds), rel=1e-14)
    assert law.static == 0.4
    slope = -1.42 * 0.1 * math.exp(-1.42 * 0.948)
    assert hopf_damping(STUDY, law) == pytest.approx(-0.5 * slope * 2500.0 / 316.0, rel=1e-9)


def test_a_file_without_a_law_is_refused(tmp_path):
    (tmp_path / "other.py").write_text("mu = 0.3\n")
    for file, line in (
        ("other.py:mu", "neither a function of speed nor a class"),
        ("absent.py:mu", "there is no file"),
    ):
        with pytest.raises(ParameterError, match=line):
            law_from_scene(section(f"{tmp_path}/{file}"), 0.3)
