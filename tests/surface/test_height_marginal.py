"""Marginals of heights: parametric, from moments, fitted and empirical."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from roughslip.errors import IllPosedError, ParameterError
from roughslip.surface.empirical import EmpiricalMarginal, empirical_marginal
from roughslip.surface.marginal import Marginal, fit, from_moments

UM = 1e-6
LAWS = [
    (Marginal("gaussian", UM), stats.norm()),
    (Marginal("beta", UM, (2.1, 5.0)), stats.beta(2.1, 5.0)),
    (Marginal("weibull", UM, (1.7,)), stats.weibull_min(1.7)),
    (Marginal("lognormal", UM, (0.4,)), stats.lognorm(0.4)),
]
PROBABILITIES = np.array([1e-12, 1e-5, 0.03, 0.5, 0.9, 1 - 1e-9])


def plateau(n, seed=1):
    law = Marginal("weibull", UM, (1.5,), mirrored=True)
    return law, law.from_gaussian(np.random.default_rng(seed).standard_normal(n))


@pytest.mark.parametrize(("marginal", "law"), LAWS, ids=lambda value: getattr(value, "family", None))
@pytest.mark.parametrize("mirrored", [False, True])
def test_laws_against_scipy(marginal, law, mirrored):
    sign = -1.0 if mirrored else 1.0
    marginal = Marginal(marginal.family, UM, marginal.shapes, mirrored)
    mean, variance, skewness, excess = (float(value) for value in law.stats("mvsk"))
    assert marginal.skewness == pytest.approx(sign * skewness, abs=1e-12)
    assert marginal.excess_kurtosis == pytest.approx(excess, rel=1e-10)
    x = law.isf(PROBABILITIES) if mirrored else law.ppf(PROBABILITIES)
    expected = sign * UM * (x - mean) / math.sqrt(variance)
    np.testing.assert_allclose(marginal.quantile(PROBABILITIES), expected, rtol=1e-7, atol=1e-12 * UM)
    np.testing.assert_allclose(marginal.cdf(marginal.quantile(PROBABILITIES)), PROBABILITIES, rtol=1e-4, atol=1e-15)


@pytest.mark.parametrize("marginal", [law for law, _ in LAWS], ids=lambda law: law.family)
def test_mean_is_zero_and_rms_as_asked(marginal):
    """Trapezoidal rule on a normal weight, exact to rounding for smooth transformations."""
    g = np.linspace(-8.5, 8.5, 4097)
    weight = np.exp(-(g**2) / 2) * (g[1] - g[0]) / math.sqrt(2 * math.pi)
    z = marginal.from_gaussian(g) / UM
    moments = [float(weight @ z**n) for n in (1, 2, 3, 4)]
    expected = [0.0, 1.0, marginal.skewness, 3.0 + marginal.excess_kurtosis]
    np.testing.assert_allclose(moments, expected, atol=1e-10)
    assert np.all(np.diff(z) > 0.0)


def test_the_paper_s_beta_is_platykurtic():
    law = Marginal("beta", 1.0, (2.1, 5.0))
    assert law.skewness == pytest.approx(0.560, abs=5e-4)
    assert law.excess_kurtosis == pytest.approx(-0.171, abs=5e-4)


def test_bounds_hold():
    law = Marginal("weibull", 1.0, (1.5,), mirrored=True)  # a plateau: nothing above its mean below the top
    top = math.gamma(1 + 1 / 1.5) / math.sqrt(math.gamma(1 + 2 / 1.5) - math.gamma(1 + 1 / 1.5) ** 2)
    assert law.from_gaussian(np.array([30.0])) == pytest.approx(top, rel=1e-12)
    np.testing.assert_array_equal(law.cdf(np.array([top + 1e-9, math.inf, -math.inf])), [1.0, 1.0, 0.0])


@settings(derandomize=True, max_examples=40, deadline=None)
@given(st.floats(0.3, 40.0), st.floats(0.3, 40.0))
def test_beta_from_its_moments(a, b):
    law = Marginal("beta", UM, (a, b))
    found = from_moments("beta", UM, law.skewness, law.excess_kurtosis)
    np.testing.assert_allclose(found.shapes, (a, b), rtol=1e-6)


@settings(derandomize=True, max_examples=40, deadline=None)
@given(st.sampled_from(["weibull", "lognormal"]), st.floats(0.07, 30.0), st.booleans())
def test_one_shape_from_the_skewness(family, skewness, mirrored):
    skewness = -skewness if mirrored else skewness
    law = from_moments(family, UM, skewness, 0.0)
    assert law.mirrored == mirrored
    assert law.skewness == pytest.approx(skewness, rel=1e-8)


def test_symmetric_heights():
    assert from_moments("weibull", UM, 0.0, 0.0).skewness == pytest.approx(0.0, abs=1e-12)
    a, b = from_moments("beta", UM, 0.0, -1.2).shapes
    assert (a, b) == pytest.approx((1.0, 1.0))
    assert from_moments("gaussian", UM, 0.4, 0.1) == Marginal("gaussian", UM)


@pytest.mark.parametrize(
    ("family", "skewness", "excess", "message"),
    [
        ("beta", 1.0, 1.6, r"between -1 and 1\.5, nearest 1\.5; use an empirical law"),
        ("beta", -1.0, -1.0, r"between -1 and 1\.5, nearest -1; use an empirical law"),
        ("beta", 0.0, -1e-9, r"edge of the beta laws: .* allowed 0\.02 to 10000; use an empirical"),
        ("lognormal", 0.01, 0.0, r"lognormal laws, 0\.06 to 33\.5; use an empirical law, below also a gaussian"),
        ("lognormal", 50.0, 0.0, "33.5; use an empirical law, .* above a Weibull"),
        ("weibull", 300.0, 0.0, "Weibull laws, at most 190; use an empirical law"),
    ],
)
def test_moments_outside_a_family(family, skewness, excess, message):
    with pytest.raises(IllPosedError, match=message):
        from_moments(family, UM, skewness, excess)


def test_fit_keeps_the_moments():
    """And tells which law is near: KS of 20 000 independent heights from their own law stays below 1e-6's limit."""
    law, heights = plateau(20_000)
    found = fit(heights + 3 * UM, "weibull")
    z = heights - heights.mean()
    assert found.mean_height_m == pytest.approx(3 * UM + heights.mean(), rel=1e-12)
    assert found.marginal.rms_height_m == pytest.approx(z.std(), rel=1e-12)
    assert found.marginal.skewness == pytest.approx(np.mean(z**3) / z.std() ** 3, rel=1e-8)
    assert found.marginal.mirrored
    assert found.marginal.shapes[0] == pytest.approx(law.shapes[0], abs=0.1)  # five standard errors, skewness to 0.02
    assert found.kolmogorov < math.sqrt(-0.5 * math.log(0.5e-6) / 20_000)
    assert found.kolmogorov == pytest.approx(stats.kstest(z, found.marginal.cdf).statistic, abs=1e-12)
    assert found.wasserstein < 0.03
    for sign in (1.0, -1.0):  # the largest difference lies above once, below once
        gaussian = fit(sign * heights, "gaussian")
        assert gaussian.kolmogorov == pytest.approx(stats.kstest(sign * z, gaussian.marginal.cdf).statistic, abs=1e-12)
        assert gaussian.kolmogorov > 3 * found.kolmogorov
        assert gaussian.wasserstein > 0.2


