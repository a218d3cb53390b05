"""Covariances fitted to lags, and to rings of the spectrum, against the truth that these were made from."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.grid import Grid
from roughslip.scan import covariance_fit
from roughslip.scan.covariance_fit import fit_covariance, fitted_covariances
from roughslip.scan.fit_data import RingPowers, effective_number, estimates, lags_to_fit, profile_to_fit, rings_to_fit
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import topography
from roughslip.surface.embedding import embed
from roughslip.surface.models import KINDS, MODELS, covariance_of, self_affine

SMOOTHNESS = 2.5
TRUTH = covariance_of("matern", 1.0, 14.0, 10.0, smoothness=SMOOTHNESS)
SCANS = 6
LAGS = np.arange(-12, 13) * 0.5
X, Y = np.meshgrid(LAGS, LAGS, indexing="ij")
ERROR = np.full(X.shape, 0.01)
CUTOFF = 1.0

TRUTHS = {
    "gaussian": covariance_of("gaussian", 2.0, 2.0, 1.0, lay_rad=0.4),
    "exponential": covariance_of("exponential", 2.0, 2.0, 0.7, lay_rad=-1.2),
    "separable_exponential": covariance_of("separable_exponential", 2.0, 0.7, 2.0),
    "matern": covariance_of("matern", 2.0, 2.0, 1.2, lay_rad=1.5, smoothness=1.4),
    "self_affine": self_affine(2.0, 0.8, 9.0, CUTOFF * math.sqrt(9.0 / 6.0), 6.0, 0.7),
}


def cutoff(kind):
    return CUTOFF if kind == "self_affine" else None


def with_noise(covariance, seed, scale=1.0):
    """Independent errors of the size said, equal at opposite lags."""
    noise = np.random.default_rng(seed).standard_normal(X.shape)
    return covariance(X, Y) / 4.0 + scale * ERROR * (noise + noise[::-1, ::-1]) / math.sqrt(2.0)


@pytest.mark.parametrize("kind", KINDS)
def test_without_errors_the_parameters_come_back(kind):
    truth = TRUTHS[kind]
    fit = fit_covariance(kind, estimates(X, Y, truth(X, Y) / 4.0, ERROR), 2.0, cutoff_wavelength_m=cutoff(kind))
    # the misfit is that of least squares stopped at 1e-12 of a sum that starts of order one
    assert fit.misfit < 1e-6
    np.testing.assert_allclose(fit.covariance.lengths_m, truth.lengths_m, rtol=1e-6)
    assert fit.covariance.lay_rad == pytest.approx(truth.lay_rad, abs=1e-6)
    assert [getattr(fit.covariance, name) for name in truth.shapes] == pytest.approx(
        [getattr(truth, name) for name in truth.shapes], rel=1e-5
    )
    assert fit.covariance.rms_height_m == 2.0
    assert fit.at_bound == ()
    assert fit.lags == 312  # half of 625 - 1: a lag and its opposite count once


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.slow) if kind == "self_affine" else kind for kind in KINDS]
)
def test_independent_errors_scatter_the_parameters_as_said(kind):
    """Ten tables: the sum of squared pulls of each parameter is chi-square of 10 degrees.

    It lies between 0.6 and 39 but for 2e-5 a side, which 17 parameters make 1e-3 of the family.
    """
    truth = TRUTHS[kind]
    tables = [truth(X, Y) / 4.0, *(with_noise(truth, [seed, 2]) for seed in range(10))]
    exact, *fits = (
        fit_covariance(kind, estimates(X, Y, r, ERROR), 2.0, cutoff_wavelength_m=cutoff(kind)) for r in tables
    )
    for name, value in exact.parameters.items():
        pulls = [(fit.parameters[name] - value) / fit.standard_errors[name] for fit in fits]
        assert 0.6 < np.sum(np.square(pulls)) < 39, name
    assert np.mean([fit.misfit for fit in fits]) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("kind", KINDS)
def test_the_true_model_is_chosen(kind):
    """And a Matern model that has become exponential or Gaussian does not win by its extra parameter."""
    data = estimates(X, Y, with_noise(TRUTHS[kind], 3), ERROR)
    fits = [fit_covariance(other, data, 2.0, cutoff_wavelength_m=cutoff(other)) for other in KINDS]
    fits.sort(key=lambda fit: fit.criterion)
    assert fits[0].covariance.kind == kind
    assert fits[0].misfit == pytest.approx(1.0, abs=0.2)  # 312 lags: 1 +- 0.04, four of them
    free = {"separable_exponential": 2, "gaussian": 3, "exponential": 3}.get(kind, 4)
    assert fits[0].criterion == pytest.approx(312 * fits[0].misfit ** 2 + free * math.log(312))


def test_a_smoothness_without_end_is_said_to_be_at_its_bound():
    fit = fit_covariance("matern", estimates(X, Y, TRUTHS["gaussian"](X, Y) / 4.0, ERROR), 2.0)
    assert fit.at_bound == ("smoothness",)
    assert fit.standard_errors["smoothness"] == math.inf
    assert math.isfinite(fit.standard_errors["correlation_length_m"])


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_of_the_named_parameters(kind):
    """Central differences of 1e-5: relative error of some 1e-9."""
    parameters = np.array({"separable_exponential": [0.4, -0.3]}.get(kind, [0.4, -0.3, 0.2]))
    parameters = np.append(parameters, {"matern": [0.3], "self_affine": [0.7]}.get(kind, []))
    build = covariance_fit._builder(MODELS[kind], 2.0, 0.1 if kind == "self_affine" else None)

    def named(values):
        return np.array(list(covariance_fit._named(build(values)).values()))

    steps = 1e-5 * np.eye(len(parameters))
    differences = np.stack([(named(parameters + step) - named(parameters - step)) / 2e-5 for step in steps], axis=1)
    exact = covariance_fit._gradient(MODELS[kind], parameters, build(parameters))
    np.testing.assert_allclose(exact, differences, atol=1e-7)


@pytest.mark.slow
def test_the_jackknife_sees_errors_that_neighbours_share():
    """Tables estimated on strips of sampled fields, each strip independent. The scatter of the fitted length over
    fields is what a standard error should be: the jackknife meets it, independent lags promise a fraction."""
    truth = covariance_of("exponential", 1.0, 2.0)
    grid, parts, reach = Grid(24, 24, 1.0, 1.0), 12, 6
    embedding = embed(truth, grid)
    lengths, jackknife, naive = [], [], []
    for field in range(30):
        generator = np.random.default_rng([5, field])
        sums = np.stack([_lag_products(embedding.sample(generator), reach) for _ in range(parts)])
        whole, without = sums.mean(axis=0), (sums.sum(axis=0) - sums) / (parts - 1)
        table, parts_of = whole / whole[0, reach], without / without[:, :1, reach : reach + 1]
        error = np.sqrt((parts - 1) / parts * np.sum((parts_of - parts_of.mean(axis=0)) ** 2, axis=0)) + 1e-12
        x, y = np.arange(reach + 1)[:, None] * 1.0, np.arange(-reach, reach + 1)[None, :] * 1.0
        near = np.hypot(x, y) <= reach
        x, y = np.broadcast_arrays(x, y)
        data = x[near], y[near], table[near], error[near]
        fit = fit_covariance("exponential", estimates(*data, parts_of[:, near]), 1.0)
        lengths.append(fit.parameters["correlation_length_m"])
        jackknife.append(fit.standard_errors["correlation_length_m"])
        independent = fit_covariance("exponential", estimates(*data), 1.0)
        naive.append(independent.standard_errors["correlation_length_m"])
        assert 1.0 < fit.effective_lags < parts
    scatter = np.std(lengths, ddof=1)  # of 30: known to 13 %, three of which are allowed, and the jackknife's bias
    assert np.mean(jackknife) == pytest.approx(scatter, rel=0.45)
    assert np.mean(naive) < 0.5 * scatter


def _lag_products(z, reach):
    """Mean of z(x) z(x + lag) over the pairs, lags (0 ... reach, -reach ... reach); the mean of z is known to be 0."""
    n, lags = len(z), range(-reach, reach + 1)
    return np.array(
        [
            [np.mean(z[: n - i, max(0, -j) : n - max(0, j)] * z[i:, max(0, j) : n - max(0, -j)]) for j in lags]
            for i in range(reach + 1)
        ]
    )


def test_lags_that_cannot_tell_are_refused():
    x = np.arange(1, 20) * 0.3
    profile = estimates(x, 0.0, np.exp(-x), np.full(19, 0.02))
    with pytest.raises(IllPosedError, match="add lags across"):
        fit_covariance("exponential", profile, 1.0)
    with pytest.raises(IllPosedError, match="too few"):
        fit_covariance("exponential", estimates(x[:3], 0.0, np.exp(-x[:3]), np.full(3, 0.02)), 1.0)
    with pytest.raises(IllPosedError, match="shorter lags"):
        fit_covariance("gaussian", estimates(X * 9, Y * 9, TRUTHS["gaussian"](X * 9, Y * 9) / 4.0, ERROR), 2.0)


def test_stopping_short_is_an_error(monkeypatch):
    def impatient(*arguments, **options):
        return least_squares(*arguments, **options, max_nfev=1)

    least_squares = covariance_fit.least_squares
    monkeypatch.setattr(covariance_fit, "least_squares", impatient)
    with pytest.raises(ConvergenceError, match=r"fit of matern.*[Uu]se another kind"):
        fit_covariance("matern", estimates(X, Y, with_noise(TRUTHS["exponential"], 1), ERROR), 2.0)


def described(number):
    """A field of 18 by 26 lengths, resolved by ten points a length, with its statistics."""
    field = embed(TRUTH, Grid(256, 256, 1.0, 1.0)).sample(np.random.default_rng([11, number]))
    scan = topography(field, 1.0, 1.0, "a scan")
    return scan, scan_statistics(scan)


@pytest.fixture(scope="module")
def first():
    return described(0)


@pytest.fixture(scope="module")
def fits(first):
    """Of each scan by lags, then by lags and rings."""
    scans = [first, *(described(number) for number in range(1, SCANS))]
    data = [(lags_to_fit(numbers.autocorrelation), rings_to_fit(scan, numbers)) for scan, numbers in scans]
    return [[fit_covariance("matern", lags, 1.0, rings=given and rings) for lags, rings in data] for given in (None, 1)]


@pytest.mark.slow
def test_rings_determine_the_smoothness_that_lags_leave_open(fits):
    """Of six scans one has lags that fit a smoothness at its bound; with the rings all lie within some 15 %.

    The pull of a parameter has t of 11 degrees: six beyond 4.4 come with a probability of 6e-3 if they are right.
    """
    lags, both = fits
    spread = [np.std([math.log(fit.parameters["smoothness"]) for fit in way]) for way in fits]
    assert spread[1] < 0.25 < 0.5 < spread[0]
    for fit, alone in zip(both, lags, strict=True):
        assert abs(fit.parameters["smoothness"] - SMOOTHNESS) < 4.4 * fit.standard_errors["smoothness"]
        assert fit.standard_errors["smoothness"] < 0.5 * SMOOTHNESS
        for name in ("correlation_length_m", "correlation_length_across_m"):  # lags keep the lengths
            assert abs(fit.parameters[name] - alone.parameters[name]) < 0.5 * alone.standard_errors[name]
        assert fit.spectrum_misfit < 2.0
    # six values have their scatter to 30 %, the jackknife of a dozen parts its own to 20 %: two of both
    scatter = np.std([fit.parameters["smoothness"] for fit in both], ddof=1)
    error = np.sqrt(np.mean([fit.standard_errors["smoothness"] ** 2 for fit in both]))
    assert 1 / 2.1 < error / scatter < 2.1


def test_the_criterion_counts_rings(first):
    """Exponential and Gaussian kinds pass through the lags almost as well; rings show the difference from Matern."""
    (best, *others), _ = fitted_covariances(("gaussian", "exponential", "matern"), *first)
    assert best.covariance.kind == "matern"
    for fit in (best, *others):
        squares = fit.effective_lags * fit.misfit**2 + fit.effective_rings * fit.spectrum_misfit**2
        free = 4 if fit is best else 3
        assert fit.criterion == pytest.approx(squares + free * math.log(fit.effective_lags + fit.effective_rings))
    assert min(fit.spectrum_misfit for fit in others) > 2 * best.spectrum_misfit


def test_rings_of_a_model_are_its_own():
    """Exact lags and exact rings give the truth back, with the misfit of the tolerance that the search stops at."""
    x, y = np.meshgrid(np.arange(-20.0, 21), np.arange(-20.0, 21), indexing="ij")
    table, error = TRUTH(x, y), np.full(x.shape, 0.01)
    parts = np.stack([table * (1 + 1e-3 * sign) for sign in (-1, 1)])
    q = np.linspace(0.3, 0.8, 5)
    powers = TRUTH.spectrum(q)
    rings = RingPowers(powers, np.full(5, 0.1), np.stack([powers * 0.9, powers / 0.9]), lambda model: model.spectrum(q))
    fit = fit_covariance("matern", estimates(x, y, table, error, parts), 1.0, rings=rings)
    assert fit.parameters["smoothness"] == pytest.approx(SMOOTHNESS, rel=1e-4)
    assert fit.covariance.lengths_m == pytest.approx(TRUTH.lengths_m, rel=1e-4)
    assert fit.spectrum_misfit < 1e-3
    # in metres, where logarithms of lengths are negative, no parameter lies at a bound either
    um, powers = 1e-6, 1e-12 * powers
    small = RingPowers(powers, rings.standard_error, 1e-12 * rings.without_part, lambda model: model.spectrum(q / um))
    in_metres = fit_covariance("matern", estimates(um * x, um * y, table, error, parts), 1.0, rings=small)
    assert in_metres.parameters["smoothness"] == pytest.approx(SMOOTHNESS, rel=1e-4)
    assert np.isfinite(list(in_metres.standard_errors.values())).all()


def test_standard_errors_with_rings_are_those_of_refits_without_each_part():
    """Small errors, so that the linearised jackknife is that of the fits to what is left; both kinds of data count."""
    truth = covariance_of("matern", 1.0, 4.0, 2.5, lay_rad=0.5, smoothness=1.5)
    x, y = np.meshgrid(np.arange(-7.0, 8), np.arange(-7.0, 8), indexing="ij")
    q, rng = np.linspace(0.6, 1.6, 5), np.random.default_rng(17)
    noise, waves = 5e-4 * rng.standard_normal((5, *x.shape)), 1e-3 * rng.standard_normal((5, q.size))
    tables = truth(x, y) + 0.5 * (noise + noise[:, ::-1, ::-1])
    powers = truth.spectrum(q, 0.3) * np.exp(waves)

    def fit(table, power):
        rings = RingPowers(power, np.full(q.size, 0.05), powers, lambda model: model.spectrum(q, 0.3))
        return fit_covariance("matern", estimates(x, y, table, np.full(x.shape, 0.01), tables), 1.0, rings=rings)

    fitted = fit(tables.mean(axis=0), np.exp(np.log(powers).mean(axis=0)))
    parts = [fit(*part).parameters for part in zip(tables, powers, strict=True)]
    for name, error in fitted.standard_errors.items():
        refitted = np.sqrt((len(parts) - 1) * np.var([part[name] for part in parts]))
        assert error == pytest.approx(refitted, rel=0.02), name


def test_rings_of_a_gaussian_leave_the_smoothness_at_its_bound():
    """Then the others have the errors of fits of lags alone at that bound."""
    truth = covariance_of("gaussian", 1.0, 4.0, 2.5, lay_rad=0.5)
    x, y = np.meshgrid(np.arange(-5.0, 6), np.arange(-5.0, 6), indexing="ij")
    q, table = np.linspace(0.2, 0.6, 5), truth(x, y)
    parts, powers = np.stack([table * (1 + 1e-3 * sign) for sign in (-1, 1)]), truth.spectrum(q, 0.3)
    rings = RingPowers(
        powers, np.full(5, 0.1), np.stack([0.9 * powers, powers / 0.9]), lambda model: model.spectrum(q, 0.3)
    )
    data = estimates(x, y, table, np.full(x.shape, 0.01), parts)
    fit, alone = (fit_covariance("matern", data, 1.0, rings=given) for given in (rings, None))
    assert fit.at_bound == ("smoothness",)
    assert fit.parameters["smoothness"] == pytest.approx(MODELS["matern"].shapes["smoothness"][1], rel=1e-12)
    assert fit.standard_errors.pop("smoothness") == math.inf
    for name, error in fit.standard_errors.items():
        assert error == pytest.approx(alone.standard_errors[name], rel=1e-3)


def test_lags_are_thinned_about_lag_zero(first):
    measured = first[1].autocorrelation
    data = lags_to_fit(measured)
    assert len(data.x) <= 2000 < measured.correlation.value.size / 2
    assert not np.any((data.x == 0) & (data.y == 0))
    i, j = (len(axis) // 2 for axis in (measured.lag_x, measured.lag_y))
    at = measured.correlation.value[np.round(data.x).astype(int) + i, np.round(data.y).astype(int) + j]
    np.testing.assert_array_equal(data.correlation, at)


def test_lags_across_an_endless_lay_stand_in_every_direction():
    """In metres. Grooves along y leave the lags along x, and grooves along x those along y."""
    rows = np.random.default_rng(1).uniform(size=(3, 5, 7))
    spread = SimpleNamespace(low=rows[0] - 0.1, high=rows[0] + 0.1)
    table = SimpleNamespace(lag_x=1e-6 * np.arange(-2, 3), lag_y=2e-6 * np.arange(-3, 4), rows=rows, correlation=spread)
    for endless, lags, expected in ((1, table.lag_x[3:], rows[:, 3:, 3]), (0, table.lag_y[4:], rows[:, 2, 4:])):
        data = profile_to_fit(table, endless, 4)
        np.testing.assert_allclose(np.hypot(data.x, data.y), np.tile(lags, 4), rtol=1e-12)
        np.testing.assert_allclose(np.arctan2(data.y, data.x), np.repeat(np.arange(4) * np.pi / 4, lags.size))
        np.testing.assert_array_equal(data.correlation, np.tile(expected[0], 4))
        np.testing.assert_array_equal(data.without_part, np.tile(expected[1:], 4))


def test_standard_errors_are_the_jackknife_s(first):
    """Of lags as they are and of the logarithm of rings, widened for what neighbouring sub-areas share."""
    scan, statistics = first
    lags, rings = lags_to_fit(statistics.autocorrelation), rings_to_fit(scan, statistics)
    for error, parts in ((lags.standard_error, lags.without_part), (rings.standard_error, np.log(rings.without_part))):
        jackknife = np.sqrt((len(parts) - 1) * np.var(parts, axis=0))
        np.testing.assert_allclose(error, statistics.sub_areas.widening * jackknife, rtol=1e-9)


def test_errors_that_all_parts_share_are_one_estimate():
    independent = np.random.default_rng(5).standard_normal((2000, 6))
    assert effective_number(independent) == pytest.approx(6.0, rel=0.02)
    assert effective_number(np.outer(independent[:, 0], np.ones(6))) == pytest.approx(1.0)
    assert effective_number(np.empty((0, 6))) == 6.0


def test_a_scan_too_coarse_for_rings_is_fitted_by_lags():
    """Two points a length: the spectrum bends up to a quarter of the highest wavenumber."""
    field = embed(covariance_of("gaussian", 1.0, 2.0), Grid(64, 64, 1.0, 1.0)).sample(np.random.default_rng(12))
    scan = topography(field, 1.0, 1.0, "a scan")
    statistics = scan_statistics(scan)
    assert rings_to_fit(scan, statistics) is None
    (best, *_), _ = fitted_covariances(("gaussian",), scan, statistics)
    assert best.effective_rings == best.spectrum_misfit == 0.0
