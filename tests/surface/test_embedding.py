import numpy as np
import pytest
import scipy.fft
from scipy.special import kolmogi, ndtr, ndtri

from roughslip.errors import IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.surface.embedding import circulant_eigenvalues, circulant_lags, embed, embed_cell
from roughslip.surface.measured_covariance import measured_covariance
from roughslip.surface.models import covariance_of, self_affine


def measured(lag=0.5):
    """Rotated and with a negative lobe, as the table of a ground surface; not symmetric in x."""
    x, y = np.arange(-20, 21)[:, None] * lag, np.arange(-20, 21)[None, :] * lag
    table = covariance_of("gaussian", 1.0, 3.0, 1.0, lay_rad=0.5)(x, y) * np.cos(0.8 * (x + y))
    return measured_covariance(table, lag, lag, 2.0)


MODELS = {
    "rotated exponential": covariance_of("exponential", 2.0, 3.0, 0.7, lay_rad=0.5),
    "rotated gaussian": covariance_of("gaussian", 2.0, 3.0, 1.0, lay_rad=-0.9),
    "separable exponential": covariance_of("separable_exponential", 2.0, 3.0, 1.0),
    "rotated matern": covariance_of("matern", 2.0, 2.0, 1.0, lay_rad=0.5, smoothness=1.4),
    "long gaussian": covariance_of("gaussian", 2.0, 25.0),
    "long exponential": covariance_of("exponential", 2.0, 25.0),
    "self-affine": self_affine(2.0, 0.8, 8.0, 2.0, 5.0, 0.4),
    "measured": measured(),
}


def on_mesh(embedding):
    """Filtered white noise has covariance irfft(root^2): at every lag of the mesh, y of both signs."""
    lags = scipy.fft.irfft2(embedding.root**2, s=embedding.torus)
    nx, ny = embedding.grid.shape
    return lags[:nx, np.arange(1 - ny, ny)]


def asked(covariance, grid):
    return covariance((np.arange(grid.nx) * grid.dx)[:, None], (np.arange(1 - grid.ny, grid.ny) * grid.dy)[None, :])


@pytest.mark.parametrize("name", MODELS)
def test_every_model_is_exact_or_says_by_how_much_it_is_not(name):
    """Long ones are much longer than the mesh is wide: the torus must grow to the reach of the covariance."""
    covariance = MODELS[name]
    for grid in (Grid(24, 15, 1.0, 0.7), Grid(9, 40, 0.5, 0.5)):
        embedding = embed(covariance, grid)
        lags = asked(covariance, grid) / covariance.rms_height_m**2
        difference = np.abs(on_mesh(embedding) / covariance.rms_height_m**2 - lags).max()
        if name == "self-affine":  # all lags of so small a mesh are probed
            assert difference == pytest.approx(embedding.image_share * (1 - lags.min()), rel=1e-9)
            assert embedding.image_share < 5e-3
            assert on_mesh(embedding)[0, grid.ny - 1] == pytest.approx(covariance.rms_height_m**2, rel=1e-13)
        else:  # clipped eigenvalues change no lag by more than their share of the variance
            assert difference < embedding.clipped_variance + 1e-13
        assert embedding.clipped_variance < 1e-8


def test_self_affine_waves_beyond_the_mesh_fold_back():
    """Cells of half a roll-off wavelength: the nodes cannot distinguish most waves, yet have the covariance C."""
    covariance = self_affine(1.0, 0.3, 4.0, 0.5)
    embedding = embed(covariance, Grid(16, 16, 2.0, 1.0))
    difference = np.abs(on_mesh(embedding) - asked(covariance, Grid(16, 16, 2.0, 1.0))).max()
    assert difference < 2 * embedding.image_share < 1e-2  # correlations fall from 1 by less than 2


def test_self_affine_keeps_its_power_law():
    """The eigenvalues are the spectrum over the cell, up to the one factor that restores the variance."""
    grid = Grid(64, 64, 1.0, 1.0)
    covariance = self_affine(1.0, 0.8, 16.0, 2.0)
    embedding = embed(covariance, grid)
    q = 2 * np.pi * scipy.fft.rfftfreq(embedding.torus[1])
    ratio = embedding.root[0, :-1] ** 2 / covariance.spectrum(q[:-1])  # the last lies on the cut-off
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)
    assert ratio[0] == pytest.approx(1.0, abs=1e-2)  # the sum over the torus is not quite the integral
    q_r = 2 * np.pi / 16.0
    assert ratio[0] == pytest.approx(embedding.root[0, q > 2 * q_r][0] ** 2 / covariance.spectrum(q[q > 2 * q_r][0]))


@pytest.mark.parametrize("covariance", [MODELS["rotated exponential"], MODELS["separable exponential"]])
def test_eigenvalues_are_those_of_lags_laid_out_plainly(covariance):
    """Mirroring is a shortcut; at half the torus a rotated covariance takes the mean of both nearest images."""
    grid, torus = Grid(5, 7, 1.0, 0.8), (12, 16)
    i, j = (scipy.fft.fftfreq(n, 1 / n) for n in torus)
    lags = covariance((i * grid.dx)[:, None], (j * grid.dy)[None, :])
    mirrored = np.roll(lags[::-1, ::-1], (1, 1), axis=(0, 1))
    plain = scipy.fft.rfft2((lags + mirrored) / 2).real
    ours = circulant_eigenvalues(covariance, grid, torus)
    back = scipy.fft.irfft2(ours, s=torus)
    inside = np.ix_(np.abs(i) < 6, np.abs(j) < 8)
    np.testing.assert_allclose(back[inside], lags[inside], atol=1e-14)
    if covariance.mirror_symmetric:
        np.testing.assert_allclose(ours, plain, atol=1e-12)


