"""The expansion of a field and its links: directions, left-out indices, maps and draws, against closed forms."""

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from roughslip.chaos import field
from roughslip.chaos.field import GROUPS, draw_pressure, fit_field, left_out_index, mode_shares, normal_scores
from roughslip.chaos.hermite import multi_indices, sobol_indices
from roughslip.chaos.regression import factorised
from roughslip.chaos.single_index import (
    Link,
    fit_link,
    hermite_moments,
    knots_for,
    sensitivity_along,
    share_of_modes,
)
from roughslip.errors import IllPosedError, ParameterError

MODES, NODES = 6, 40
HEIGHT = np.linspace(-1.2, 0.4, NODES)  # z: contact where z + d xi is positive


def directions():
    d = np.random.default_rng(11).standard_normal((MODES, NODES))
    return d / np.linalg.norm(d, axis=0)


def surfaces(count, seed, scatter=0.0, nodes=NODES):
    """xi, and a state with p = 2e8 (z + d xi + noise)^+ Pa and the gap as far below, in metres."""
    generator = np.random.default_rng([2026, seed])
    xi = generator.standard_normal((count, MODES))
    s = HEIGHT[:nodes] + xi @ directions()[:, :nodes] + scatter * generator.standard_normal((count, nodes))
    return xi, np.where(s > 0, 2e8 * s, 1e-7 * s)


def expected(scatter=0.0, nodes=NODES):
    """Contact probability, mean and standard deviation of a normal that is cut off at zero."""
    width = math.hypot(1.0, scatter)
    z = HEIGHT[:nodes] / width
    density = np.exp(-(z**2) / 2) / math.sqrt(2 * math.pi)
    mean = density + z * ndtr(z)
    square = (1 + z**2) * ndtr(z) + z * density
    return ndtr(z), 2e8 * width * mean, 2e8 * width * np.sqrt(square - mean**2)


def test_a_linear_state_gives_its_direction_and_the_maps_of_a_normal():
    """A direction is found to within the noise of the ranks at the ends, 1e-4 of 2000. With a scatter of 0.3 its square
    error is 5 x 0.3^2 / 2000, twice the loss of its cosine."""
    fit = fit_field(*surfaces(2000, 0))
    np.testing.assert_allclose(np.sum(fit.direction * directions(), axis=0), 1.0, rtol=0, atol=1e-4)
    assert fit.missed.max() < 0.01
    assert fit.expected_pressure(np.full(NODES, 2.0)) == pytest.approx(2e8 * (HEIGHT + 2.0), rel=0.05)
    fit = fit_field(*surfaces(2000, 0, scatter=0.3))
    np.testing.assert_allclose(np.sum(fit.direction * directions(), axis=0), 1.0, rtol=0, atol=1e-3)
    limit = float(ndtri(1 - 0.001 / (2 * 3 * NODES)))  # family-wise 0.1 %
    for one, truth in zip((fit.contact, fit.mean, fit.deviation), expected(0.3), strict=True):
        assert np.max(np.abs(one.value - truth) / one.error) < limit
        assert np.all(one.gain > 2)


def test_left_out_indices_are_those_of_refits():
    xi, state = surfaces(60, 1, scatter=0.5)
    basis = np.column_stack([np.ones(60), xi])
    scores = normal_scores(state)
    direction, index = left_out_index(factorised(basis), basis, scores)
    slope = np.linalg.lstsq(basis, scores, rcond=None)[0][1:]
    np.testing.assert_allclose(direction, slope / np.linalg.norm(slope, axis=0), rtol=1e-10)
    for k in range(60):
        rest = np.delete(np.arange(60), k)
        slope = np.linalg.lstsq(basis[rest], scores[rest], rcond=None)[0][1:]
        np.testing.assert_allclose(index[k], xi[k] @ slope / np.linalg.norm(slope, axis=0), rtol=1e-9, atol=1e-12)


def test_directions_without_a_group_are_those_of_refits():
    xi, state = surfaces(203, 1, scatter=0.5, nodes=5)
    fit = fit_field(xi, state + 1e9 * (state > 0))
    scores = normal_scores(state)
    for g in range(GROUPS):
        rest = np.arange(203) % GROUPS != g
        basis = np.column_stack([np.ones(rest.sum()), xi[rest]])
        slope = np.linalg.lstsq(basis, scores[rest], rcond=None)[0][1:]
        np.testing.assert_allclose(fit.without[g], slope / np.linalg.norm(slope, axis=0), rtol=1e-9)


