"""Distribution of mu: fits of the Beta, the scaling of the paper, the distance from its Beta."""

import math

import numpy as np
import pytest
from scipy import special, stats

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.marginal import (
    SET_WINDOWS,
    SHAPES,
    distance_to_beta,
    fit_beta,
    nearest_level,
    set_beta,
    standard_quantiles,
)
from roughslip.friction.statistics import strip_weights
from roughslip.probability import beta_moments

STRIPS, WINDOWS = 20, 50
# 1000 = 200 * 5 with 5 odd: the empirical quantiles of these at (j - 1/2) / 200 are the exact ones
PROBABILITIES = (np.arange(STRIPS * WINDOWS) + 0.5) / (STRIPS * WINDOWS)


def windows(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values dealt to strips in turn, so that strips are alike."""
    mu = np.ascontiguousarray(values.reshape(WINDOWS, STRIPS).T)
    return mu, np.ones(mu.shape, bool)


def weights(strips: int = STRIPS, replicates: int = 40, seed: int = 0) -> np.ndarray:
    return strip_weights(strips, replicates, np.random.default_rng(seed))


@pytest.mark.parametrize(("a", "b"), [(2.1, 5.0), (0.6, 3.0), (1.0, 1.0), (30.0, 12.0)])
def test_exact_quantiles_give_their_beta_back(a: float, b: float) -> None:
    mu, valid = windows(0.2 + 0.3 * special.betaincinv(a, b, PROBABILITIES))
    fit = fit_beta(mu, valid, weights())
    # the trust region stops at steps of 1e-10; along the valley of nearly equal fits (30, 12) some digits less
    assert fit.a.value == pytest.approx(a, rel=1e-5)
    assert fit.b.value == pytest.approx(b, rel=1e-5)
    assert fit.lower.value == pytest.approx(0.2, abs=1e-6)
    assert fit.upper.value == pytest.approx(0.5, abs=1e-6)
    assert fit.distance.value < 1e-6
    assert not fit.at_bound


def test_random_windows_give_their_beta_within_the_spread_of_replicates() -> None:
    rng = np.random.default_rng(1)
    mu = 0.2 + 0.3 * rng.beta(2.1, 5.0, (200, 50))
    fit = fit_beta(mu, np.ones(mu.shape, bool), weights(200, 100))
    for e, true in ((fit.a, 2.1), (fit.b, 5.0)):
        error = np.std(np.log(e.replicates))
        # 10 000 independent windows: Fisher's information gives 0.06 for log a and 0.09 for log b in four parameters
        assert 0.02 < error < 0.2
        assert abs(math.log(e.value / true)) < 4 * error
        # the table's interpolation must not shift replicates: their median is known to 1.25 error / 10
        assert abs(np.median(np.log(e.replicates)) - math.log(e.value)) < 0.5 * error
    assert abs(fit.lower.value - 0.2) < 4 * np.std(fit.lower.replicates)
    assert abs(fit.upper.value - 0.5) < 4 * np.std(fit.upper.replicates)
    assert fit.distance.low == 0.0


def test_fit_moves_with_the_unit_and_swaps_shapes_in_the_mirror() -> None:
    rng = np.random.default_rng(2)
    mu, valid = windows(np.sort(rng.gamma(3.0, 0.05, STRIPS * WINDOWS) + rng.random(STRIPS * WINDOWS)))
    fit, moved, mirror = (fit_beta(m, valid, weights()) for m in (mu, 3.0 + 0.01 * mu, 5.0 - mu))
    # three least-squares runs, each to 1e-10 in log shapes; the valley takes some digits
    for name, other in (("a", "b"), ("b", "a")):
        value = getattr(fit, name).value
        assert getattr(moved, name).value == pytest.approx(value, rel=1e-6)
        assert getattr(mirror, other).value == pytest.approx(value, rel=1e-6)
    assert moved.lower.value == pytest.approx(3.0 + 0.01 * fit.lower.value, rel=1e-8)
    assert mirror.upper.value == pytest.approx(5.0 - fit.lower.value, rel=1e-6)
    assert moved.distance.value == pytest.approx(fit.distance.value, rel=1e-6)


def test_replicates_are_fits_to_the_resampled_strips_within_the_table() -> None:
    rng = np.random.default_rng(3)
    mu = 0.2 + 0.3 * rng.beta(2.1, 5.0, (STRIPS, WINDOWS))
    valid = rng.random(mu.shape) > 0.1
    w = weights(seed=4)
    fit, distance = (f(mu, valid, w) for f in (fit_beta, distance_to_beta))
    for r in range(8):
        strips = np.repeat(np.arange(STRIPS), w[1 + r])
        again = fit_beta(mu[strips], valid[strips], w)
        # the table's mesh is 0.7 % of a shape; across the oblique valley two or three meshes
        assert fit.a.replicates[r] == pytest.approx(float(again.a.value), rel=0.02)
        assert fit.b.replicates[r] == pytest.approx(float(again.b.value), rel=0.02)
        # a misfit near its least value changes in second order
        assert fit.distance.replicates[r] == pytest.approx(float(again.distance.value), rel=1e-3)
        far = distance_to_beta(mu[strips], valid[strips], w)
        # a node may fall on a window: one window more or less
        assert distance.replicates[r] == pytest.approx(float(far.value), abs=2e-3)


@pytest.mark.parametrize("quantiles", [special.ndtri(PROBABILITIES), special.gammaincinv(3.0, PROBABILITIES)])
def test_limits_of_the_beta_family_are_flagged_not_refused(quantiles: np.ndarray) -> None:
    mu, valid = windows(5.0 + quantiles)
    fit = fit_beta(mu, valid, weights())
    assert fit.at_bound
    assert max(fit.a.value, fit.b.value) == pytest.approx(SHAPES[1], rel=1e-3)
    assert np.isfinite(fit.upper.high)


def test_every_replicate_has_its_own_centre_and_spread() -> None:
    """Strips of different means, so that replicates have different centres."""
    mu = 0.3 + 0.1 * np.random.default_rng(9).random((6, 1)) + 0.01 * np.random.default_rng(10).random((6, 9))
    standard, centre, _ = standard_quantiles(mu, np.ones(mu.shape, bool), weights(6))
    assert np.ptp(centre) > 0.01
    np.testing.assert_allclose(standard.mean(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.mean(standard**2, axis=1), 1.0, rtol=1e-12)


def test_distance_of_the_beta_to_itself_and_to_a_normal() -> None:
    mu, valid = windows(0.3 + 0.2 * special.betaincinv(2.1, 5.0, PROBABILITIES))
    own = distance_to_beta(mu, valid, weights())
    # steps of 1/1000, and a standard deviation of midpoints that is 3e-4 low
    assert own.value <= 1.5e-3
    mean, std, _, _ = beta_moments(2.1, 5.0)
    z = np.linspace(-4.0, 4.0, 100_001)
    exact = np.max(np.abs(special.ndtr(z) - stats.beta.cdf(mean + std * z, 2.1, 5.0)))
    mu, valid = windows(5.0 + special.ndtri(PROBABILITIES))
    # 0.001 from the nodes, 1/2000 from the steps, and 0.2 % in the standard deviation
    assert distance_to_beta(mu, valid, weights()).value == pytest.approx(exact, abs=1.5e-3)
    mean, std, _, _ = beta_moments(3.0, 2.0)
    exact = np.max(np.abs(special.ndtr(z) - stats.beta.cdf(mean + std * z, 3.0, 2.0)))
    assert distance_to_beta(mu, valid, weights(), 3.0, 2.0).value == pytest.approx(exact, abs=1.5e-3)


def test_faults_are_refused() -> None:
    mu, valid = windows(PROBABILITIES)
    same = np.full(mu.shape, 0.3)
    for f in (fit_beta, distance_to_beta):
        with pytest.raises(IllPosedError, match="no scatter"):
            f(same, valid, weights())
    with pytest.raises(ParameterError, match="a shape of a Beta"):
        distance_to_beta(mu, valid, weights(), 0.0, 5.0)


def test_shapes_of_sets_are_larger_the_more_windows_a_set_has():
    """The extremes of n uniform numbers miss 1 / (n + 1) of the range on either side, those of normal ones grow with n.

    Uniform: scaled they are near Beta(1, 1), less 7 / n for the two that lie on the ends.
    Normal: (range / std)^2 / 4 is about 2 a + 1, and the range of
    100 is 5.0 standard deviations, of 1000 it is 6.5.
    """
    rng = np.random.default_rng(4)
    valid = np.ones((200, 100), dtype=bool)
    for shape in set_beta(0.3 + 0.1 * rng.random((200, 100)), valid, np.random.default_rng(1)):
        assert shape.low < shape.value < shape.high
        assert shape.value == pytest.approx(1.0 - 7 / SET_WINDOWS, abs=0.02)
    mu = 0.3 + 0.01 * rng.standard_normal((200, 100))
    shapes = []
    for windows_of_a_set, range_of_it in ((100, 5.015), (1000, 6.483)):
        for shape in set_beta(mu, valid, np.random.default_rng(1), windows_of_a_set):
            assert 2 * shape.value + 1 == pytest.approx(range_of_it**2 / 4, rel=0.12)
            shapes.append(float(shape.value))
    assert min(shapes[2:]) > max(shapes[:2])
    with pytest.raises(IllPosedError, match="no scatter in a set"):
        set_beta(np.full((2, 3), 0.3), np.ones((2, 3), dtype=bool), rng)


def test_the_nearest_level_is_as_skewed_as_the_paper_where_one_is():
    """Beta(2.1, 5) has the skewness 0.56, and 0.28 to 0.84 are as skewed."""
    distance, every = np.array([0.05, 0.02, 0.04]), np.ones(3, dtype=bool)
    assert nearest_level(distance, np.array([0.5, 0.1, 0.6]), every) == 2
    assert nearest_level(distance, np.array([0.1, 0.1, 0.1]), every) == 1
    assert nearest_level(distance, np.array([0.5, 0.1, 0.6]), np.array([True, True, False])) == 0
