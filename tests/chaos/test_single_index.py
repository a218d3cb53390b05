"""Links: piecewise linear functions of a standard normal index, and the expectations that they give."""

import numpy as np
import pytest
from scipy.special import ndtr

from roughslip.chaos.single_index import KNOTS, LEAST_SAMPLES, TAIL, Link, fit_link, hermite_moments, knots_for
from roughslip.errors import IllPosedError, ParameterError

SAMPLES, NODES = 160, 3


def problem(seed=0):
    """An index, and two responses with scatter: a ramp and whether it is positive."""
    generator = np.random.default_rng([1981, seed])
    index = generator.standard_normal((SAMPLES, NODES))
    latent = index - 0.3 + 0.4 * generator.standard_normal(index.shape)
    return index, np.stack([np.maximum(latent, 0.0), latent > 0])


def test_as_many_samples_as_said_lie_beyond_the_last_knot():
    knots = knots_for(1000)
    assert len(knots) == KNOTS
    assert len(knots_for(LEAST_SAMPLES)) == 4
    np.testing.assert_allclose([ndtr(knots[0]), ndtr(-knots[-1])], TAIL / 1000)
    with pytest.raises(IllPosedError, match=f"takes {LEAST_SAMPLES}"):
        knots_for(LEAST_SAMPLES - 1)


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
    index, _ = problem()
    knots = knots_for(SAMPLES)
    values = np.random.default_rng(3).standard_normal((2, len(knots), NODES))
    truth = Link(knots, values)
    link, control = fit_link(index, truth(index), knots)
    np.testing.assert_allclose(link.values, values, rtol=0, atol=1e-9)
    np.testing.assert_allclose(control.mean, truth.hermite(0)[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(control.deviation, 0.0, rtol=0, atol=1e-8)
    np.testing.assert_allclose(link(knots[:, None] * np.ones(NODES)), link.values, rtol=0, atol=1e-12)


def test_each_sample_is_left_out_of_its_own_control():
    """Against refits without it."""
    index, responses = problem()
    knots = knots_for(SAMPLES)
    _, control = fit_link(index, responses, knots)
    terms = np.empty(responses.shape)
    for k in range(SAMPLES):
        link, _ = fit_link(np.delete(index, k, axis=0), np.delete(responses, k, axis=1), knots)
        terms[:, k] = responses[:, k] - link(index[k]) + link.hermite(0)[:, 0]
    np.testing.assert_allclose(control.mean, terms.mean(axis=1), rtol=1e-9)
    # Its deviation leaves E h_k where E h is: that moves by the sample's own weight in it alone
    left = terms - terms.mean(axis=1, keepdims=True)
    np.testing.assert_allclose(control.deviation, left, rtol=0, atol=1e-9)


def test_what_cannot_be_fitted_is_refused():
    index, responses = problem()
    knots = knots_for(SAMPLES)
    with pytest.raises(IllPosedError, match="between two knots"):
        fit_link(np.abs(index), responses, knots)
    with pytest.raises(ParameterError, match="do not match"):
        fit_link(index[:-1], responses, knots)
    index[3, 1] = np.nan
    with pytest.raises(ParameterError, match="finite"):
        fit_link(index, responses, knots)