def test_wasserstein_in_closed_form():
    """Uniform heights against the normal law: 2-Wasserstein^2 = 2 - 2 E[z_u z_n] with E = sqrt(3 / pi)."""
    heights = (np.arange(4000) + 0.5) / 4000
    assert fit(heights, "gaussian").wasserstein == pytest.approx(math.sqrt(2 - 2 * math.sqrt(3 / math.pi)), abs=2e-3)


def test_empirical_follows_the_heights():
    """Quantiles within sampling error of the law, 5 standard errors sqrt(p (1 - p) / n) / density, and curvature."""
    law, heights = plateau(50_000)
    found = empirical_marginal(heights + 3 * UM)
    assert found.rms_height_m == pytest.approx(heights.std(), rel=1e-12)
    assert np.mean(found.quantile((np.arange(20_000) + 0.5) / 20_000)) == pytest.approx(0.0, abs=1e-4 * UM)
    p = np.array([0.001, 0.01, 0.1, 0.5, 0.9, 0.99])
    density = 1e-4 * p / (law.quantile(1.00005 * p) - law.quantile(0.99995 * p))
    error = 5 * np.sqrt(p * (1 - p) / 50_000) / density
    assert np.all(np.abs(found.quantile(p) - law.quantile(p)) < error + 0.004 * UM)
    assert found.skewness == pytest.approx(law.skewness, abs=0.08)  # five standard errors of 0.015
    assert found.excess_kurtosis == pytest.approx(law.excess_kurtosis, abs=0.4)
    np.testing.assert_allclose(found.cdf(found.quantile(PROBABILITIES)), PROBABILITIES, rtol=1e-6, atol=1e-15)


