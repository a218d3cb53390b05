"""mu_S between the nodes of a path, and the motion between the ends of a step."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from roughslip.errors import ParameterError
from roughslip.oscillator.dense_output import (
    first_zero,
    lowest,
    quintic,
    sign_changes,
    slope,
    stationary,
    value,
    velocity,
)
from roughslip.oscillator.equation import State
from roughslip.oscillator.path import (
    KeptPath,
    PathFeed,
    largest_kink,
    mu_s_at,
    mu_s_curvature,
    mu_s_slope,
    path_through,
    piece_at,
    reaches,
)

SPACING = 0.3


def interpolate(nodes, s, function=mu_s_at):
    path = path_through(nodes, 0, SPACING, True, True)
    return np.array([function(piece_at(path, x), x) for x in s])


def test_against_scipy_hermite_with_central_tangents():
    nodes = np.random.default_rng(1).standard_normal(9)
    tangents = np.gradient(nodes, SPACING)  # central inside, one-sided at the ends
    reference = CubicHermiteSpline(SPACING * np.arange(9), nodes, tangents)
    s = np.linspace(0.0, 8 * SPACING, 101)
    assert interpolate(nodes, s) == pytest.approx(reference(s), abs=1e-13)
    assert interpolate(nodes, s, mu_s_slope) == pytest.approx(reference(s, 1), abs=1e-11)


def test_quadratics_are_exact_inside():
    """Central differences of a quadratic are its slopes, and a cubic with exact end data is exact."""
    quadratic = np.polynomial.Polynomial([0.3, -1.1, 0.7])
    nodes = quadratic(SPACING * np.arange(8))
    s = np.linspace(SPACING, 6 * SPACING, 50)
    assert interpolate(nodes, s) == pytest.approx(quadratic(s), abs=1e-14)
    assert interpolate(nodes, s, mu_s_slope) == pytest.approx(quadratic.deriv()(s), abs=1e-13)


def test_no_path_is_zero_without_end():
    piece = piece_at(path_through(np.zeros(0), 0, 1.0, True, True), 123.0)
    assert mu_s_at(piece, 123.0) == 0.0
    assert mu_s_slope(piece, 123.0) == 0.0
    assert piece.right == np.inf


def test_linear_pieces_are_chords():
    nodes = np.random.default_rng(2).standard_normal(9)
    path = path_through(nodes, 0, SPACING, False, True)
    s = np.linspace(0.0, 8 * SPACING, 101)
    found = np.array([mu_s_at(piece_at(path, x), x) for x in s])
    assert found == pytest.approx(np.interp(s, SPACING * np.arange(9), nodes), abs=1e-13)
    slopes = [mu_s_slope(piece_at(path, (k + 0.5) * SPACING), (k + 0.5) * SPACING) for k in range(8)]
    assert slopes == pytest.approx(np.diff(nodes) / SPACING, abs=1e-12)


@pytest.mark.parametrize("size", [1, 2, 5, 13])
def test_a_path_in_pieces_is_that_path(size):
    """As s moves on, the same cubics bit by bit, the one-sided tangent at the end too, from a few nodes at a time."""
    nodes = np.random.default_rng(3).standard_normal(40)
    whole = path_through(nodes, 0, SPACING, True, True)
    feed = PathFeed((nodes[k : k + size] for k in range(0, 40, size)), SPACING, "cubic")
    for s in np.linspace(0.0, 39 * SPACING, 301):
        if not reaches(feed.path, s):
            feed.advance(s)
        assert reaches(feed.path, s)
        assert piece_at(feed.path, s) == piece_at(whole, s)
        assert feed.path.nodes.size <= 8 + 2 * size
    assert feed.received == 40
    assert feed.length_m == pytest.approx(39 * SPACING)


@pytest.mark.parametrize(
    ("path", "spacing", "interpolation", "message"),
    [
        ([np.zeros(1)], 1.0, "cubic", "at least two"),
        ([], 1.0, "cubic", "at least two"),
        ([np.zeros(4), np.array([np.inf])], 1.0, "cubic", "finite"),
        ([np.zeros((4, 2))], 1.0, "cubic", "row"),
        ([np.zeros(4)], 0.0, "cubic", "spacing"),
        (np.zeros(4), 1.0, "quintic", "cubic or linear"),
    ],
)
def test_what_is_no_path_is_refused(path, spacing, interpolation, message):
    with pytest.raises(ParameterError, match=message):
        PathFeed(path, spacing, interpolation)


def test_a_kept_path_is_drawn_once():
    """Runs one after another, the second further than the first, read the same pieces; an end is an end for all."""
    drawn = []

    def source():
        for k in range(5):
            drawn.append(k)
            yield np.full(2, float(k))

    path = KeptPath(source())
    assert [piece[0] for piece, _ in zip(path, range(3), strict=False)] == [0.0, 1.0, 2.0]
    assert len(drawn) <= 4
    assert [piece[0] for piece in path] == [piece[0] for piece in path] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert drawn == [0, 1, 2, 3, 4]


def test_curvature_is_the_second_derivative():
    nodes = np.random.default_rng(4).standard_normal(6)
    reference = CubicHermiteSpline(SPACING * np.arange(6), nodes, np.gradient(nodes, SPACING))
    s = np.linspace(0.01, 4.99 * SPACING, 40)
    assert interpolate(nodes, s, mu_s_curvature) == pytest.approx(reference(s, 2), abs=1e-10)


@pytest.mark.parametrize(("cubic", "order"), [(True, 2), (False, 1)])
def test_the_bound_of_a_kink_holds(cubic: bool, order: int) -> None:
    """Cubics meet with one slope, so that they part as t^2, lines as t; two steps up and two down attain it."""
    rng = np.random.default_rng(4)
    for nodes, share in ((rng.standard_normal(40), 0.2), (np.tile([0.0, 1.0, 2.0, 1.0], 10), 0.99)):
        path = path_through(nodes, 0, SPACING, cubic, True)
        assert path.steepest == np.abs(np.diff(nodes)).max()
        for t in (1e-3, 0.1, 1.0):
            apart = []
            for k in range(1, 39):
                before, behind = piece_at(path, (k - 0.5) * SPACING), piece_at(path, (k + 0.5) * SPACING)
                for z in ((k - t) * SPACING, (k + t) * SPACING):
                    apart.append(abs(mu_s_at(behind, z) - mu_s_at(before, z)))
            assert max(apart) <= largest_kink(path, t) * (1.0 + 1e-9)
            assert t > 1e-3 or max(apart) >= share * largest_kink(path, t)
    assert largest_kink(path, 2e-3) == pytest.approx(2**order * largest_kink(path, 1e-3), rel=1e-2)


H = 0.6
POLYNOMIAL = np.polynomial.Polynomial([0.2, -1.0, 3.0, 1.3, -0.7, 0.4])
coefficient = st.floats(-2.0, 2.0)


def over(polynomial, h=H):
    """Its quintic over (0, h)."""
    ends = [(polynomial(t), polynomial.deriv()(t), polynomial.deriv(2)(t)) for t in (0.0, h)]
    return quintic(h, *ends[0], *ends[1])


def test_quintics_are_exact():
    b = over(POLYNOMIAL)
    for t in (0.0, 0.3, 0.77, 1.0):
        assert value(b, t) == pytest.approx(POLYNOMIAL(t * H), abs=1e-15)
        assert slope(b, t) == pytest.approx(H * POLYNOMIAL.deriv()(t * H), abs=1e-14)


def test_velocity_of_a_step_is_through_its_ends():
    states = [
        State(t, POLYNOMIAL(t), POLYNOMIAL.deriv()(t), 0.0, POLYNOMIAL.deriv(2)(t), POLYNOMIAL.deriv(3)(t))
        for t in (0.1, 0.7)
    ]
    assert value(velocity(*states), 0.5) == pytest.approx(POLYNOMIAL.deriv()(0.4), abs=1e-14)


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
    assert values.min() >= lowest(b) - 1e-13
    seen = np.count_nonzero(np.diff(np.sign(values[values != 0.0])))
    assert sign_changes(b) >= seen
