"""Quintic dense output: exact for quintics, bounded by its control points, roots and extremes by bisection."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