@pytest.mark.parametrize("name", ["self-affine", "measured"])
def test_ten_thousand_samples_have_the_covariance_spectrum_and_marginal_asked_for(name):
    """Each test at its share of one family-wise level of 1e-3 over the two models; scatter from the samples."""
    covariance, grid, count = MODELS[name], Grid(12, 10, 1.0, 1.0), 10_000
    embedding = embed(covariance, grid)
    generator = np.random.default_rng([11, len(name)])
    fields = np.stack([embedding.sample(generator) for _ in range(count)])
    level = 1e-3 / 2 / 3

    def within(samples, expected):
        """Means over samples (count, n) against (n,), by the normal law with Bonferroni's correction."""
        error = samples.std(axis=0) / np.sqrt(count)
        limit = -ndtri(level / 2 / samples.shape[1])
        return np.all(np.abs(samples.mean(axis=0) - expected) < limit * error + bias)

    bias = 2 * covariance.rms_height_m**2 * embedding.image_share  # correlations fall from 1 by less than 2
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    matrix = covariance(x[:, None] - x[None, :], y[:, None] - y[None, :])
    flat = fields.reshape(count, -1)
    node = grid.ny * 3 + 4
    assert within(flat * flat[:, node : node + 1], matrix[node])

    # E |sum z exp(-i q x)|^2 is a quadratic form of the covariance matrix, leakage of the mesh's edges included
    spectra = scipy.fft.rfft2(fields)
    waves = scipy.fft.rfft2(np.eye(grid.size).reshape(grid.size, *grid.shape)).reshape(grid.size, -1)
    expected = np.einsum("aq,ab,bq->q", waves.conj(), matrix, waves).real
    bias = expected * embedding.image_share * 10  # of the longest waves, a plateau of the same sign at all lags
    assert within(np.abs(spectra.reshape(count, -1)) ** 2, expected)

    heights = np.sort(fields[:, 3, 4]) / covariance.rms_height_m
    steps = np.arange(count + 1) / count
    distance = max(np.max(steps[1:] - ndtr(heights)), np.max(ndtr(heights) - steps[:-1]))
    assert distance < kolmogi(level) / np.sqrt(count)


def test_a_cell_has_the_covariance_up_to_half_a_period():
    """Of eight correlation lengths a Gaussian one ends at half of them, and the variance is exact. Waves are periodic.

    At one length the nearest image has a kink, which costs more than a hundredth of the variance. A self-affine surface
    is given its spectrum.
    """
    grid = Grid(64, 48, 1e-6, 1e-6)
    smooth = covariance_of("gaussian", 2e-7, 6e-6)
    cell = embed_cell(smooth, grid)
    lags = scipy.fft.irfft2(cell.root**2, grid.shape)
    assert cell.torus == grid.shape
    np.testing.assert_allclose(lags, circulant_lags(smooth, grid, grid.shape), atol=1e-7 * 4e-14)
    affine = embed_cell(self_affine(2e-7, 0.8, 2e-5, 4e-6), grid)
    assert scipy.fft.irfft2(affine.root**2, grid.shape)[0, 0] == pytest.approx(4e-14, rel=1e-12)
    with pytest.raises(IllPosedError, match="its edges are short against the correlation"):
        embed_cell(covariance_of("gaussian", 2e-7, 6e-5), grid)


def test_samples_are_white_noise_filtered_on_the_whole_torus():
    """To rounding: leaving out the rows beyond the mesh is a matter of speed alone."""
    embedding = embed(covariance_of("exponential", 1.0, 7.0), Grid(33, 15, 1.0, 1.0))
    noise = scipy.fft.rfft2(np.random.default_rng(4).standard_normal(embedding.torus))
    whole = scipy.fft.irfft2(embedding.root * noise, s=embedding.torus)
    np.testing.assert_allclose(embedding.sample(np.random.default_rng(4)), whole[:33, :15], rtol=0, atol=1e-14)


def test_what_cannot_be_embedded_is_refused(monkeypatch):
    with pytest.raises(ParameterError, match="two cells"):
        embed(self_affine(1.0, 0.8, 1.0, 0.01), Grid(16, 4, 1.0, 1.0))
    monkeypatch.setattr("roughslip.surface.embedding.MOST_NODES", 2**16)
    with pytest.raises(IllPosedError, match="roll-off"):  # waves of 10^5 cells fit no torus
        embed(self_affine(1.0, 0.8, 1e5, 2.0), Grid(64, 64, 1.0, 1.0))
    monkeypatch.setattr("roughslip.surface.embedding.NEGATIVE_SHARE", -1.0)  # as if every torus had negative values
    with pytest.raises(IllPosedError, match="shorter correlation length"):
        embed(covariance_of("gaussian", 1.0, 2.0), Grid(16, 4, 1.0, 1.0))
