"""Targets of the expansion: continuous with slope at first contact, and the paper's fits on the samples in contact."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.pressure import (
    OUTSIDE_SCALE,
    PressureTarget,
    fit_in_contact,
    pressure_target,
)
from roughslip.chaos.regression import least_squares
from roughslip.errors import IllPosedError

MODULUS, SUMMIT_CURVATURE, DIAGONAL = 2.3e11, 1e3, 4e-18
PARTS = {
    "influence_diagonal": DIAGONAL,
    "plane_strain_modulus_pa": MODULUS,
    "summit_curvature_per_m": SUMMIT_CURVATURE,
}


def test_squared_pressure_is_linear_through_first_contact_of_a_paraboloid():
    """Hertz: a = sqrt(R d), F = 4/3 E* sqrt(R) d^1.5, p0 = 3 F / (2 pi a^2); the gap before contact is -d. Cells far
    smaller than the contact have B_00 = 0."""
    radius = 1 / SUMMIT_CURVATURE
    approach = np.linspace(-2e-8, 2e-8, 9)
    pressed = np.maximum(approach, 0.0)
    area = np.pi * radius * np.where(pressed > 0, pressed, 1.0)
    pressure = 1.5 * (4 / 3 * MODULUS * math.sqrt(radius) * pressed**1.5) / area
    target = pressure_target("squared_pressure", **PARTS | {"influence_diagonal": 0.0})
    values = target.values(pressure, np.maximum(-approach, 0.0))
    np.testing.assert_allclose(values, (2 * MODULUS / math.pi) ** 2 * SUMMIT_CURVATURE * approach, rtol=1e-13)
    np.testing.assert_allclose(target.pressure(values), pressure, rtol=1e-13)  # a plain root, and no 0 / 0 on the way


@pytest.mark.parametrize("kind", ["trial_pressure", "squared_pressure"])
def test_targets_have_one_slope_through_first_contact_of_a_cell(kind):
    """A cell alone: p = u / B_00 where the interference u is positive, else the gap is -u. p^2 adds a parabola."""
    interference = np.linspace(-2e-8, 2e-8, 9)
    pressure, gap = np.maximum(interference, 0.0) / DIAGONAL, np.maximum(-interference, 0.0)
    target = pressure_target(kind, **PARTS)
    parabola = pressure**2 if kind == "squared_pressure" else 0.0
    np.testing.assert_allclose(target.values(pressure, gap), target.gap_stiffness * interference + parabola, rtol=1e-14)


def test_squared_pressure_of_large_cells_is_the_trial_pressure():
    """w / p_1 = p + p^2 / p_1 - gap / B_00: the pressure is small against p_1 = k B_00."""
    pressure, gap = np.array([1e5, 3e6, 0.0, 0.0]), np.array([0.0, 0.0, 1e-9, 1e-7])
    coarse = PARTS | {"influence_diagonal": 1e-4}
    squared, trial = (pressure_target(kind, **coarse) for kind in ("squared_pressure", "trial_pressure"))
    assert squared.cell_pressure_pa > 1e14 * pressure.max()
    np.testing.assert_allclose(
        squared.values(pressure, gap) / squared.cell_pressure_pa, trial.values(pressure, gap), rtol=1e-13
    )


@pytest.mark.parametrize("kind", ["trial_pressure", "squared_pressure"])
def test_targets_go_on_above_the_hardness_as_below_contact(kind):
    """A cell alone that yields at H: p = H for an interference u > H B_00, and the plastic displacement is the rest."""
    hardness = 1e9
    target = pressure_target(kind, **PARTS, hardness_pa=hardness)
    plastic = np.linspace(0.0, 3e-8, 7)
    values = target.values(np.full(7, hardness), -plastic)
    at_yield = target.values(np.array([hardness]), np.zeros(1))
    # H^2 and the plastic term differ by five decades: their sum keeps eleven digits of the smaller
    np.testing.assert_allclose(values - at_yield, target.gap_stiffness * plastic, rtol=1e-10, atol=1e-15 * at_yield[0])
    # sum, root and quotient may leave the pressure at yield one rounding below the hardness, never above
    assert np.all(target.pressure(values) <= hardness)
    np.testing.assert_allclose(target.pressure(values), hardness, rtol=4 * 2.0**-53)
    assert np.all(target.pressure(values[1:]) == hardness)
    assert target.pressure(0.5 * at_yield)[0] < hardness


@settings(derandomize=True, max_examples=50, deadline=None)
@given(st.sampled_from(["trial_pressure", "squared_pressure"]), st.floats(1e-3, 1e12), st.floats(0, 1e-6))
def test_the_positive_part_gives_the_pressure_back(kind, pressure, gap):
    target = pressure_target(kind, **PARTS)
    pressed, apart = np.array([pressure, 0.0, 0.0]), np.array([0.0, gap, 0.0])
    # product, square, root, sum and quotient: five roundings, the square doubling those before it
    np.testing.assert_allclose(target.pressure(target.values(pressed, apart)), pressed, rtol=2e-15)


def test_weights_fall_with_the_distance_from_contact():
    target = PressureTarget("squared_pressure", 1.0)
    values = np.array([2.0, 4.0, 0.0, -3.0 * OUTSIDE_SCALE, -9.0 * OUTSIDE_SCALE])  # the mean in contact is 3
    np.testing.assert_allclose(target.weights(values), [1.0, 1.0, 1.0, 0.5, 0.1], rtol=1e-14)
    np.testing.assert_allclose(target.weights(1e18 * values), target.weights(values), rtol=1e-14)
    assert np.array_equal(PressureTarget("trial_pressure", 1.0).weights(values), np.ones(5))
    with pytest.raises(IllPosedError, match="no sample is in contact"):
        target.weights(np.array([-1.0, 0.0]))


def problem(samples=200):
    xi = np.random.default_rng(1).standard_normal((samples, 2))
    return xi, hermite_basis(xi, multi_indices(2, 2))


@pytest.mark.parametrize("logarithm", [False, True])
def test_fit_in_contact_is_plain_least_squares_there(logarithm):
    xi, basis = problem()
    pressure = np.maximum(np.sin(xi[:, 0]) + 0.3 * xi[:, 1] ** 3, 0.0)
    contact = pressure > 0
    fit = fit_in_contact(basis, pressure, logarithm=logarithm)
    sought = np.log(pressure[contact]) if logarithm else pressure[contact]
    np.testing.assert_allclose(fit.coefficients, np.linalg.lstsq(basis[contact], sought, rcond=None)[0], rtol=1e-11)
    assert fit.samples == contact.sum() < len(pressure)


def test_every_sample_recovers_eq_8_where_contact_alone_cannot():
    """r = -1.5 + xi_1 + xi_1 xi_2 / 2, of which few samples are positive: p = r^+, gap = r^- B_00."""
    xi, basis = problem(40)
    trial = -1.5 + xi[:, 0] + xi[:, 0] * xi[:, 1] / 2
    pressure, gap = 1e6 * np.maximum(trial, 0.0), 1e6 * DIAGONAL * np.maximum(-trial, 0.0)
    assert 0 < np.count_nonzero(pressure) <= basis.shape[1]
    target = pressure_target("trial_pressure", **PARTS)
    fit = least_squares(basis, target.values(pressure, gap))
    np.testing.assert_allclose(fit.coefficients, [-1.5e6, 1e6, 0, 0, 0.5e6, 0], atol=1e6 * 1e-12)
    with pytest.raises(IllPosedError, match="more than the 6 coefficients"):
        fit_in_contact(basis, pressure, logarithm=False)
