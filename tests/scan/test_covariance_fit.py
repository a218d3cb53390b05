import math

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.scan import covariance_fit
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.scan.fit_data import estimates
from roughslip.surface.embedding import embed
from roughslip.surface.models import KINDS, MODELS, covariance_of, self_affine

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


@pytest.mark.parametrize("kind", KINDS)
def test_independent_errors_scatter_the_parameters_as_said(kind):
    """Ten tables: the sum of squared pulls of each parameter is chi-square of 10 degrees.

    It lies between 0.6 and 39 but for 2e-5 a side, which 17 parameters make 1e-3 of the family.
    """
    truth = TRUTHS[kind]
    fits = [
        fit_covariance(
            kind, estimates(X, Y, with_noise(truth, [seed, 2]), ERROR), 2.0, cutoff_wavelength_m=cutoff(kind)
        )
        for seed in range(10)
    ]
    exact = fit_covariance(kind, estimates(X, Y, truth(X, Y) / 4.0, ERROR), 2.0, cutoff_wavelength_m=cutoff(kind))
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
    assert fits[0].criterion == pytest.approx(312 * fits[0].misfit ** 2 + len(_free(kind)) * math.log(312))


def _free(kind):
    return {"separable_exponential": 2, "gaussian": 3, "exponential": 3}.get(kind, 4) * "p"


def test_a_smoothness_without_end_is_said_to_be_at_its_bound():
    fit = fit_covariance("matern", estimates(X, Y, TRUTHS["gaussian"](X, Y) / 4.0, ERROR), 2.0)
    assert fit.at_bound == ("smoothness",)
    assert fit.standard_errors["smoothness"] == math.inf
    assert math.isfinite(fit.standard_errors["correlation_length_m"])


@pytest.mark.parametrize("truth", [TRUTHS["gaussian"], covariance_of("gaussian", 2.0, 2.0, 0.3, lay_rad=-1.3)])
def test_the_first_guess_of_a_gaussian_is_the_answer(truth):
    """Its logarithm is the quadratic form that the guess is read from."""
    start = covariance_fit._start_and_bounds(MODELS["gaussian"], estimates(X, Y, truth(X, Y) / 4.0, ERROR), True)[0]
    assert covariance_fit._axes(MODELS["gaussian"], start, True) == pytest.approx(
        (*truth.lengths_m, truth.lay_rad), rel=1e-9
    )


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_of_the_named_parameters(kind):
    """Central differences of 1e-5: relative error of some 1e-9."""
    parameters = np.array({"separable_exponential": [0.4, -0.3]}.get(kind, [0.4, -0.3, 0.2]))
    parameters = np.append(parameters, {"matern": [0.3], "self_affine": [0.7]}.get(kind, []))
    build = covariance_fit._builder(MODELS[kind], 2.0, True, 0.1 if kind == "self_affine" else None)

    def named(values):
        return np.array(list(covariance_fit._named(build(values), True).values()))

    steps = 1e-5 * np.eye(len(parameters))
    differences = np.stack([(named(parameters + step) - named(parameters - step)) / 2e-5 for step in steps], axis=1)
    exact = covariance_fit._gradient(MODELS[kind], parameters, build(parameters), True)
    np.testing.assert_allclose(exact, differences, atol=1e-7)


def test_isotropic_fits_take_profiles_and_round_surfaces():
    truth = covariance_of("matern", 2.0, 1.7, smoothness=0.8)
    x = np.arange(1, 20) * 0.3
    fit = fit_covariance("matern", estimates(x, 0.0, truth(x) / 4.0, np.full(19, 0.02)), 2.0, anisotropic=False)
    assert fit.parameters == pytest.approx({"correlation_length_m": 1.7, "smoothness": 0.8}, rel=1e-5)
    assert set(fit.standard_errors) == set(fit.parameters)
    # a round surface fitted with a lay: equal lengths, and a lay without meaning
    lay = fit_covariance(
        "exponential", estimates(X, Y, with_noise(covariance_of("exponential", 2.0, 2.0), 8), ERROR), 2.0
    )
    assert lay.parameters["correlation_length_m"] == pytest.approx(2.0, rel=0.05)
    assert lay.standard_errors["lay_rad"] > 0.05


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
        fit = fit_covariance("exponential", estimates(*data, parts_of[:, near]), 1.0, anisotropic=False)
        lengths.append(fit.parameters["correlation_length_m"])
        jackknife.append(fit.standard_errors["correlation_length_m"])
        naive.append(
            fit_covariance("exponential", estimates(*data), 1.0, anisotropic=False).standard_errors[
                "correlation_length_m"
            ]
        )
        assert 1.0 < fit.effective_lags < parts
    scatter = np.std(lengths, ddof=1)  # of 30: known to 13 %, three of which are allowed, and the jackknife's bias
    assert np.mean(jackknife) == pytest.approx(scatter, rel=0.45)
    assert np.mean(naive) < 0.5 * scatter


def _lag_products(z, reach):
    """Mean of z(x) z(x + lag) over the pairs, lags (0 ... reach, -reach ... reach); the mean of z is known to be 0."""
    n = len(z)
    return np.array(
        [
            [
                np.mean(z[: n - i, max(0, -j) : n - max(0, j)] * z[i:, max(0, j) : n - max(0, -j)])
                for j in range(-reach, reach + 1)
            ]
            for i in range(reach + 1)
        ]
    )


def test_lags_that_cannot_tell_are_refused():
    x = np.arange(1, 20) * 0.3
    profile = estimates(x, 0.0, np.exp(-x), np.full(19, 0.02))
    with pytest.raises(IllPosedError, match="add lags across"):
        fit_covariance("exponential", profile, 1.0)
    with pytest.raises(IllPosedError, match="too few"):
        fit_covariance("exponential", estimates(x[:1], 0.0, np.exp(-x[:1]), np.full(1, 0.02)), 1.0, anisotropic=False)
    with pytest.raises(IllPosedError, match="shorter lags"):
        fit_covariance("gaussian", estimates(X * 9, Y * 9, TRUTHS["gaussian"](X * 9, Y * 9) / 4.0, ERROR), 2.0)


def test_nonsense_is_refused():
    table = TRUTHS["gaussian"](X, Y) / 4.0
    with pytest.raises(ParameterError, match="cut-off"):
        fit_covariance("self_affine", estimates(X, Y, table, ERROR), 2.0)
    with pytest.raises(ParameterError, match="cut-off"):
        fit_covariance("gaussian", estimates(X, Y, table, ERROR), 2.0, cutoff_wavelength_m=1.0)
    with pytest.raises(ParameterError, match="finite"):
        estimates(X, Y, np.where(table > 0.5, np.nan, table), ERROR)
    with pytest.raises(ParameterError, match="positive"):
        estimates(X, Y, table, 0.0 * ERROR)
    with pytest.raises(ParameterError, match="do not fit"):
        estimates(X, Y, table, ERROR[:3])


def test_stopping_short_is_an_error(monkeypatch):
    def impatient(*arguments, **options):
        return least_squares(*arguments, **options, max_nfev=1)

    least_squares = covariance_fit.least_squares
    monkeypatch.setattr(covariance_fit, "least_squares", impatient)
    with pytest.raises(ConvergenceError, match=r"fit of matern.*[Uu]se another kind"):
        fit_covariance("matern", estimates(X, Y, with_noise(TRUTHS["exponential"], 1), ERROR), 2.0)
