"""Laws that are known, put through the statistics that feed the rules: each gets the verdict that it should."""

import numpy as np
import pytest
from scipy import stats

from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.marginal import distance_to_beta
from roughslip.friction.resampling import strip_weights
from roughslip.friction.statistics import window_statistics
from roughslip.oscillator.cycles import reattachment_statistics
from roughslip.verdicts.statements import VISIBLE
from tests.verdicts.claimed import LEVELS, friction, judge, oscillator, with_interval


def stationary(strips, windows, draw, seed):
    """Friction arrays of a known law in independent windows, through the statistics of the friction stage."""
    rng = np.random.default_rng([20110913, seed])
    mu, valid = 0.3 + 0.05 * draw(rng, (strips, windows)), np.ones((strips, windows), dtype=bool)
    weights = strip_weights(strips, 400, rng)
    distance = distance_to_beta(mu, valid, weights).standardised
    skewness = window_statistics(mu, valid, weights).skewness
    arrays = friction()
    for name, found in (("beta_distance_standardised", distance), ("skewness", skewness)):
        for suffix, part in (("", "value"), ("_low", "low"), ("_high", "high")):
            arrays[name + suffix] = np.full((2, LEVELS), float(getattr(found, part)))
    return judge(friction_=arrays)["mu-beta-2.1-5"]


def beta(rng, shape):
    return rng.beta(2.1, 5.0, shape)


def normal(rng, shape):
    return np.clip(rng.standard_normal(shape), -5.0, 5.0)


def test_beta_is_found_in_900_windows_and_never_claimed_from_30():
    """A sample of n windows lies 0.6 / sqrt(n) from its own distribution, and the bootstrap adds 0.9 / sqrt(n).

    The sum is 0.05 for 900 windows and 0.27 for 30. The skewness errs by 3.5 / sqrt(n), 0.12 or 0.6; 0.28 is allowed.
    """
    assert [stationary(225, 4, beta, seed)["verdict"] for seed in range(6)] == ["reproduced"] * 6
    few = [stationary(8, 4, beta, seed) for seed in range(6)]
    assert [claim["verdict"] for claim in few] == ["not reproduced"] * 6
    assert all("undecided" in claim["note"] for claim in few)


def test_a_normal_law_is_not_taken_for_the_beta():
    """It lies 0.052 from the standardised Beta(2.1, 5), less than a reader sees; its skewness distinguishes it."""
    u = np.linspace(-4.0, 4.0, 4001)
    mean, std = stats.beta.mean(2.1, 5.0), stats.beta.std(2.1, 5.0)
    apart = np.max(np.abs(stats.norm.cdf(u) - stats.beta.cdf(mean + std * u, 2.1, 5.0)))
    assert apart == pytest.approx(0.0518, abs=5e-4)
    assert apart < VISIBLE
    for seed in range(3):
        found = stationary(225, 16, normal, seed)
        assert found["interval"][1] < VISIBLE
        assert found["verdict"] == "not reproduced"
        assert "undecided" not in found["note"]


def along_strips(mu, spacing=15e-6, window=600e-6):
    weights = strip_weights(len(mu), 200, np.random.default_rng(5))
    valid = np.ones(mu.shape, dtype=bool)
    lags = spacing * np.arange(mu.shape[1])
    fit = correlation_fit(lags, autocorrelation(mu, valid, len(lags), weights), window)
    arrays = friction()
    for name, found in (("misfit_difference", fit.misfit_difference), ("length_least_squares", fit.least_squares)):
        for suffix, part in (("", "value"), ("_low", "low"), ("_high", "high")):
            arrays[name + suffix] = np.full((2, LEVELS), float(getattr(found, part)))
    found = judge(friction_=arrays)
    return found["mu-correlation-exponential"]["verdict"], found["mu-correlation-250um"]["verdict"]


def test_an_exponential_process_is_told_from_a_moving_average():
    """480 strips of 1.8 mm: an Ornstein-Uhlenbeck process of length 250 um, and white noise averaged over a window."""
    rng = np.random.default_rng(11)
    noise, step = rng.standard_normal((480, 121)), np.exp(-15 / 250)
    process = np.empty_like(noise)
    process[:, 0] = noise[:, 0]
    for k in range(1, 121):
        process[:, k] = step * process[:, k - 1] + np.sqrt(1 - step**2) * noise[:, k]
    assert along_strips(0.3 + 0.03 * process) == ("reproduced", "reproduced")
    sums = np.cumsum(rng.standard_normal((480, 161)), axis=1)
    assert along_strips(0.3 + 0.005 * (sums[:, 40:] - sums[:, :-40])) == ("not reproduced", "not reproduced")


def test_normal_reattachment_points_are_not_called_non_normal():
    """300 runs of 80 cycles: the distance is noise, 0.6 / sqrt(24000) = 0.004; a Gamma of shape 16 is 0.03 away."""
    owners = np.repeat(np.arange(300), 80)
    for draw, verdict in (
        (lambda rng: rng.normal(3e-3, 3e-4, 24_000), "not reproduced"),
        (lambda rng: 2e-4 * rng.gamma(16.0, size=24_000), "reproduced"),
    ):
        rng = np.random.default_rng(3)
        found = reattachment_statistics(draw(rng), owners, rng)
        arrays = oscillator()
        for name in ("distance_to_normal", "skewness", "kurtosis"):
            arrays |= with_interval(f"reattachment_{name}", *getattr(found, name))
        assert judge(oscillator_=arrays)["fig5-reattachment-nonnormal"]["verdict"] == verdict
