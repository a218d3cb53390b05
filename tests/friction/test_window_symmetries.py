"""Windows in another unit, order or direction have the same friction: every statistic of them goes with it."""

import numpy as np
import pytest

from roughslip.friction.description import describe
from roughslip.friction.statistics import strip_weights

STRIPS, WINDOWS, SPACING, WINDOW = 14, 12, 15e-6, 60e-6
RNG = np.random.default_rng(8)
MU = 0.3 * np.exp(0.2 * np.cumsum(RNG.standard_normal((STRIPS, WINDOWS + 4)), axis=1)[:, 4:] / 2.0)
VALID = RNG.random(MU.shape) < 0.9
WEIGHTS = strip_weights(STRIPS, 60, RNG)
LAGS = SPACING * np.arange(WINDOWS)
SCALE, METRE = 2.0**-3, 2.0**10  # of mu, and of lengths: powers of two, so that rounding is the same
IN_MU = (
    "mean",
    "std",
    "quantiles",
    *(f"{beta}_{end}" for beta in ("beta", "scaled_beta") for end in ("lower", "upper")),
)


def described(mu=MU, valid=VALID, weights=WEIGHTS, metre=1.0):
    found = describe((mu, valid), weights, metre * LAGS, metre * WINDOW, np.random.default_rng(2))
    assert len(found) == 29
    return found


def is_same(found, expected, factor=lambda name: 1.0, without=()):
    for name, estimate in expected.items():
        if name.startswith(without):
            continue
        for part in ("value", "low", "high", "replicates"):
            one, other = getattr(found[name], part), factor(name) * getattr(estimate, part)
            np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-7 * factor(name), err_msg=f"{name} {part}")


@pytest.fixture(scope="module")
def plain():
    return described()


def test_in_other_units(plain):
    """A shear strength scales mu; lengths of the autocorrelation are those of the lags."""
    is_same(described(SCALE * MU), plain, lambda name: SCALE if name in IN_MU else 1.0)
    is_same(described(metre=METRE), plain, lambda name: METRE if name.startswith("length_") else 1.0)


def test_in_another_order_of_strips(plain):
    """Sets of windows are drawn by their place, so theirs change."""
    order = np.random.default_rng(4).permutation(STRIPS)
    is_same(described(MU[order], VALID[order], WEIGHTS[:, order]), plain, without=("set_beta",))


def test_in_the_other_direction(plain):
    is_same(described(MU[:, ::-1].copy(), VALID[:, ::-1].copy()), plain, without=("set_beta",))
    # what a strip that counts twice gives, two of it give
    twice = np.concatenate((MU, MU)), np.concatenate((VALID, VALID)), np.concatenate((WEIGHTS, 0 * WEIGHTS), axis=1)
    twice[2][0] = 1
    found = described(*twice)
    for name in ("mean", "std", "skewness", "quantiles", "autocorrelation", "beta_a", "scaled_beta_b"):
        np.testing.assert_allclose(found[name].value, plain[name].value, rtol=1e-6)
        np.testing.assert_allclose(found[name].replicates, plain[name].replicates, rtol=1e-6, atol=1e-7)


def test_mirrored_about_a_value(plain):
    """1 - mu is as far below as mu is above: odd moments change their sign, and quantiles and Beta shapes places."""
    found = described(1.0 - MU)
    for name, other, sign, start in (
        ("mean", "mean", -1.0, 1.0), ("std", "std", 1.0, 0.0), ("skewness", "skewness", -1.0, 0.0),
        ("kurtosis", "kurtosis", 1.0, 0.0), ("scaled_beta_a", "scaled_beta_b", 1.0, 0.0),
        ("scaled_beta_b", "scaled_beta_a", 1.0, 0.0), ("scaled_beta_lower", "scaled_beta_upper", -1.0, 1.0),
        ("effective_windows", "effective_windows", 1.0, 0.0), ("autocorrelation", "autocorrelation", 1.0, 0.0),
        ("length_one_over_e", "length_one_over_e", 1.0, 0.0), ("missing_share", "missing_share", 1.0, 0.0),
    ):  # fmt: skip
        np.testing.assert_allclose(found[name].rows, start + sign * plain[other].rows, rtol=1e-6, atol=1e-8)
    for name, other in (("beta_a", "beta_b"), ("beta_misfit", "beta_misfit")):  # on a table of quantiles of the sample
        np.testing.assert_allclose(found[name].value, plain[other].value, rtol=0.05)