def test_ranks_alone_count_for_the_direction():
    """Units of pressure and gap do not: pressures and gaps times anything give the same indices."""
    xi, state = surfaces(300, 2, scatter=0.3)
    other = np.where(state > 0, 7.0 * state, 1e6 * state)
    np.testing.assert_array_equal(fit_field(xi, state).index, fit_field(xi, other).index)


@pytest.mark.slow
def test_maps_are_unbiased_and_their_errors_are_true():
    """200 repetitions with 150 surfaces have no error on average, within 4 standard errors. Relative to the estimated
    errors their root mean square is 1, which 200 give to within 5 %. For the standard deviation it may be half larger,
    because few surfaces have the large pressures that determine it."""
    nodes, repetitions = 4, 200
    z = np.empty((repetitions, 3, nodes))
    for seed in range(repetitions):
        xi, state = surfaces(150, 1000 + seed, scatter=0.5, nodes=NODES)
        part = slice(NODES // 2, NODES, 5)
        fit = fit_field(xi, state[:, part])
        for row, (one, truth) in enumerate(zip((fit.contact, fit.mean, fit.deviation), expected(0.5), strict=True)):
            z[seed, row] = (one.value - truth[part]) / one.error
    bias = z[:, :2].mean(axis=0) * math.sqrt(repetitions)
    assert np.max(np.abs(bias)) < 4
    spread = np.sqrt(np.mean(z**2, axis=0))
    assert np.all((spread[:2] > 0.85) & (spread[:2] < 1.15))
    assert np.all((spread[2] > 0.85) & (spread[2] < 1.5))


def test_without_the_expansion_errors_are_those_of_moments():
    """gain error^2 K is a variance: q (1 - q), m_2, and (m_4 - m_2^2) / (4 m_2), here with moments of the expansion."""
    xi, state = surfaces(2000, 6, scatter=0.3)
    fit, pressure = fit_field(xi, state), np.maximum(state, 0.0)
    share = np.mean(pressure > 0, axis=0)
    second, fourth = (np.mean((pressure - pressure.mean(axis=0)) ** power, axis=0) for power in (2, 4))
    known = share * (1 - share), second, (fourth - second**2) / (4 * second)
    ones = (fit.contact, fit.mean, fit.deviation)
    for one, variance, tolerance in zip(ones, known, (1e-9, 1e-9, 0.25), strict=True):
        np.testing.assert_allclose(one.gain * one.error**2 * 2000, variance, rtol=tolerance)


@pytest.mark.slow
def test_errors_of_shares_are_their_scatter():
    """The standard deviation over 60 designs, which they give to within 10 %, and a jackknife of 10 groups to 25 %."""
    shares = []
    for seed in range(60):
        xi, state = surfaces(300, 3000 + seed, scatter=0.5, nodes=NODES)
        shares.append(mode_shares(fit_field(xi, state[:, -3:]), 1))
    for name in ("first", "total"):
        scatter = np.std([getattr(one, name) for one in shares], axis=0)
        estimated = np.sqrt(np.mean([getattr(one, f"{name}_error") ** 2 for one in shares], axis=0))
        ratio = np.exp(np.mean(np.log(estimated / scatter)))  # of six modes
        assert ratio == pytest.approx(1.0, abs=0.25)


def test_modes_that_a_state_does_not_depend_on_have_no_share():
    """One mode alone: all of the variance at first order. Two of equal weight share it alike."""
    generator = np.random.default_rng(5)
    xi = generator.standard_normal((1500, 3))
    state = np.column_stack([xi[:, 0], (xi[:, 0] + xi[:, 1]) / math.sqrt(2)])
    fit = fit_field(xi, state)
    shares = mode_shares(fit, 1)
    assert shares.leading[0] == pytest.approx(1.0, abs=1e-3)
    assert shares.first[2] == pytest.approx(0.0, abs=1e-3)
    # both nodes carry (t)^+, of which h_1^2 = 1/4 of the variance 1/2 - 1/(2 pi), and more at even orders
    variance = 0.5 - 0.5 / math.pi
    h = np.array([0.25, 1 / (4 * math.pi), 0.0, 1 / (48 * math.pi), 0.0, 1 / (160 * math.pi)])  # n = 1 to 6
    alone = np.sum(h / 2 ** np.arange(1, 7)) / variance
    assert shares.leading[1] == pytest.approx(alone, abs=0.01)
    assert shares.first[0] == pytest.approx((1 + alone) / 2, abs=0.01)
    assert shares.first[1] == pytest.approx(alone / 2, abs=0.01)
    assert np.all(shares.total >= shares.first - 1e-12)
    assert np.all(np.abs(shares.first - [(1 + alone) / 2, alone / 2, 0]) < 4 * shares.first_error + 0.005)


def test_drawn_fields_have_the_distribution_of_the_solved_ones_at_a_node():
    """Contact and mean of 600 draws within four of their standard errors, and those of a window's 4 % at 40 nodes."""
    xi, state = surfaces(1500, 3, scatter=0.5)
    fit = fit_field(xi, state)
    generator = np.random.default_rng(4)
    drawn = draw_pressure(fit, state, generator.standard_normal((600, MODES)) @ fit.direction, generator)
    assert np.all(drawn >= 0)
    contact, mean, deviation = expected(0.5)
    error = np.sqrt(contact * (1 - contact) / 600 + fit.contact.error**2)
    assert np.max(np.abs(np.mean(drawn > 0, axis=0) - contact) / error) < 4.5
    error = np.sqrt(deviation**2 / 600 + fit.mean.error**2)
    assert np.max(np.abs(drawn.mean(axis=0) - mean) / error) < 4.5
    assert drawn.std(axis=0) == pytest.approx(deviation, rel=0.25)


def test_the_share_of_the_surfaces_that_is_drawn_from(monkeypatch):
    """A fifth of 300, and no fewer than 40 where a tenth is asked for."""
    monkeypatch.setattr(field, "NEIGHBOURS", 0.2)
    seen = []
    law = field._NearestStates
    monkeypatch.setattr(field, "_NearestStates", lambda *parts: seen.append(parts[3]) or law(*parts))
    xi, state = surfaces(300, 7, scatter=0.5)
    fit = fit_field(xi, state)
    draw_pressure(fit, state, fit.index[:2], Nearest())
    monkeypatch.setattr(field, "NEIGHBOURS", 0.1)
    draw_pressure(fit, state, fit.index[:2], Nearest())
    assert set(seen) == {60, 40}


class Nearest:
    """In place of a generator: chooses the first."""

    def permuted(self, values, axis):
        return values


def test_a_solved_surface_with_its_own_ranks_is_drawn_unchanged():
    xi, state = surfaces(300, 7, scatter=0.5)
    fit = fit_field(xi, state)
    drawn = draw_pressure(fit, state, fit.index[:20], Nearest())
    np.testing.assert_array_equal(drawn, np.maximum(state[:20], 0.0))


def test_ill_posed_fields_are_refused():
    xi, state = surfaces(300, 4)
    with pytest.raises(IllPosedError, match="101 samples are too few for 151 coefficients"):
        fit_field(np.random.default_rng(0).standard_normal((101, 150)), state[:101])
    with pytest.raises(IllPosedError, match="condition number"):
        fit_field(np.column_stack([xi, xi[:, 0] + 1e-12 * xi[:, 1]]), state)
    rare = state.copy()
    rare[:, 7] = -np.arange(1.0, 301.0)
    rare[:19, 7] = 1.0 + np.arange(19.0)
    with pytest.raises(IllPosedError, match=r"in contact on 19 of 300 surfaces; 20 are needed"):
        fit_field(xi, rare)
    rare[19, 7] = 20.5
    assert fit_field(xi, rare).contact.value[7] == pytest.approx(20 / 300, abs=0.03)
    state[0, 0] = np.inf
    with pytest.raises(ParameterError, match="finite"):
        fit_field(xi, state)


LINK_SAMPLES, LINK_NODES = 160, 3


def link_problem(seed=0):
    """An index, and two responses with scatter: a ramp and whether it is positive."""
    generator = np.random.default_rng([1981, seed])
    index = generator.standard_normal((LINK_SAMPLES, LINK_NODES))
    latent = index - 0.3 + 0.4 * generator.standard_normal(index.shape)
    return index, np.stack([np.maximum(latent, 0.0), latent > 0])


def test_means_of_hats_are_second_differences_of_the_mean_of_a_ramp():
    """E(t - c)^+ = phi(c) - c Phi(-c); straight beyond the knots, all add up to 1 and to t."""
    knots = np.linspace(-2.0, 2.0, 9)
    ramp = np.exp(-(knots**2) / 2) / np.sqrt(2 * np.pi) - knots * ndtr(-knots)
    moments = hermite_moments(tuple(knots), 2)
    # A midpoint rule errs by step^2 / 24 times a jump of slope, 2 at a hat's top: 3e-7 times the density
    np.testing.assert_allclose(moments[0, 2:-2], np.diff(ramp, 2)[1:-1] / 0.5, rtol=0, atol=3e-7)
    np.testing.assert_allclose(moments @ np.ones(9), [1, 0, 0], rtol=0, atol=1e-10)
    np.testing.assert_allclose(moments @ knots, [0, 1, 0], rtol=0, atol=1e-10)


def test_what_is_linear_between_knots_is_found_exactly():
    index, _ = link_problem()
    knots = knots_for(LINK_SAMPLES)
    values = np.random.default_rng(3).standard_normal((2, len(knots), LINK_NODES))
    truth = Link(knots, values)
    link, control = fit_link(index, truth(index), knots)
    np.testing.assert_allclose(link.values, values, rtol=0, atol=1e-9)
    np.testing.assert_allclose(control.mean, truth.hermite(0)[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(control.deviation, 0.0, rtol=0, atol=1e-8)
    np.testing.assert_allclose(link(knots[:, None] * np.ones(LINK_NODES)), link.values, rtol=0, atol=1e-12)


def test_each_sample_is_left_out_of_its_own_control():
    """Against refits without it."""
    index, responses = link_problem()
    knots = knots_for(LINK_SAMPLES)
    _, control = fit_link(index, responses, knots)
    terms = np.empty(responses.shape)
    for k in range(LINK_SAMPLES):
        link, _ = fit_link(np.delete(index, k, axis=0), np.delete(responses, k, axis=1), knots)
        terms[:, k] = responses[:, k] - link(index[k]) + link.hermite(0)[:, 0]
    np.testing.assert_allclose(control.mean, terms.mean(axis=1), rtol=1e-9)
    # Its deviation leaves E h_k where E h is: that moves by the sample's own weight in it alone
    left = terms - terms.mean(axis=1, keepdims=True)
    np.testing.assert_allclose(control.deviation, left, rtol=0, atol=1e-9)


def test_what_cannot_be_fitted_is_refused():
    index, responses = link_problem()
    knots = knots_for(LINK_SAMPLES)
    with pytest.raises(IllPosedError, match="between two of 6 knots"):
        fit_link(np.abs(index), responses, knots)
    with pytest.raises(ParameterError, match="do not match"):
        fit_link(index[:-1], responses, knots)
    index[3, 1] = np.nan
    with pytest.raises(ParameterError, match="finite"):
        fit_link(index, responses, knots)


def test_functions_of_one_direction_are_expansions_in_one_rotated_variable():
    """Node by node as the indices behind a rotated variable, of a cubic of mixed coefficients; all modes are all."""
    generator = np.random.default_rng(8)
    direction = generator.standard_normal((4, 3))
    direction /= np.linalg.norm(direction, axis=0)
    coefficients = generator.standard_normal((4, 3))
    sensitivity = sensitivity_along(direction, coefficients)
    for node in range(3):
        known = sobol_indices(multi_indices(1, 3), coefficients[:, node], direction[:, node][None])
        np.testing.assert_allclose(np.stack(sensitivity)[..., node], known, rtol=1e-9)
    np.testing.assert_allclose(share_of_modes(direction, coefficients, 4), 1.0, rtol=1e-12)
    np.testing.assert_allclose(share_of_modes(direction, coefficients, 1), sensitivity[0][0], rtol=1e-12)
    squares = direction[0] ** 2 + direction[1] ** 2  # of He_2 alone: their share of d, squared
    np.testing.assert_allclose(share_of_modes(direction, np.eye(4)[:, [2, 2, 2]], 2), squares**2, rtol=1e-12)
    with pytest.raises(ParameterError, match="unit length"):
        sensitivity_along(2 * direction, coefficients)
    with pytest.raises(IllPosedError, match="constant"):
        sensitivity_along(direction, np.eye(4)[:, [0, 0, 0]])
