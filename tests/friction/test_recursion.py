"""Friction paths by recursion: exact correlation, pieces, speed of decay, the ends of the range of shapes."""

import math

import numpy as np
import pytest
from scipy.stats import beta as beta_distribution

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction import recursion as module
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.probability import BetaDistribution, QuantileDistribution, Translation

LENGTH = 250e-6
PUBLISHED = FrictionProcess(BetaDistribution(2.1, 5.0, 0.1, 0.7), LENGTH)
BORDER = [(0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.05, 3.0), (0.3, 3.0), (2.1, 5.0), (0.1, 300.0), (90.0, 300.0)]


def process(a, b):
    return FrictionProcess(BetaDistribution(a, b, 0.0, 1.0), LENGTH)


def state_covariance(built):
    """P with P = diag(rho) P diag(rho) + c c' by doubling the number of past steps that it sums, not in closed form."""
    decay, total = built.decay, np.outer(built.gain, built.gain)
    for _ in range(60):
        total = total + decay[:, None] * total * decay
        decay = decay**2
    return total


@pytest.fixture(scope="module")
def ensemble():
    """2000 paths of 200 correlation lengths, 16 nodes in each, over the standard deviation."""
    built = recursion(PUBLISHED, LENGTH / 16)
    paths = np.array([next(iter(built.realisation([5, k], 3200))) for k in range(2000)])
    return paths / PUBLISHED.marginal.standard_deviation


def test_autocorrelation_of_many_paths(ensemble):
    """Within 0.01 of the exponential up to four correlation lengths, which is four standard errors and more."""
    for lag in range(0, 65, 2):
        products = np.mean(ensemble[:, : 3200 - lag] * ensemble[:, lag:], axis=1)
        assert 4 * products.std(ddof=1) / math.sqrt(2000) < 0.01
        assert products.mean() == pytest.approx(math.exp(-lag / 16), abs=0.01)


def test_marginal_of_many_paths(ensemble):
    """The Kolmogorov distance is at most 0.003.

    Indicators at the median have the correlation (2 / pi) asin(exp(-s / L)), with the length 2 L ln 2. So 400 000
    lengths hold 290 000 independent values, and a distance of 0.003 has a probability of 1 %. At 2000 quantiles the
    distance is at most 1 / 2000 too small.
    """
    probability = np.arange(1, 2000) / 2000
    law = beta_distribution(2.1, 5.0)
    values = np.sort(ensemble.ravel())
    shares = np.searchsorted(values, (law.ppf(probability) - law.mean()) / law.std()) / values.size
    assert np.max(np.abs(shares - probability)) + 1 / 2000 <= 0.003


def test_increments_of_many_paths(ensemble):
    """E[(mu(s + h) - mu(s))^2] = 2 var (1 - exp(-h / L)), which is linear in h at small lag: no derivative exists."""
    mean_squares = []
    for lag in (1, 2, 4, 8):
        squares = np.mean((ensemble[:, lag:] - ensemble[:, :-lag]) ** 2, axis=1)
        error = squares.std(ddof=1) / math.sqrt(2000)
        assert squares.mean() == pytest.approx(-2.0 * math.expm1(-lag / 16), abs=5 * error)
        mean_squares.append(squares.mean())
    assert np.log2(mean_squares[1] / mean_squares[0]) == pytest.approx(1.0, abs=0.06)  # 1/32 / ln 2 of the exponential


@pytest.mark.parametrize("nodes", [1, 7, 4096, 5000])
def test_pieces_of_any_length_are_one_path(nodes):
    built = recursion(PUBLISHED, LENGTH / 16)
    whole = next(iter(built.realisation([1, 2], 5000)))
    found: list[float] = []
    for piece in built.realisation([1, 2], nodes):
        assert piece.size == nodes
        found.extend(piece)
        if len(found) >= 5000:
            break
    assert np.array_equal(found[:5000], whole)


def test_a_path_begins_anew():
    path = recursion(PUBLISHED, LENGTH / 16).realisation([1, 2], 100)
    assert np.array_equal(next(iter(path)), next(iter(path)))


