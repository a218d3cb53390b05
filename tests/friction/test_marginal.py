"""Distribution of mu: fits of the Beta, the scaling of the paper, the distance from its Beta."""

import numpy as np
import pytest
from scipy import special, stats

from roughslip.errors import IllPosedError
from roughslip.friction.marginal import SHAPES, distance_to_beta, fit_beta, set_beta
from roughslip.friction.windows import strip_weights
from roughslip.probability import beta_moments

STRIPS, WINDOWS = 20, 50
# 1000 = 200 * 5 with 5 odd: the empirical quantiles of these at (j - 1/2) / 200 are the exact ones
PROBABILITIES = (np.arange(STRIPS * WINDOWS) + 0.5) / (STRIPS * WINDOWS)
WEIGHTS = strip_weights(STRIPS, 40, np.random.default_rng(0))


def windows(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values dealt to strips in turn, so that strips are alike."""
    mu = np.ascontiguousarray(values.reshape(WINDOWS, STRIPS).T)
    return mu, np.ones(mu.shape, bool)


@pytest.mark.parametrize(("a", "b"), [(2.1, 5.0), (0.6, 3.0), (1.0, 1.0), (30.0, 12.0)])
def test_exact_quantiles_give_their_beta_back(a: float, b: float) -> None:
    """In any unit, and mirrored with the shapes in each other's place."""
    values = 0.2 + 0.3 * special.betaincinv(a, b, PROBABILITIES)
    fit, mirror = fit_beta(values), fit_beta(5e3 - 1e3 * values)
    # along the valley of nearly equal fits (30, 12) some digits are lost
    assert (fit.a, fit.b, fit.lower, fit.upper) == pytest.approx((a, b, 0.2, 0.5), rel=1e-5)
    assert (mirror.b, mirror.a, mirror.upper, mirror.lower) == pytest.approx((a, b, 4800.0, 4500.0), rel=1e-5)
    assert max(fit.distance, mirror.distance) < 1e-6
    assert not fit.at_bound
    # 10 000 independent windows: Fisher's information gives 0.06 for log a and 0.09 for log b in four parameters
    drawn = fit_beta(0.2 + 0.3 * np.random.default_rng(1).beta(2.1, 5.0, (200, 50)))
    assert np.log([drawn.a / 2.1, drawn.b / 5.0]) == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize("quantiles", [special.ndtri(PROBABILITIES), special.gammaincinv(3.0, PROBABILITIES)])
def test_limits_of_the_beta_family_are_flagged_not_refused(quantiles: np.ndarray) -> None:
    fit = fit_beta(5.0 + quantiles)
    assert fit.at_bound
    assert max(fit.a, fit.b) == pytest.approx(SHAPES[1], rel=1e-3)


def test_distance_of_the_beta_to_itself_and_to_a_normal() -> None:
    mu, valid = windows(0.3 + 0.2 * special.betaincinv(2.1, 5.0, PROBABILITIES))
    # steps of 1/1000, and a standard deviation of midpoints that is 3e-4 low
    assert distance_to_beta(mu, valid, WEIGHTS).value <= 1.5e-3
    mean, std, _, _ = beta_moments(2.1, 5.0)
    z = np.linspace(-4.0, 4.0, 100_001)
    exact = np.max(np.abs(special.ndtr(z) - stats.beta.cdf(mean + std * z, 2.1, 5.0)))
    mu, valid = windows(5.0 + special.ndtri(PROBABILITIES))
    # 0.001 from the nodes, 1/2000 from the steps, and 0.2 % in the standard deviation
    assert distance_to_beta(mu, valid, WEIGHTS).value == pytest.approx(exact, abs=1.5e-3)
    same = np.full(mu.shape, 0.3)
    for refused in (lambda: fit_beta(same), lambda: distance_to_beta(same, valid, WEIGHTS)):
        with pytest.raises(IllPosedError, match="no scatter"):
            refused()


def test_each_replicate_of_the_distance_is_that_of_the_strips_it_counts() -> None:
    rng = np.random.default_rng(3)
    mu = 0.2 + 0.3 * rng.beta(2.1, 5.0, (STRIPS, WINDOWS))
    valid = rng.random(mu.shape) > 0.1
    distance = distance_to_beta(mu, valid, WEIGHTS)
    for r in range(8):
        strips = np.repeat(np.arange(STRIPS), WEIGHTS[1 + r])
        far = distance_to_beta(mu[strips], valid[strips], WEIGHTS)
        # a node may fall on a window: one window more or less
        assert distance.replicates[r] == pytest.approx(float(far.value), abs=2e-3)


def test_shapes_of_sets_are_larger_the_more_windows_a_set_has():
    """The extremes of n uniform numbers miss 1 / (n + 1) of the range on either side, those of normal ones grow with n.

    Uniform: scaled they are near Beta(1, 1), less 7 / n for the two that lie on the ends.
    Normal: (range / std)^2 / 4 is about 2 a + 1, and the range of 50 is 4.5 standard deviations, of 200 it is 5.5.
    """
    rng, valid = np.random.default_rng(4), np.ones((200, 100), dtype=bool)
    uniform = set_beta(0.3 + 0.1 * rng.random((200, 100)), valid, (1,))
    normal = set_beta(0.3 + 0.01 * rng.standard_normal((200, 100)), valid, (1,))
    for shape in "ab":
        one = uniform[f"set_beta_{shape}_100"]
        assert one.low < one.value < one.high
        assert one.value == pytest.approx(1.0 - 7 / 100, abs=0.03)
        for windows, reach in ((50, 4.498), (200, 5.492)):
            assert 2 * normal[f"set_beta_{shape}_{windows}"].value + 1 == pytest.approx(reach**2 / 4, rel=0.12)
    with pytest.raises(IllPosedError, match="no scatter in a set"):
        set_beta(np.full((2, 3), 0.3), np.ones((2, 3), dtype=bool), (1,))
