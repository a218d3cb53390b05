"""The scaled equation, mu_S between the nodes of a path, one step by Fehlberg's pair, the motion between its ends."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from roughslip.oscillator.equation import SCATTERS, Oscillator, coefficients, jerk, slip_state
from roughslip.oscillator.path import AHEAD, KeptPath, Path, PathFeed, mu_s_at, mu_s_slope, piece_at, reaches
from roughslip.oscillator.runge_kutta import first_zero, lowest, quintic, sign_changes, slope, stationary, step, value
from tests.oscillator.motions import LAW, equal_steps

NONE = Path(np.zeros(0), 0, 1.0, True)
BUMP = np.array([0.02, 0.05, -0.03, 0.06])  # nodes 0.02 m apart; the slip of the tests stays on the first cubic
BUMPY = Path(BUMP, 0, 0.02, True)
EXCITED = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, 80.0, 500.0)
DRIVEN = coefficients(EXCITED, LAW)


@pytest.mark.parametrize("path", [BUMPY, NONE])
def test_order_of_the_solution(path):
    """Global error of the propagated solution in shorter steps, with excitation and with a stochastic part or none."""
    errors = [equal_steps(DRIVEN, path, 0.0125, DRIVEN.V, 2.0, n).x for n in (40, 80, 160, 1280)]
    errors = np.abs(np.array(errors[:-1]) - errors[-1])
    assert math.log2(errors[-2] / errors[-1]) == pytest.approx(5.0, abs=0.15)


def test_order_of_the_error_estimate():
    """It is the local error of the fourth-order member, h^5."""
    y = slip_state(0.0, 0.0085, 0.5 * DRIVEN.V, 0.0, 1.0, piece_at(BUMPY, 0.0), DRIVEN)
    estimates = [step(y, h, 1.0, piece_at(BUMPY, 0.0), DRIVEN)[1] for h in (0.02, 0.01)]
    assert math.log2(estimates[0] / estimates[1]) == pytest.approx(5.0, abs=0.3)


@pytest.mark.parametrize("scatter", SCATTERS)
@pytest.mark.parametrize("sigma", [1.0, -1.0])
def test_jerk_is_the_derivative_of_acceleration(sigma, scatter):
    """Central difference along the solution: error h^2, here 1e-6 relative."""
    p, piece = coefficients(EXCITED, LAW, scatter), piece_at(BUMPY, 0.004)
    y = slip_state(0.7, 0.006, (0.3 if sigma > 0 else 1.7) * p.V, 0.004, sigma, piece, p)
    h = 1e-4
    ahead, behind = (step(y, way * h, sigma, piece, p)[0] for way in (1.0, -1.0))
    assert jerk(y.tau, y.u, y.s, y.a, sigma, piece, p) == pytest.approx((ahead.a - behind.a) / (2 * h), rel=1e-6)


SPACING = 0.3


def interpolate(nodes, s, function=mu_s_at):
    path = Path(nodes, 0, SPACING, True)
    return np.array([function(piece_at(path, x), x) for x in s])


def test_against_scipy_hermite_with_central_tangents():
    nodes = np.random.default_rng(1).standard_normal(9)
    tangents = np.gradient(nodes, SPACING)  # central inside, one-sided at the ends
    reference = CubicHermiteSpline(SPACING * np.arange(9), nodes, tangents)
    s = np.linspace(0.01, 7.99 * SPACING, 101)
    for derivative, function in enumerate((mu_s_at, mu_s_slope)):
        assert interpolate(nodes, s, function) == pytest.approx(reference(s, derivative), abs=1e-11)


@pytest.mark.parametrize("size", [1, 2, 5, 13])
def test_a_path_in_pieces_is_that_path(size):
    """As s moves on, the same cubics bit by bit, the one-sided tangent at the end too, from a few nodes at a time."""
    count = 40 + AHEAD
    nodes = np.random.default_rng(3).standard_normal(count)
    whole = Path(nodes, 0, SPACING, True)
    feed = PathFeed((nodes[k : k + size] for k in range(0, count, size)), SPACING)
    for s in np.linspace(0.0, (count - 1) * SPACING, 901):
        if not reaches(feed.path, s):
            feed.advance(s)
        assert reaches(feed.path, s)
        assert piece_at(feed.path, s) == piece_at(whole, s)
        assert feed.path.nodes.size <= 5 + AHEAD + 2 * size
    assert feed.received == count
    assert feed.length_m == pytest.approx((count - 1) * SPACING)


def test_a_kept_path_is_drawn_once():
    """Runs one after another, the second further than the first, read the same nodes; an end is an end for all. What
    is beyond the nodes to keep is drawn again."""
    drawn = []

    def source():
        for k in range(5):
            drawn.append(k)
            yield np.full(2, float(k))

    path = KeptPath(source())
    assert [piece[0] for piece, _ in zip(path, range(3), strict=False)] == [0.0, 1.0, 2.0]
    assert len(drawn) <= 4
    for _ in range(2):
        assert np.concatenate(list(path)).tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]
    assert drawn == [0, 1, 2, 3, 4]
    few = KeptPath(BUMP.reshape(4, 1), 2)
    assert np.concatenate(list(few)).tolist() == np.concatenate(list(few)).tolist() == BUMP.tolist()
    assert [piece.size for piece in few] == [2, 1, 1]


H = 0.6
POLYNOMIAL = np.polynomial.Polynomial([0.2, -1.0, 3.0, 1.3, -0.7, 0.4])
coefficient = st.floats(-2.0, 2.0)


def over(polynomial, h=H):
    """Its quintic over (0, h)."""
    ends = [(polynomial(t), polynomial.deriv()(t), polynomial.deriv(2)(t)) for t in (0.0, h)]
    return quintic(h, *ends[0], *ends[1])


def test_extreme_and_root():
    b = over(POLYNOMIAL)
    (bottom,) = (t.real for t in POLYNOMIAL.deriv().roots() if abs(t.imag) < 1e-12 and 0.0 < t.real < H)
    assert stationary(b) * H == pytest.approx(bottom, abs=1e-14)
    falling = over(POLYNOMIAL - 0.15, bottom)
    (root,) = (t.real for t in (POLYNOMIAL - 0.15).roots() if abs(t.imag) < 1e-12 and 0.0 < t.real < bottom)
    assert sign_changes(falling) == 1
    assert first_zero(falling) * bottom == pytest.approx(root, abs=1e-13)


@settings(derandomize=True, max_examples=100, deadline=None)
@given(st.lists(coefficient, min_size=6, max_size=6))
def test_control_points_bound_value_and_roots(coefficients):
    """Property: no value below the lowest point; as many changes of sign as roots, or an even number more."""
    polynomial = np.polynomial.Polynomial(coefficients)
    b = over(polynomial, 1.0)
    fractions = np.linspace(0.0, 1.0, 101)
    values = np.array([value(b, t) for t in fractions])
    assert values == pytest.approx(polynomial(fractions), abs=1e-13)
    assert [slope(b, t) for t in fractions] == pytest.approx(polynomial.deriv()(fractions), abs=1e-12)
    assert values.min() >= lowest(b) - 1e-13
    seen = np.count_nonzero(np.diff(np.sign(values[values != 0.0])))
    assert sign_changes(b) >= seen
