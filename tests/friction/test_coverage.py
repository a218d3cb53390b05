"""Coverage of 95 % intervals: one harness, a row for each statistic of strips whose law is known."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.friction.correlation import autocorrelation
from roughslip.friction.marginal import distance_to_beta
from roughslip.friction.table import POSITIVE, bootstrap, combine
from roughslip.friction.windows import estimate_of, strip_weights, window_statistics
from tests.friction.test_windows import autoregressive

REPETITIONS = 200
NORMAL, BETA = stats.norm(1.0, 0.1), stats.beta(2.0, 5.0, loc=0.2, scale=0.3)


def moments(law, rng):
    """20 strips of correlated windows of a law, by translation."""
    grid = np.linspace(-6.0, 6.0, 2001)
    mu = np.interp(autoregressive(rng, 20, 20, 0.8), grid, law.ppf(stats.norm.cdf(grid)))
    return vars(window_statistics(mu, np.ones(mu.shape, bool), strip_weights(20, 200, rng)))


def with_control(rng):
    """80 solved strips, and 800 more of a control with another mean and a correlation of 0.95."""
    control, own, rho = autoregressive(rng, 880, 20, 0.8), autoregressive(rng, 80, 20, 0.8), 0.95
    mu = 0.3 + 0.03 * (rho * control[:80] + math.sqrt(1 - rho**2) * own)
    valid = np.ones(control.shape, bool)
    weights = strip_weights(80, 200, rng), strip_weights(800, 200, rng)
    rows, _ = combine(bootstrap(mu, valid[:80], weights[0]), (0.29 + 0.027 * control, valid), weights)
    return {name: estimate_of(name, np.exp(rows[name]), 80) for name in POSITIVE}


def curve(rng):
    mu = 1.0 + 0.1 * autoregressive(rng, 50, 12, 0.8)
    return {"curve": autocorrelation(mu, np.ones(mu.shape, bool), 4, strip_weights(50, 100, rng))}


def distance(rng):
    mu = 5.0 + rng.beta(2.1, 5.0, (40, 10))
    return {"distance": distance_to_beta(mu, np.ones(mu.shape, bool), strip_weights(40, 100, rng))}


def of(law):
    skewness, kurtosis = law.stats("sk")
    scale = {"mean": (law.mean(), 0.93), "std": (law.std(), 0.92), "variation": (law.std() / law.mean(), 0.92)}
    return scale | {"skewness": (skewness, 0.94), "kurtosis": (kurtosis, 0.90)}


ROWS = {  # draw and estimate; by name the truth, and the least share of intervals that hold it
    "moments, normal": (lambda rng: moments(NORMAL, rng), of(NORMAL)),
    "moments, Beta": (lambda rng: moments(BETA, rng), of(BETA)),
    "control": (with_control, {"mean": (0.3, 0.92), "std": (0.03, 0.92)}),
    # 0.9 for the skewness of replicates and the bias by the mean, of order 1 / sqrt(50)
    "autocorrelation": (curve, {"curve": (0.8 ** np.arange(4), 0.90)}),
    # conservative by the triangle inequality; 100 replicates and 40 strips take some 3 % of 95 %
    "distance of a Beta": (distance, {"distance": (0.0, 0.92)}),
}


@pytest.mark.nightly
@pytest.mark.parametrize("row", ROWS)
def test_intervals_hold_the_truth_as_often_as_they_say(row):
    """The least count of hits has a probability of 5e-4 where the share is as stated."""
    draw, truths = ROWS[row]
    hits = {name: np.zeros(np.shape(truth)) for name, (truth, _) in truths.items()}
    for k in range(REPETITIONS):
        found = draw(np.random.default_rng([7, list(ROWS).index(row), k]))
        for name, (truth, _) in truths.items():
            hits[name] += (found[name].low <= truth) & (truth <= found[name].high)
    for name, (_, level) in truths.items():
        assert np.min(hits[name]) >= stats.binom.ppf(5e-4, REPETITIONS, level), (name, hits)
