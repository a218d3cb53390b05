import numpy as np
import pytest
import scipy.fft

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed


@pytest.mark.parametrize(
    ("kind", "length"),
    # the last two are much longer than the strip is wide: the torus must grow to the reach of the covariance
    [("gaussian", 3.0), ("exponential", 1.2), ("gaussian", 0.02), ("gaussian", 25.0), ("exponential", 25.0)],
)
def test_the_covariance_on_the_mesh_is_exact(kind, length):
    """Filtered white noise has covariance irfft(root^2): compare it with the function at every lag of the mesh."""
    grid = Grid(30, 8, 1.0, 0.5)
    covariance = Covariance(kind, 2.0, length)
    embedding = embed(covariance, grid)
    on_torus = scipy.fft.irfft2(embedding.root**2, s=embedding.torus)[: grid.nx, : grid.ny]
    lags = covariance((grid.x() - 0.5)[:, None], (grid.y() - 0.25)[None, :])
    # clipped eigenvalues change no lag by more than their share of the variance
    np.testing.assert_allclose(on_torus, lags, atol=4.0 * (embedding.clipped_variance + 1e-13))
    assert embedding.clipped_variance < 1e-8


def test_sample_moments():
    grid = Grid(40, 6, 1.0, 1.0)
    embedding = embed(Covariance("gaussian", 3.0, 2.0), grid)
    fields = np.stack([embedding.sample(np.random.default_rng([7, i])) for i in range(2000)])
    corner, neighbour = fields[:, 0, 0], fields[:, 2, 0]
    # 2000 independent samples: standard errors sigma/sqrt(n) and sigma^2 sqrt((1 + rho^2)/n), four of them allowed
    assert abs(corner.mean()) < 4 * 3 / np.sqrt(2000)
    assert corner.var() == pytest.approx(9.0, abs=4 * 9 * np.sqrt(2 / 2000))
    rho = np.exp(-1.0)
    assert np.mean(corner * neighbour) == pytest.approx(9 * rho, abs=4 * 9 * np.sqrt((1 + rho**2) / 2000))


def test_same_generator_same_field():
    embedding = embed(Covariance("gaussian", 1.0, 2.0), Grid(16, 4, 1.0, 1.0))
    first, second = (embedding.sample(np.random.default_rng([1, 2, 3])) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_what_cannot_be_embedded_is_refused(monkeypatch):
    monkeypatch.setattr("roughslip.surface.embedding.NEGATIVE_SHARE", -1.0)  # as if every torus had negative values
    with pytest.raises(IllPosedError, match="shorter correlation length"):
        embed(Covariance("gaussian", 1.0, 2.0), Grid(16, 4, 1.0, 1.0))
