"""The expansion along a strip: cubic targets are recovered for any whitening; tables of conditional means.

A known distribution of the target given a prediction.
"""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.ndimage import gaussian_filter
from scipy.special import ndtri
from scipy.stats import norm

from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.scatter import NEIGHBOURS, residual_scatter
from roughslip.chaos.strip import conditional_means, fit_strip, on_all_rows, turned_to_half
from roughslip.chaos.variables import HALF_TURN, MIRRORED, Stencil, local_functionals

ROWS, STENCIL, UNIT = 3, Stencil(near=(1, 1), far=(4, 4)), 1e-7

TARGETS = [PressureTarget("trial_pressure", 1e17), PressureTarget("squared_pressure", 1e26, 2e8)]


def strip(seed, nodes):
    """Heights [m], correlated over a few nodes, of mean zero."""
    return 3 * UNIT * gaussian_filter(np.random.default_rng(seed).standard_normal((nodes, ROWS)), (1.0, 0.5))


def cubic(heights, target):
    """(levels, nx, ny) a polynomial of degree 3 in the functionals, another in each row and at each level."""
    h, slope_x, slope_y, xx, yy, xy, near, far = local_functionals(heights, STENCIL) / UNIT
    row = np.arange(ROWS)
    first = h - 0.4 + 0.3 * slope_x * xx - 0.2 * near**2 * (1 + row) + 0.1 * far * slope_y * yy
    second = 0.5 * near + 0.2 * row + xy * (h - far) ** 2 - 0.3 * h**3
    return np.stack([first, second]) * (1e9 if target.kind == "trial_pressure" else 1e18)


def test_a_strip_turned_by_half_a_turn_is_predicted_the_same():
    """Fitted on the rows up to the middle one, of 3 and of 4 rows; the functionals in HALF_TURN change their sign."""
    rng = np.random.default_rng(8)
    for rows in (3, 4):
        heights = UNIT * gaussian_filter(rng.standard_normal((700, rows)), (1.0, 0.5))
        functionals = local_functionals(heights, STENCIL)
        turned = local_functionals(heights[::-1, ::-1], STENCIL)[:, ::-1, ::-1]
        np.testing.assert_allclose(turned, functionals * HALF_TURN[:, None, None], rtol=0, atol=1e-12 * UNIT)
        functionals = functionals.transpose(1, 2, 0)
        values = 1e9 * rng.standard_normal((700, rows, 1)) + 1e16 * functionals[..., :1]
        folded = turned_to_half(functionals, values)
        assert folded[0].shape == (1400, 2, 8)
        fit, *_ = fit_strip(*folded, 2, STENCIL, TARGETS[0], np.arange(1400))
        whole = on_all_rows(fit, rows)
        predicted = whole.predicted(heights)
        assert predicted.shape == (1, 700, rows)
        rounding = 1e-12 * np.abs(predicted).max()
        again = whole.predicted(heights[::-1, ::-1])[:, ::-1, ::-1]
        np.testing.assert_allclose(again, predicted, rtol=0, atol=100 * rounding)
        np.testing.assert_allclose(whole.predicted(heights, slice(5, 40)), predicted[:, 5:40], rtol=0, atol=rounding)


@pytest.mark.parametrize("most", [20, 2])
def test_left_out_strips_are_predicted_by_the_others(most, monkeypatch):
    """As a fit to the other strips predicts them, in the variables of the whole fit: a linear change of these changes
    no prediction of a polynomial of full degree. In two groups at most, every second strip is left out."""
    monkeypatch.setattr("roughslip.chaos.strip.GROUPS", most)
    nodes, strips, target = 60, 4, TARGETS[1]
    heights = strip(9, strips * nodes)
    functionals = np.ascontiguousarray(local_functionals(heights, STENCIL).transpose(1, 2, 0))
    noise = 1e18 * np.random.default_rng(10).standard_normal((strips * nodes, ROWS, 2))
    values = cubic(heights, target).transpose(1, 2, 0) + noise
    number = np.repeat(np.arange(strips), nodes)
    predictions = fit_strip(functionals, values, 1, STENCIL, target, number)[2]
    assert predictions.shape == (2, strips * nodes, ROWS)
    for row, level, out in ((0, 1, 0), (2, 0, 3)):
        kept = number % min(most, strips) != out % min(most, strips)
        u = np.column_stack([np.ones(len(number)), functionals[:, row] / UNIT])
        root = np.sqrt(target.weights(values[:, row, level]))[kept]
        beta = np.linalg.lstsq(root[:, None] * u[kept], root * values[kept, row, level], rcond=None)[0]
        expected = (u @ beta)[~kept]
        np.testing.assert_allclose(predictions[level, ~kept, row], expected, rtol=0, atol=1e-8 * np.abs(values).max())


