"""Interpolation of mu_S between the nodes of a path."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from roughslip.oscillator.path import offset, offset_slope, piece_at

SPACING = 0.3


def interpolate(nodes, s, function=offset):
    return np.array([function(piece_at(nodes, SPACING, x), x) for x in s])


def test_against_scipy_hermite_with_central_tangents():
    nodes = np.random.default_rng(1).standard_normal(9)
    tangents = np.gradient(nodes, SPACING)  # central inside, one-sided at the ends
    reference = CubicHermiteSpline(SPACING * np.arange(9), nodes, tangents)
    s = np.linspace(0.0, 8 * SPACING, 101)
    assert interpolate(nodes, s) == pytest.approx(reference(s), abs=1e-13)
    assert interpolate(nodes, s, offset_slope) == pytest.approx(reference(s, 1), abs=1e-11)


def test_quadratics_are_exact_inside():
    """Central differences of a quadratic are its slopes, and a cubic with exact end data is exact."""
    quadratic = np.polynomial.Polynomial([0.3, -1.1, 0.7])
    nodes = quadratic(SPACING * np.arange(8))
    s = np.linspace(SPACING, 6 * SPACING, 50)
    assert interpolate(nodes, s) == pytest.approx(quadratic(s), abs=1e-14)
    assert interpolate(nodes, s, offset_slope) == pytest.approx(quadratic.deriv()(s), abs=1e-13)


def test_no_path_is_zero_without_end():
    piece = piece_at(np.zeros(0), 1.0, 123.0)
    assert offset(piece, 123.0) == 0.0
    assert offset_slope(piece, 123.0) == 0.0
    assert piece.right == np.inf
