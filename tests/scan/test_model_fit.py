"""Models fitted to scans by lags and rings of the spectrum, against the surfaces that the scans were drawn from."""

import math

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.scan.covariance_fit import fit_covariance, fitted_covariances
from roughslip.scan.fit_data import RingPowers, effective_number, estimates, lags_to_fit, rings_to_fit
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import topography
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

SMOOTHNESS = 2.5
TRUTH = covariance_of("matern", 1.0, 14.0, 10.0, smoothness=SMOOTHNESS)
SCANS = 6


@pytest.fixture(scope="module")
def scans():
    """Fields of 18 by 26 lengths, resolved by ten points a length, with their statistics."""
    embedding = embed(TRUTH, Grid(256, 256, 1.0, 1.0))
    fields = [embedding.sample(np.random.default_rng([11, number])) for number in range(SCANS)]
    found = [topography(field, 1.0, 1.0, "a scan") for field in fields]
    return [(scan, scan_statistics(scan)) for scan in found]


@pytest.fixture(scope="module")
def fits(scans):
    """Of each scan by lags, then by lags and rings."""
    data = [(lags_to_fit(found.autocorrelation), rings_to_fit(scan, found)) for scan, found in scans]
    return [[fit_covariance("matern", lags, 1.0, rings=given and rings) for lags, rings in data] for given in (None, 1)]


def test_rings_settle_the_smoothness_that_lags_leave_open(fits):
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


def test_errors_of_the_smoothness_are_those_of_its_scatter(fits):
    """Six values know their scatter to 30 %, the jackknife of a dozen parts its own to 20 %: two of both."""
    _, both = fits
    scatter = np.std([fit.parameters["smoothness"] for fit in both], ddof=1)
    error = np.sqrt(np.mean([fit.standard_errors["smoothness"] ** 2 for fit in both]))
    assert 1 / 2.1 < error / scatter < 2.1


def test_the_criterion_counts_rings(scans):
    """Exponential and Gaussian kinds pass through the lags almost as well; rings show the difference from Matern."""
    (best, *others), _ = fitted_covariances(("gaussian", "exponential", "matern"), *scans[0])
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
    with pytest.raises(ParameterError, match="the same parts"):
        fit_covariance("matern", estimates(x, y, table, error), 1.0, rings=rings)


def test_errors_that_all_parts_share_are_one_estimate():
    independent = np.random.default_rng(5).standard_normal((2000, 6))
    assert effective_number(independent) == pytest.approx(6.0, rel=0.02)
    assert effective_number(np.outer(independent[:, 0], np.ones(6))) == pytest.approx(1.0)
    assert effective_number(np.empty((0, 6))) == 6.0


def test_a_scan_too_coarse_for_rings_is_fitted_by_lags():
    """Two points a length: the spectrum bends up to a quarter of the highest wavenumber."""
    field = embed(covariance_of("gaussian", 1.0, 2.0), Grid(64, 64, 1.0, 1.0)).sample(np.random.default_rng(12))
    scan = topography(field, 1.0, 1.0, "a scan")
    found = scan_statistics(scan)
    assert rings_to_fit(scan, found) is None
    (best, *_), _ = fitted_covariances(("gaussian",), scan, found)
    assert best.effective_rings == best.spectrum_misfit == 0.0