def test_empirical_tails_are_normal():
    """Beyond the outermost node, ten heights in, z is linear in the normal score."""
    found = empirical_marginal(plateau(2000)[1])
    assert 10 / 2000 <= found.tail_share < 0.02
    beyond = found.normal > stats.norm.isf(found.tail_share) + 0.01
    slopes = np.diff(found.heights[beyond]) / np.diff(found.normal[beyond])
    np.testing.assert_allclose(slopes, slopes[0], rtol=1e-9)
    assert slopes[0] > 0.0


def test_empirical_gives_a_normal_law_back():
    """Heights at the normal scores of their ranks: z = g to the interpolation of steep ends, scaled to the Sq given."""
    n = 20_000
    found = empirical_marginal(stats.norm.ppf((np.arange(n) + 0.5) / n), rms_height_m=2.0)
    np.testing.assert_allclose(found.heights, 2.0 * found.normal, atol=2e-4)
    assert found.rms_height_m == pytest.approx(2.0, rel=1e-12)


def test_digitised_heights_are_bridged():
    """Steps of Sq / 4: the quantile function stays within a step of the law and has no flat piece."""
    law, heights = plateau(20_000)
    found = empirical_marginal(np.round(heights / (0.25 * UM)) * 0.25 * UM)
    p = np.linspace(0.01, 0.98, 60)
    assert np.max(np.abs(found.quantile(p) - law.quantile(p))) < 0.15 * UM
    assert np.min(np.diff(found.heights)) > 0.0


def test_heights_that_tell_no_law_are_refused():
    _, heights = plateau(1000)
    with pytest.raises(IllPosedError, match="100 or a parametric"):
        empirical_marginal(heights[:50])
    with pytest.raises(IllPosedError, match="clipped or coarsely"):
        empirical_marginal(np.maximum(heights, -UM))
    for make in (empirical_marginal, lambda z: fit(z, "beta")):
        with pytest.raises(IllPosedError, match="equal"):
            make(np.full(500, 0.3))
        with pytest.raises(ParameterError, match="finite"):
            make(np.append(heights, math.nan))
    with pytest.raises(ParameterError, match="rms height"):
        empirical_marginal(heights, rms_height_m=0.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("pareto", UM), "not known"),
        (("gaussian", 0.0), "rms height"),
        (("beta", UM, (1.0,)), r"shapes \(a, b\)"),
        (("beta", UM, (1.0, math.nan)), "lie in"),
        (("lognormal", UM, (1.6,)), "lie in"),
        (("weibull", UM, (0.1,)), "lie in"),
    ],
)
def test_laws_are_checked(arguments, message):
    with pytest.raises(ParameterError, match=message):
        Marginal(*arguments)


def test_arguments_are_checked():
    found = empirical_marginal(plateau(1000)[1])
    for marginal in (Marginal("gaussian", UM), found):
        for wrong in (0.0, 1.0, math.nan):
            with pytest.raises(ParameterError, match="between 0 and 1"):
                marginal.quantile(wrong)
        with pytest.raises(ParameterError, match="numbers"):
            marginal.cdf(math.nan)
    with pytest.raises(ParameterError, match="not known"):
        from_moments("pareto", UM, 0.0, 0.0)
    with pytest.raises(ParameterError, match="finite"):
        from_moments("beta", UM, math.nan, 0.0)
    with pytest.raises(ParameterError, match="ascend"):
        EmpiricalMarginal(np.array([0.0, 1.0]), np.array([1.0, 1.0]), 0.1)
    with pytest.raises(ParameterError, match="equal length"):
        EmpiricalMarginal(np.array([0.0, 1.0]), np.array([1.0]), 0.1)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_beta_law_is_finite_where_scipy_is_not(mirrored):
    """betaincinv of scipy 1.17 is NaN at these shapes below p = 1e-16, where the height is that of the end."""
    a, b = 1.035035428873854, 0.688317738616233
    law = Marginal("beta", UM, (a, b), mirrored)
    end = UM * stats.beta(a, b).mean() / stats.beta(a, b).std()
    outermost = law.from_gaussian(np.array([8.5, 8.4]) if mirrored else np.array([-8.5, -8.4]))
    np.testing.assert_allclose(outermost, end if mirrored else -end, rtol=1e-14)
