"""Contact probability and mean pressure given a prediction: closed forms of a normal scatter, and its vanishing."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from roughslip.chaos.conditional import PLACES, conditional_means
from roughslip.chaos.pressure import PressureTarget
from roughslip.errors import IllPosedError, ParameterError

SAMPLES = 40_000
TRIAL = PressureTarget("trial_pressure", 1.0)
SQUARED = PressureTarget("squared_pressure", 1.0, 0.6)
PLACES_SEEN = np.linspace(-1.0, 2.0, 13)


def deviation(s):
    """Of the target around its prediction; it grows with the prediction."""
    return 0.2 + 0.1 * (s + 2.0)


def samples(seed, scale=1.0):
    rng = np.random.default_rng(seed)
    s = rng.uniform(-2.0, 3.0, (2, SAMPLES))
    return s, s + scale * deviation(s) * rng.standard_normal(s.shape)


@pytest.mark.parametrize("target", [TRIAL, SQUARED], ids=lambda target: target.kind)
def test_tables_are_the_expectations_of_a_normal_scatter_that_grows(target):
    """P = Phi(s / sd), E[p] = int p(s + sd z) phi(z) dz, for the trial pressure s Phi + sd phi. Each law comes from 4 %
    of the samples near s, 1300 of a span of 0.2, over which the deviation changes by 5 % at most: four standard errors
    of a share and of a mean, and a hundredth for that and the 200 draws."""
    means = conditional_means(*samples(1), target)
    contact, pressure = means.at(np.tile(PLACES_SEEN, (2, 1)))
    for k, s in enumerate(PLACES_SEEN):
        sd, share = deviation(s), norm.cdf(s / deviation(s))
        expected = quad(lambda z: float(target.pressure(np.array(s + sd * z))) * norm.pdf(z), -s / sd, 8)[0]  # noqa: B023
        if target is TRIAL:
            assert expected == pytest.approx(s * share + sd * norm.pdf(s / sd), rel=1e-6)
        np.testing.assert_allclose(contact[:, k], share, atol=4 * np.sqrt(share * (1 - share) / 1300) + 0.01)
        np.testing.assert_allclose(pressure[:, k], expected, atol=4 * sd / np.sqrt(1300) + 0.01)


def test_without_scatter_they_are_those_of_the_prediction():
    """And so for a scatter that the places of the tables do not resolve."""
    for scale in (0.0, 0.004):
        means = conditional_means(*samples(2, scale), SQUARED)
        contact, pressure = means.at(np.tile(PLACES_SEEN, (2, 1)))
        assert np.array_equal(contact, np.tile(PLACES_SEEN > 0, (2, 1)))
        assert np.array_equal(pressure, np.tile(SQUARED.pressure(PLACES_SEEN), (2, 1)))
    resolved = conditional_means(*samples(2, 0.2), SQUARED)
    assert 0.2 < resolved.at(np.full((2, 1), 0.02))[0][0, 0] < 0.9


def test_beyond_the_samples_there_is_no_contact_or_that_of_the_largest_target():
    """A polynomial runs off beyond its samples; the largest target here is 3 and some deviations of 0.21."""
    s, values = samples(3, 0.3)
    contact, pressure = conditional_means(s, values, TRIAL).at(np.tile([-50.0, 3.0, 50.0], (2, 1)))
    np.testing.assert_array_equal(contact, [[0.0, 1.0, 1.0]] * 2)
    assert np.all(pressure[:, 0] == 0.0)
    # the last law has 1600 residuals, none of which it lies in the middle of: predictions over a span of 0.2
    np.testing.assert_allclose(pressure[:, 1:], 3.0, atol=0.05)
    near = conditional_means(s + 2.05, values + 2.05, TRIAL)  # contact at the least prediction too
    assert near.contact[0, 0] > 0.1
    assert np.all(near.at(np.full((2, 1), -50.0))[0] == 0.0)


def test_every_level_has_tables_of_its_own():
    s, values = samples(4)
    means = conditional_means(s, np.stack([values[0], values[1] + 1.0]), TRIAL)
    assert means.contact.shape == means.pressure.shape == (2, PLACES)
    contact, pressure = means.at(np.zeros((2, 3, 5)))
    assert contact.shape == pressure.shape == (2, 3, 5)
    np.testing.assert_allclose(contact[0], 0.5, atol=4 * 0.5 / np.sqrt(1300) + 0.01)
    np.testing.assert_allclose(contact[1], norm.cdf(1 / 0.4), atol=0.03)
    np.testing.assert_allclose(pressure[1], norm.cdf(2.5) + 0.4 * norm.pdf(2.5), atol=0.06)


def test_what_does_not_match_or_is_too_little_is_refused():
    s, values = samples(5)
    with pytest.raises(ParameterError, match="match"):
        conditional_means(s, values[:1], TRIAL)
    with pytest.raises(ParameterError, match="3 levels"):
        conditional_means(s, values, TRIAL).at(np.zeros((3, 4)))
    with pytest.raises(IllPosedError, match="too few"):
        conditional_means(s[:, :50], values[:, :50], TRIAL)
