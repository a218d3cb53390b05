"""The local expansion: known responses are recovered with their errors, by every kind of target.

Targets of the expansion: continuous with slope at first contact, and the paper's fits on the samples in contact.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.local import GROUPS, SolvedSurfaces, best_gap_stiffness, fit_local, jackknife_deviations
from roughslip.chaos.pressure import CURVATURE, OUTSIDE_SCALE, PressureTarget, fit_in_contact, pressure_target
from roughslip.chaos.scatter import REACH, residual_scatter
from roughslip.errors import ParameterError

TARGETS = {
    "trial_pressure": PressureTarget("trial_pressure", 2.0),
    "squared_pressure": PressureTarget("squared_pressure", 2.0, 1.5),
}

NODES = 3


def response(u):
    """A cubic polynomial of three variables, some 30 % of it positive."""
    return -0.6 + u[..., 0] + 0.5 * u[..., 1] + 0.25 * u[..., 0] * u[..., 1] + 0.04 * (u[..., 2] ** 3 - 3 * u[..., 2])


def scatter(u):
    """Standard deviation that grows where the response is positive."""
    return 0.2 + 0.2 * np.maximum(response(u), 0.0)


def pressures(r, target):
    """Pressure and gap of a target r."""
    return target.pressure(r), np.maximum(-r, 0.0) / target.gap_stiffness


def samples(target, seed, surfaces=800, variables=8):
    """Nodes of a surface share half the variance of their variables, and their scatter."""
    generator = np.random.default_rng([2011, seed])
    shape = (surfaces, NODES, variables)
    u = (generator.standard_normal(shape) + generator.standard_normal(shape)[:, :1]) / np.sqrt(2)
    u[:, 0] = generator.standard_normal(shape[::2])  # by itself
    distance2 = np.array([0.0, 0.5, 1.0])
    r = response(u) - 0.5 * distance2 + scatter(u) * generator.standard_normal((surfaces, 1))
    return SolvedSurfaces(u, distance2, *pressures(r, target))


def test_the_fit_to_all_surfaces_is_weighted_least_squares_and_the_scatter_that_near_contact():
    """At one distance, so without a drift: predictions of left-out surfaces follow from the fits without a group."""
    target = TARGETS["squared_pressure"]
    whole = samples(target, 4, 400, 3)
    near = {name: getattr(whole, name)[:, :1] for name in ("variables", "pressure", "gap")}
    one = fit_local(replace(whole, distance2=whole.distance2[:1], **near), 2, target)
    basis = hermite_basis(whole.variables[:, 0], multi_indices(3, 2))
    pressure = whole.pressure[:, 0]
    values = target.values(pressure, whole.gap[:, 0])
    root = np.sqrt(target.weights(values))
    expected = np.linalg.lstsq(root[:, None] * basis, root * values, rcond=None)[0]
    np.testing.assert_allclose(one.whole.coefficients, expected, rtol=1e-9, atol=1e-11)
    predicted = np.array([row @ one.without[k % GROUPS].coefficients for k, row in enumerate(basis)])
    touching = pressure > 0
    assert one.lowest == pytest.approx(min(-REACH * values[touching].mean(), predicted[touching].min()), rel=1e-9)
    in_scatter = predicted >= one.lowest
    assert np.count_nonzero(~in_scatter) > 0
    assert one.whole.scatter.low == pytest.approx(predicted[in_scatter].min(), rel=1e-9)
    again = residual_scatter(predicted[in_scatter], values[in_scatter])
    np.testing.assert_allclose(one.whole.scatter.quantiles, again.quantiles, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(one.fit.predicted, predicted, rtol=1e-9, atol=1e-11)
    even = fit_local(replace(whole, odd=np.array([[0], [1], [0]])), 2, target)
    assert sorted(map(tuple, even.indices)) == sorted(term for term in map(tuple, one.indices) if term[1] % 2 == 0)


def test_the_stiffness_takes_the_kink_out():
    """p = 1.3 v where v > 0, gap = -v else: p - 1.3 gap is linear. The search ends at twice the guess."""
    generator = np.random.default_rng(4)
    u = generator.standard_normal((400, 2))
    basis, group = np.column_stack([np.ones(400), u]), np.arange(400) % GROUPS
    v = 0.3 + u @ [1.0, 0.5]
    for guess in (1.0, 1.6, 0.8):
        stiffness = best_gap_stiffness(basis, group, 1.3 * np.maximum(v, 0), np.maximum(-v, 0), guess)
        assert stiffness == pytest.approx(1.3, abs=0.001 * guess)  # its grid
    assert best_gap_stiffness(basis, group, 1.3 * np.maximum(v, 0), np.maximum(-v, 0), 0.1) == pytest.approx(0.2)
    whole = SolvedSurfaces(u[:, None], np.zeros(1), 1.3 * np.maximum(v, 0)[:, None], np.maximum(-v, 0)[:, None])
    noisy = replace(whole, gap=whole.gap * (1 + 1e-3 * u[:, 1:] ** 2))
    fit = fit_local(noisy, 1, PressureTarget("trial_pressure", 1.0))
    assert fit.target.gap_stiffness == pytest.approx(1.3, abs=0.01)


def test_jackknife_deviations_of_a_mean_sum_to_its_variance():
    """Twenty groups of one sample each: the variance of a mean is s^2 / n, exactly."""
    values = np.random.default_rng(9).standard_normal(20)
    without = (values.sum() - values) / 19
    assert np.sum(jackknife_deviations(without) ** 2) == pytest.approx(np.var(values, ddof=1) / 20, rel=1e-12)


@pytest.mark.parametrize("kind", TARGETS)
def test_draws_are_balanced_by_what_was_solved(kind):
    """At the samples the mean of the draws is that of the solved pressures, within half a per cent for 100 draws at
    each of 800. With a hardness nothing is scaled."""
    target = TARGETS[kind]
    part = samples(target, seed=6)
    one = SolvedSurfaces(part.variables[:, :1, :3], np.zeros(1), part.pressure[:, :1], part.gap[:, :1])
    fit = fit_local(one, 3, target)
    predicted = hermite_basis(one.variables[:, 0], fit.indices) @ fit.whole.coefficients
    near = predicted > fit.lowest
    uniform = np.random.default_rng(3).random((int(near.sum()), 100))
    drawn = fit.whole.draw(predicted[near, None], uniform, fit.target)
    assert drawn.sum() / 100 == pytest.approx(one.pressure.sum(), rel=0.015)
    assert len({member.balance for member in fit.without}) == GROUPS
    capped = fit_local(one, 3, replace(target, hardness_pa=1e9))
    assert {member.balance for member in (capped.whole, *capped.without)} == {1.0}


MODULUS, SUMMIT_CURVATURE, DIAGONAL = 2.3e11, 1e3, 4e-18

PARTS = {
    "influence_diagonal": DIAGONAL,
    "plane_strain_modulus_pa": MODULUS,
    "rms_height_m": SUMMIT_CURVATURE / CURVATURE,
    "correlation_length_m": 1.0,
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
    values = target.values(pressure, gap)
    np.testing.assert_allclose(values, target.gap_stiffness * interference + parabola, rtol=1e-14)
    np.testing.assert_allclose(target.pressure(values), pressure, rtol=2e-15)  # five roundings


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


def test_weights_fall_with_the_distance_from_contact():
    target = PressureTarget("squared_pressure", 1.0)
    values = np.array([2.0, 4.0, 0.0, -3.0 * OUTSIDE_SCALE, -9.0 * OUTSIDE_SCALE])  # the mean in contact is 3
    np.testing.assert_allclose(target.weights(values), [1.0, 1.0, 1.0, 0.5, 0.1], rtol=1e-14)
    np.testing.assert_allclose(target.weights(1e18 * values), target.weights(values), rtol=1e-14)
    assert np.array_equal(PressureTarget("trial_pressure", 1.0).weights(values), np.ones(5))


@pytest.mark.parametrize("logarithm", [False, True])
def test_fit_in_contact_is_plain_least_squares_there(logarithm):
    xi = np.random.default_rng(1).standard_normal((200, 2))
    basis = hermite_basis(xi, multi_indices(2, 2))
    pressure = np.maximum(np.sin(xi[:, 0]) + 0.3 * xi[:, 1] ** 3, 0.0)
    contact = pressure > 0
    fit = fit_in_contact(basis, pressure, logarithm=logarithm)
    sought = np.log(pressure[contact]) if logarithm else pressure[contact]
    np.testing.assert_allclose(fit.coefficients, np.linalg.lstsq(basis[contact], sought, rcond=None)[0], rtol=1e-11)
    assert fit.samples == contact.sum() < len(pressure)
    with pytest.raises(ParameterError, match="a pressure for each row"):
        fit_in_contact(basis, pressure[1:], logarithm=logarithm)