def test_of_strips_alike_in_a_mirror_along_them_half_of_the_odd_is_not_fitted():
    """A target that a mirror leaves alone is recovered in 105 terms of 165, and a mirrored strip is predicted so."""
    target, odd = TARGETS[0], MIRRORED[:, :1]

    def even(heights):
        h, slope_x, slope_y, xx, yy, xy, near, far = local_functionals(heights, STENCIL) / UNIT
        return 1e9 * (h - 0.4 + slope_x**2 * (1 + far) - 0.3 * slope_x * xy + near * slope_y * yy + xx)[None]

    heights = strip(11, 800)
    functionals = np.ascontiguousarray(local_functionals(heights, STENCIL).transpose(1, 2, 0))
    fit, missed, _ = fit_strip(functionals, np.moveaxis(even(heights), 0, -1), 3, STENCIL, target, np.arange(800), odd)
    assert fit.indices.shape == (105, 8)
    assert missed.max() < 1e-20
    other = strip(12, 300)
    exact, predicted = even(other), fit.predicted(other)
    rounding = 1e-10 * np.abs(exact).max()
    np.testing.assert_allclose(predicted, exact, rtol=0, atol=rounding)
    np.testing.assert_allclose(fit.predicted(other[::-1])[:, ::-1], predicted, rtol=0, atol=rounding)


TRIAL = PressureTarget("trial_pressure", 1.0)

SQUARED = PressureTarget("squared_pressure", 1.0, 0.6)

PLACES_SEEN = np.linspace(-1.0, 2.0, 13)


def deviation(s):
    """Of the target around its prediction; it grows with the prediction."""
    return 0.2 + 0.1 * (s + 2.0)


def predictions(seed, scale=1.0):
    rng = np.random.default_rng(seed)
    s = rng.uniform(-2.0, 3.0, (2, 40_000))
    return s, s + scale * deviation(s) * rng.standard_normal(s.shape)


@pytest.mark.parametrize("target", [TRIAL, SQUARED], ids=lambda target: target.kind)
def test_tables_are_the_expectations_of_a_normal_scatter_that_grows(target):
    """P = Phi(s / sd), E[p] = int p(s + sd z) phi(z) dz, for the trial pressure s Phi + sd phi. Each
    distribution comes from 4 % of the samples near s: 1300 over a span of 0.2, where the deviation changes by 5 %.
    Allowed are four standard errors of a share and of a mean, and 0.01 for that change and the 200 draws."""
    means = conditional_means(*predictions(1), target)
    contact, pressure = means.summed(np.tile(PLACES_SEEN[:, None], (2, 1, 1)))
    for k, s in enumerate(PLACES_SEEN):
        sd, share = deviation(s), norm.cdf(s / deviation(s))
        expected = quad(lambda z: float(target.pressure(np.array(s + sd * z))) * norm.pdf(z), -s / sd, 8)[0]  # noqa: B023
        if target is TRIAL:
            assert expected == pytest.approx(s * share + sd * norm.pdf(s / sd), rel=1e-6)
        np.testing.assert_allclose(contact[:, k], share, atol=4 * np.sqrt(share * (1 - share) / 1300) + 0.01)
        np.testing.assert_allclose(pressure[:, k], expected, atol=4 * sd / np.sqrt(1300) + 0.01)


def test_a_scatter_that_the_places_of_the_tables_do_not_resolve_is_neglected():
    means = conditional_means(*predictions(2, 0.004), SQUARED)
    contact, pressure = means.summed(np.tile(PLACES_SEEN[:, None], (2, 1, 1)))
    assert np.array_equal(contact, np.tile(PLACES_SEEN > 0, (2, 1)))
    assert np.array_equal(pressure, np.tile(SQUARED.pressure(PLACES_SEEN), (2, 1)))


def test_beyond_the_samples_there_is_no_contact_or_that_of_the_largest_target():
    """A polynomial runs off beyond its samples; the largest target here is 3 and some deviations of 0.21."""
    s, values = predictions(3, 0.3)
    contact, pressure = conditional_means(s, values, TRIAL).summed(np.tile([[-50.0], [3.0], [50.0]], (2, 1, 1)))
    np.testing.assert_array_equal(contact, [[0.0, 1.0, 1.0]] * 2)
    assert np.all(pressure[:, 0] == 0.0)
    # the last law has 1600 residuals on one side of it: predictions over a span of 0.2
    np.testing.assert_allclose(pressure[:, 1:], 3.0, atol=0.05)
    near = conditional_means(s + 2.05, values + 2.05, TRIAL)  # contact at the least prediction too
    assert near.expected[0, 0, 0] > 0.1
    assert np.all(near.summed(np.full((2, 1, 1), -50.0))[0] == 0.0)


SAMPLES = 40_000


def mean(s):
    return np.where(s > 0, s**2, 0.0) + s


def width(s):
    return 0.2 + 0.3 * np.maximum(s, 0.0)


def scattered(samples=SAMPLES, seed=0):
    generator = np.random.default_rng([1991, seed])
    s = generator.standard_normal(samples)
    return s, mean(s) + width(s) * generator.standard_normal(samples)


@pytest.fixture(scope="module")
def law():
    return residual_scatter(*scattered())


@pytest.mark.parametrize("probability", [0.1, 0.5, 0.9])
def test_quantiles_are_those_of_the_law_where_scatter_grows_with_the_prediction(law, probability):
    """A quantile of the window's samples has the error sqrt(q (1 - q) / n) / f, at most 1.8 width / sqrt(n), four of
    which are 0.18 width. The window smears the mean by its own slope, which is fitted, not by its position."""
    s = np.array([-1.5, -0.5, 0.0, 0.5, 1.0, 1.5])
    drawn = law.draw(s, np.full(6, probability))
    tolerance = 4 * 1.8 * width(s) / np.sqrt(NEIGHBOURS * SAMPLES)
    assert np.all(np.abs(drawn - mean(s) - width(s) * ndtri(probability)) < tolerance)
