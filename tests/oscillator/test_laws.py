"""Friction laws: formulas, compiled forms, tables, laws of a function and of a file of the user, refusals."""

import math
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import CoulombLaw, StribeckLaw, friction, friction_slope, only_row, row_at, row_ends
from roughslip.oscillator.limits import existence_limit, hopf_damping
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.table_law import TableLaw, friction_law, law_from_scene
from tests.oscillator.motions import LAW, STUDY


def test_published_law():
    """Eq. (13) with mu_fit = 0.3 at the belt speed of the study, term by term."""
    assert float(LAW.mu(0.948)) == pytest.approx(0.3 / (1 + 1.42 * 0.948) + 0.1 + 0.01 * 0.948**2, rel=1e-15)
    assert float(LAW.mu(0.0)) == pytest.approx(0.4, rel=1e-15)


SPEEDS, VALUES = (0.0, 0.1, 0.4, 1.0, 2.0), (0.4, 0.33, 0.3, 0.28, 0.31)
EXAMPLES = {
    "coulomb": CoulombLaw(0.3, 0.4),
    "stribeck": StribeckLaw(0.25, 0.4, 3.0, 0.05),
    "table": TableLaw(SPEEDS, VALUES, 0.42),
}


@pytest.fixture(params=sorted(EXAMPLES))
def law(request):
    """An example of each registered law, with features at speeds of about 1 m/s."""
    return EXAMPLES[request.param]


def test_compiled_and_plain_forms_agree(law):
    """The compiled formulas, the array functions of both signs, and the two leading parameters."""
    parameters = law.parameters()
    v = np.linspace(0.0, 3.0, 61)
    compiled = numba.njit(lambda speeds, p: [(friction(speed, p), friction_slope(speed, p)) for speed in speeds])
    forms = np.array(compiled(v, parameters)).T
    np.testing.assert_allclose(forms, [law.mu(v), law.slope(v)], rtol=1e-13, atol=1e-15)
    assert np.array_equal(law.mu(-v), law.mu(v))
    assert np.array_equal(law.slope(-v), law.slope(v))
    assert parameters.static == law.static >= parameters.rest
    assert parameters.rest == pytest.approx(float(law.mu(0.0)), rel=1e-14)


def test_slope_is_the_derivative(law):
    """Central differences within a row: h^2 / 6 of the third derivative, and rounding. Rows join without a jump, and a
    row alone continues its own formula."""
    parameters, h, row = law.parameters(), 1e-4, 0
    for speed in np.linspace(0.05, 2.5, 50):
        ahead, behind = speed + h, speed - h
        if row_at(behind, parameters) != row_at(ahead, parameters):
            continue
        difference = (friction(ahead, parameters) - friction(behind, parameters)) / (2 * h)
        assert friction_slope(speed, parameters) == pytest.approx(difference, rel=1e-4, abs=1e-6)
    while (end := row_ends(row, parameters)[1]) < math.inf:
        before, behind = only_row(row, parameters), only_row(row + 1, parameters)
        assert friction(end, before) == pytest.approx(friction(end, behind), rel=1e-13)
        row += 1
    assert row_at(1e9, parameters) == row


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
    assert law.static == 0.4


def test_straight_lines_near_a_knot_bound_the_slope_there():
    """At a knot the cubic has a weighted harmonic mean of both slopes, one between them; far off there is one line."""
    law = TableLaw(SPEEDS, VALUES)
    assert law.slopes_by_lines(0.4) == pytest.approx((-0.1, -0.02 / 0.6))
    assert -0.1 < float(law.slope(0.4)) < -0.02 / 0.6
    assert law.slopes_by_lines(0.37) == law.slopes_by_lines(0.43) == law.slopes_by_lines(0.4)
    assert law.slopes_by_lines(0.7) == pytest.approx((-0.02 / 0.6,))
    assert (law.slopes_by_lines(9.0), LAW.slopes_by_lines(0.4)) == ((0.0,), ())


def test_a_smooth_table_of_many_knots_has_few_rows():
    """A thousand speeds of Stribeck's formula cost 1.4 times the steps of the formula, as the formula changes by less
    than 1e-6 of its largest value; a measured curve that scatters keeps its knots."""
    speeds = np.linspace(0.0, 5.0, 1000)
    table = TableLaw(tuple(speeds), tuple(LAW.mu(speeds)))
    between = np.linspace(0.0, 5.0, 3777)
    np.testing.assert_allclose(table.mu(between), LAW.mu(between), rtol=0, atol=1.5e-6 * 0.4)
    one, other = simulate(STUDY, LAW), simulate(STUDY, table)
    assert other.steps < 1.5 * one.steps
    np.testing.assert_allclose(other.reattachments(), one.reattachments(), rtol=1e-5)
    rough = LAW.mu(speeds[:100]) + 1e-3 * np.random.default_rng(1).standard_normal(100)
    assert len(TableLaw(tuple(speeds[:100]), tuple(rough)).parameters().table) > 90


