"""Windows: sums, friction coefficient, textbook statistics, intervals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from roughslip.errors import IllPosedError
from roughslip.friction.correlation import autocorrelation
from roughslip.friction.marginal import distance_to_beta
from roughslip.friction.windows import (
    friction_coefficient,
    ratio_of_sums,
    strip_weights,
    window_statistics,
    window_sums,
)

ROUNDING = 2.0**-53


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    columns=st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=1, max_size=40),
    window=st.integers(1, 40),
    stride=st.integers(1, 45),
)
def test_window_sums_are_the_plain_sums_within_the_stated_error(columns: list[float], window: int, stride: int) -> None:
    window = min(window, len(columns))
    sums = window_sums(np.array(columns), window, stride)
    exact = [math.fsum(columns[i : i + window]) for i in range(0, len(columns) - window + 1, stride)]
    assert len(sums) == len(exact)
    # the stated bound, and fsum's own last rounding
    bound = (window + 1) * ROUNDING * math.fsum(map(abs, columns)) * (1 + 1e-9)
    assert np.all(np.abs(sums - exact) <= bound + ROUNDING * np.abs(exact))
    behind = window_sums(np.concatenate((np.full(10, 1e9 / 3.0), np.zeros(10))), 5, 1)
    assert np.all(behind[10:] == 0.0)  # windows without contact sum to exactly zero behind heavy ones


def test_windows_below_the_least_area_are_marked_and_never_nan() -> None:
    area, force = np.array([[0.0, 0.5, 1.0], [2.0, 0.0, 0.999]]), np.array([[0.0, 1e-300, 1.0], [4.0, 0.0, 1.0]])
    mu, valid = friction_coefficient(area, force, 1.0, 1.0)
    assert valid.tolist() == [[False, False, True], [True, False, False]]
    assert mu.tolist() == [[0.0, 0.0, 1.0], [0.5, 0.0, 0.0]]
    # areas over forces count windows without mu; replicates can only be the first strip, the second, or both
    area, force = np.array([[1.0, 2.0, 0.0], [3.0, 0.5, 0.5]]), np.array([[2.0, 2.0, 0.0], [2.0, 1.0, 1.0]])
    ratio = ratio_of_sums(area, force, 4.0, strip_weights(2, 40, np.random.default_rng(1)))
    assert ratio.value == pytest.approx(4.0 * 7.0 / 8.0, rel=1e-15)
    assert set(np.round(ratio.replicates, 12)) == {3.0, 3.5, 4.0}


def autoregressive(rng: np.random.Generator, strips: int, windows: int, factor: float) -> np.ndarray:
    """Stationary Gaussian strips (strips, windows) of unit variance with correlation factor^lag."""
    x = rng.standard_normal((strips, windows))
    for k in range(1, windows):
        x[:, k] = factor * x[:, k - 1] + math.sqrt(1.0 - factor**2) * x[:, k]
    return x


def skewed_windows(seed: int, strips: int = 12, windows: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """mu with scatter between and within strips, and a tenth of the windows without mu."""
    rng = np.random.default_rng(seed)
    mu = 0.3 + 0.02 * np.exp(0.5 * autoregressive(rng, strips, windows, 0.8))
    valid = rng.random(mu.shape) > 0.1
    return np.where(valid, mu, 0.0), valid


def test_every_replicate_is_the_textbook_statistic_of_the_windows_it_counts() -> None:
    mu, valid = skewed_windows(2)
    rng = np.random.default_rng(5)
    weights = strip_weights(len(mu), 40, rng)
    area = mu * (force := 1.0 + rng.random(mu.shape))
    found = vars(window_statistics(mu, valid, weights)) | {"ratio": ratio_of_sums(area, force, 2.0, weights)}
    for row in (0, 1, 18, 40):
        strips = np.repeat(np.arange(len(mu)), weights[row])
        x = mu[strips][valid[strips]]
        expected = {
            "mean": np.mean(x),
            "std": np.std(x),
            "variation": np.std(x) / np.mean(x),
            "skewness": stats.skew(x),
            "kurtosis": stats.kurtosis(x),
            "missing_share": np.mean(~valid[strips]),
            "ratio": 2.0 * area[strips].sum() / force[strips].sum(),
        }
        for name, value in expected.items():
            assert found[name].rows[row] == pytest.approx(value, rel=1e-10, abs=1e-13), name


def test_strips_too_few_or_without_scatter_are_ill_posed() -> None:
    mu, valid = skewed_windows(4)
    weights = strip_weights(len(mu), 40, np.random.default_rng(2))
    with pytest.raises(IllPosedError, match="no scatter"):
        window_statistics(np.full(mu.shape, 0.2), valid, weights)
    alone = valid.copy()
    alone[1:] = False
    # two strips in contact of twelve: a replicate misses both with probability (10/12)^12 = 0.11
    alone[1] = valid[1]
    with pytest.raises(IllPosedError, match="deepen the penetration"):
        window_statistics(mu, alone, weights)


def test_scatter_that_is_rounding_of_a_far_mean_is_none() -> None:
    """A strip without scatter, and a strip with one outlier.

    In a replicate of the first strip alone, moments about the mean of all leave rounding of 1e-16 of the distance
    squared, which is far above 1e-10 of the mean.
    """
    valid, weights = np.ones((2, 28), dtype=bool), strip_weights(2, 40, np.random.default_rng(3))
    for height, outlier in np.random.default_rng(4).uniform(1.0, 5.0, (8, 2)):
        mu = np.full(valid.shape, height)
        mu[1, 7] *= outlier
        for call in (window_statistics, distance_to_beta, lambda *parts: autocorrelation(*parts[:2], 6, parts[2])):
            with pytest.raises(IllPosedError, match="no scatter"):
                call(mu, valid, weights)