@pytest.mark.parametrize(("a", "b"), BORDER)
@pytest.mark.parametrize("nodes", [0.25, 2, 16, 1000])
def test_errors_are_those_of_what_was_built(a, b, nodes):
    """The covariance of the state, summed step by step, gives the reported errors of the autocorrelation, and the
    Cholesky factor in closed form gives that covariance."""
    built = recursion(process(a, b), LENGTH / nodes)
    covariance = state_covariance(built)
    size = np.abs(covariance).max()
    assert covariance.sum() == pytest.approx(1.0, abs=1e-12 * size)
    assert built.start @ built.start.T == pytest.approx(covariance, abs=1e-9 * size)
    lags = np.unique(np.geomspace(1, 20 * max(nodes, 1), 40).astype(int))
    gaussian = np.array([(built.decay**lag @ covariance).sum() for lag in lags])
    wanted = np.exp(-lags / nodes)
    missed = np.abs(built.translation.correlation(gaussian) - wanted)
    rounding = 1e-13 * size
    assert np.max(missed) <= built.correlation_error + rounding
    assert np.max(missed / (1.0 - wanted)) <= built.increment_error + rounding * nodes
    assert built.correlation_error <= 1e-3


@pytest.mark.parametrize(
    ("shapes", "terms", "error"), [((1000.0, 1000.0), 1, 1e-6), ((90.0, 300.0), 2, 1e-7), ((2.1, 5.0), 3, 1e-6)]
)
def test_few_exponentials_are_enough(shapes, terms, error):
    """One for a marginal that is nearly normal, where it is the Ornstein-Uhlenbeck recursion; three for the paper's."""
    built = recursion(process(*shapes), LENGTH / 16)
    assert built.decay == pytest.approx(np.exp(-np.arange(1, terms + 1) / 16), rel=1e-14)
    assert built.correlation_error < error
    assert built.increment_error <= 1e-3
    if terms == 1:
        assert built.gain == pytest.approx(np.sqrt(-np.expm1(-2 / 16)), rel=1e-14)
        assert built.start == pytest.approx(1.0, rel=1e-14)


def test_one_exponential_would_not_do():
    """The Ornstein-Uhlenbeck process translated errs by the 0.008 that the Hermite series of Beta(2.1, 5) foretells."""
    x = np.linspace(0.0, 1.0, 1001)
    table = recursion(PUBLISHED, LENGTH / 16).translation
    assert np.max(np.abs(table.correlation(x) - x)) == pytest.approx(0.0078, abs=1e-4)


@pytest.mark.parametrize(("a", "b"), [(0.02, 0.1), (0.05, 0.05)])
def test_near_two_points_is_refused(a, b):
    with pytest.raises(IllPosedError, match="Hermite series"):
        recursion(process(a, b), LENGTH / 16)


def test_a_correlation_that_no_process_has_is_refused(monkeypatch):
    """Flat up to a lag and then none: its spectrum has negative parts."""
    monkeypatch.setattr(Translation, "gaussian_correlation", lambda self, x: np.where(x > 0.5, 1.0, 0.0))
    monkeypatch.setattr(module, "CORRELATION_LIMIT", math.inf)
    with pytest.raises(IllPosedError, match="not positive"):
        recursion(PUBLISHED, LENGTH / 16)


def test_too_few_exponentials_are_refused(monkeypatch):
    monkeypatch.setattr(module, "MOST_TERMS", 1)
    with pytest.raises(IllPosedError, match="1 exponentials leave"):
        recursion(process(0.3, 3.0), LENGTH / 16)


@pytest.mark.parametrize("spacing", [0.0, -1e-6, math.nan, math.inf, 1e-7 * LENGTH, 20 * LENGTH])
def test_refuses_a_spacing(spacing):
    with pytest.raises(ParameterError, match="spacing"):
        recursion(PUBLISHED, spacing)


@pytest.mark.parametrize("ratio", [4.0, 7.5, 10.0])
def test_nodes_many_lengths_apart(ratio):
    """Eight decays exp(-i ratio) vanish against one, and their differences with them.

    At the lags of the nodes few terms give the correlation within the tolerance.
    """
    marginal = QuantileDistribution(beta_distribution(2.1, 5.0).ppf(np.linspace(0.0, 1.0, 400)), 0.3, 0.05)
    built = recursion(FrictionProcess(marginal, LENGTH), ratio * LENGTH)
    lags = built.decay ** np.arange(1, 4)[:, None]
    gaussian = lags @ state_covariance(built).sum(axis=1)
    reached = built.translation.correlation(gaussian)
    np.testing.assert_allclose(reached, np.exp(-ratio * np.arange(1, 4)), atol=module.CORRELATION_TOLERANCE)
    assert len(built.decay) * ratio <= 30.0
    assert state_covariance(built).sum() == pytest.approx(1.0, abs=1e-9)


def test_refuses_a_piece_of_nothing():
    with pytest.raises(ParameterError, match="at least one node"):
        recursion(PUBLISHED, LENGTH / 16).realisation([1], 0)