def test_a_steep_drop_of_a_table_is_resolved():
    """Friction falls from 0.4 to 0.2 within a width w: the motion differs from that of a jump in proportion to w.

    At 0.5 m/s rounding shifts X' by more than a share of 1e-10 of the width 1e-7, in which the branch changes there.
    """
    oscillator = Oscillator(1.0, 316.0, 0.02, 0.948, 2500.0)

    def last(width):
        law = TableLaw((0.0, 0.5, 0.5 + width, 1.0), (0.4, 0.4, 0.2, 0.2))
        motion = simulate(oscillator, law, duration_periods=6)
        assert motion.steps < 1500
        return motion.position[-1] / oscillator.F

    jump = last(1e-9)
    for width in (1e-3, 1e-6, 1e-7, 1e-8):
        assert last(width) == pytest.approx(jump, abs=0.03 * width)


def test_no_pole_beyond_the_belt():
    """Trial steps that pass the belt meet friction of at most rest + fit; eq. (13) has its pole at -1 / decay."""
    law = StribeckLaw(fit=0.3, decay_s_per_m=10.0, quadratic_s2_per_m2=0.0).parameters()
    for speed in np.linspace(-1.0, 0.0, 201):
        assert 0.4 <= friction(speed, law) <= 0.7 + 1e-15
    assert friction(-0.02, law) == pytest.approx(0.1 + 0.3 / 0.8, rel=1e-15)  # smooth near the belt


def test_a_law_of_a_function_is_that_function():
    """Within 1e-8 of its largest value up to each speed; slopes, motion and limits are as near, and rows are few."""
    law, speeds = friction_law(lambda v: float(LAW.mu(v)), static=0.41), np.geomspace(1e-4, 50.0, 97)
    assert (law.static, law.parameters().rest) == (0.41, 0.4)
    np.testing.assert_allclose(law.mu(speeds), LAW.mu(speeds), rtol=4e-8)
    np.testing.assert_allclose(law.slope(speeds), LAW.slope(speeds), rtol=2e-4, atol=1e-5)
    assert len(law.parameters().table) < 200
    same = friction_law(lambda v: float(LAW.mu(v)))
    assert hopf_damping(STUDY, same) == pytest.approx(hopf_damping(STUDY, LAW), rel=1e-5)
    assert existence_limit(STUDY, same) == pytest.approx(existence_limit(STUDY, LAW), rel=1e-7)
    own, known = simulate(STUDY, same), simulate(STUDY, LAW)
    assert own.cycles == known.cycles > 80
    assert own.time == pytest.approx(known.time, rel=1e-6)


def test_a_function_is_met_closer_where_it_turns_fast():
    """A hump of a tenth of its speed, on which 100 speeds a decade err by 4e-6, and a kink. A jump is refused."""

    def hump(v):
        return 0.3 + 0.1 * math.exp(-(((v - 0.1) / 0.01) ** 2)) + max(v - 0.2, 0.0) / (0.3 + v)

    law, speeds = friction_law(hump), np.linspace(0.05, 0.3, 3001)
    assert law.mu(speeds) == pytest.approx([hump(v) for v in speeds], abs=2e-8)
    assert len(law.parameters().table) < 500
    with pytest.raises(ParameterError, match=r"jumps or is rough near 0\.1 m/s: give a TableLaw"):
        friction_law(lambda v: 0.4 if v < 0.1 else 0.3)


def section(law):
    return SimpleNamespace(law=law, static_friction=0.4, stribeck_decay_s_per_m=1.42, memory=None)


def test_a_law_in_a_file_of_the_user(tmp_path):
    """A function of speed: D = -mu'(v0) N / (2 m omega), mu'(v0) = -decay (static - mean) exp. Else a refusal."""
    own = "import math\n\nmu = 0.3\n\n\ndef falling(speed):\n    return 0.3 + 0.1 * math.exp(-1.42 * speed)\n"
    (tmp_path / "mine.py").write_text(own)
    law = law_from_scene(section(f"{tmp_path}/mine.py:falling"), 0.3)
    assert law.static == 0.4
    slope = -1.42 * 0.1 * math.exp(-1.42 * 0.948)
    assert hopf_damping(STUDY, law) == pytest.approx(-0.5 * slope * 2500.0 / 316.0, rel=1e-5)
    for name, line in (("mine.py:mu", "is no function of speed"), ("absent.py:mu", "there is no file")):
        with pytest.raises(ParameterError, match=line):
            law_from_scene(section(f"{tmp_path}/{name}"), 0.3)
    with pytest.raises(ParameterError, match="fails at 0 m/s: float division by zero"):
        friction_law(lambda v: 1.0 / v)
