"""Exact sampling of stationary Gaussian fields on meshes by circulant embedding."""

import math

import numpy as np

from roughslip import fft
from roughslip.errors import IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.results import described, result
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.models import SelfAffine
from roughslip.validation import gate

NEGATIVE_SHARE = 1e-9  # of the largest eigenvalue: what rounding and a truncated tail may leave below zero
DOUBLINGS = 12
MOST_NODES = 2**25  # of the torus: a few arrays of 0.3 GB
IMAGE_SHARE = 5e-3  # of the largest decorrelation on the mesh: what periodic images may add to a lag
PROBED_LAGS = 64  # on an axis, where images are looked for
MOST_FOLDS = 16  # of the spectrum at the Nyquist wave number of an axis
CLIPPED = 0.01  # of the variance of a periodic cell, in eigenvalues below zero
KEYS = "roughness.correlation_length_m, strip.cell_m, roughness.scan.covariance"  # of fields that embed


@result
class Embedding:
    """Square root of the covariance on a torus that holds the mesh."""

    grid: Grid = described("the mesh")
    torus: tuple[int, int] = described("nodes of the torus on each axis")
    root: np.ndarray = described("square root of the eigenvalues of the circulant covariance", "m")
    clipped_variance: float = described("share of the variance in eigenvalues below zero, which were set to zero")
    image_share: float = described(
        "largest change of a correlation r by periodic images, over the largest 1 - r on the mesh, "
        "where the torus was given the spectrum",
        default=0.0,
    )

    @gate
    def sample(self, generator: np.random.Generator) -> np.ndarray:
        """z : (nx, ny) [m] heights, stationary with the covariance asked for: white noise on the torus, filtered.

        Backwards one axis at a time, so that rows beyond the mesh are not transformed.
        """
        spectrum = fft.r2c(generator.standard_normal(self.torus))
        spectrum *= self.root
        fft.c2c(spectrum, axes=(0,), forward=False, out=spectrum)
        heights = fft.c2r(spectrum[: self.grid.nx], axes=(1,), lastsize=self.torus[1], forward=False)
        return np.ascontiguousarray(heights[:, : self.grid.ny] * (1.0 / math.prod(self.torus)))


@gate
def embed(covariance: StationaryCovariance, grid: Grid) -> Embedding:
    """Circulant embedding (Dietrich and Newsam 1997) on the smallest of a few tori that is positive.

    Lags on the mesh are exact once the torus exceeds it by its own size, or by the reach of the covariance. On an axis
    shorter than the reach the excess doubles, up to twice the reach, while an eigenvalue lies below zero by more than
    NEGATIVE_SHARE of the largest. A self-affine covariance oscillates without end; its torus is given the spectrum
    itself, which keeps every power law, and grows until the image share is at most IMAGE_SHARE.

    Raises IllPosedError where no torus serves within MOST_NODES: use a shorter correlation length or larger cells;
    ParameterError where a self-affine spectrum extends far beyond the mesh.
    """
    if isinstance(covariance, SelfAffine):
        return _embed_spectrum(covariance, grid)
    reach = covariance.reach_m
    worst, torus = 0.0, grid.shape
    for doubling in range(DOUBLINGS):
        torus = (
            _even_fast_length(grid.nx + _excess(grid.nx, reach[0] / grid.dx, doubling)),
            _even_fast_length(grid.ny + _excess(grid.ny, reach[1] / grid.dy, doubling)),
        )
        if math.prod(torus) > MOST_NODES:
            break
        eigenvalues = circulant_eigenvalues(covariance, grid, torus)
        worst = float(eigenvalues.min() / eigenvalues.max())
        if worst >= -NEGATIVE_SHARE:
            negative = np.maximum(-eigenvalues, 0.0)
            clipped = float(negative.sum() / np.abs(eigenvalues).sum())
            return Embedding(grid, torus, np.sqrt(np.maximum(eigenvalues, 0.0)), clipped)
    raise IllPosedError(
        f"no torus up to {torus[0]} x {torus[1]} nodes embeds the covariance: smallest eigenvalue {worst:.1e} of the "
        "largest; use a shorter correlation length, larger cells or another model",
        KEYS,
    )


@gate
def embed_cell(covariance: StationaryCovariance, grid: Grid) -> Embedding:
    """The mesh as a torus of its own: surfaces that are periodic over it, for periodic cells.

    Lags are those of the nearest image, so the covariance is exact where it ends within half a cell. What lies below
    zero is clipped, and the variance kept. Raises IllPosedError where that is more than CLIPPED of it.
    """
    if isinstance(covariance, SelfAffine):
        eigenvalues = _folded_spectrum(covariance, grid, grid.shape) / grid.cell_area
    else:
        eigenvalues = circulant_eigenvalues(covariance, grid, grid.shape)
    positive = np.maximum(eigenvalues, 0.0)
    clipped = float(np.abs(positive - eigenvalues).sum() / np.abs(eigenvalues).sum())
    if clipped > CLIPPED:
        raise IllPosedError(
            f"a periodic cell of {grid.nx} x {grid.ny} nodes has {clipped:.1e} of the variance below zero: its edges "
            "are short against the correlation; use a shorter correlation length or another model",
            KEYS,
        )
    variance = fft.c2r(positive + 0j, lastsize=grid.ny, forward=False, inorm=2)[0, 0]
    return Embedding(grid, grid.shape, covariance.rms_height_m * np.sqrt(positive / variance), clipped)


def circulant_eigenvalues(covariance: StationaryCovariance, grid: Grid, torus: tuple[int, int]) -> np.ndarray:
    """(torus[0], torus[1] // 2 + 1) [m^2] of `circulant_lags`, without the imaginary part."""
    return np.ascontiguousarray(fft.r2c(circulant_lags(covariance, grid, torus)).real)


def circulant_lags(covariance: StationaryCovariance, grid: Grid, torus: tuple[int, int]) -> np.ndarray:
    """(torus) [m^2] covariance at the lags of a torus of even lengths with the cells of the mesh, lag zero first.

    Lags are those of the nearest image; at half a length two are equally near, and one of them is taken.
    """
    half = torus[0] // 2 + 1, torus[1] // 2 + 1
    y = np.arange(half[1]) * grid.dy
    lags = np.empty(torus)
    if covariance.mirror_symmetric:
        lags[: half[0], : half[1]] = covariance((np.arange(half[0]) * grid.dx)[:, None], y[None, :])
        lags[half[0] :, : half[1]] = lags[half[0] - 2 : 0 : -1, : half[1]]
    else:
        x = np.fft.fftfreq(torus[0], 1 / torus[0]) * grid.dx
        lags[:, : half[1]] = covariance(x[:, None], y[None, :])
    # C(x, -y) = C(-x, y): the rows of -x are those of x backwards, the first in its place
    lags[:, half[1] :] = np.roll(lags[::-1, half[1] - 2 : 0 : -1], 1, axis=0)
    return lags


def _embed_spectrum(covariance: SelfAffine, grid: Grid) -> Embedding:
    torus, images = grid.shape, math.inf
    for growth in range(DOUBLINGS):
        factor = 2 * 1.5**growth
        torus = _even_fast_length(factor * grid.nx), _even_fast_length(factor * grid.ny)
        if math.prod(torus) > MOST_NODES:
            break
        eigenvalues = _folded_spectrum(covariance, grid, torus) / grid.cell_area
        lags = fft.c2r(eigenvalues + 0j, lastsize=torus[1], forward=False, inorm=2)
        share = covariance.rms_height_m**2 / lags[0, 0]
        images = _image_share(covariance, grid, share * lags)
        if images <= IMAGE_SHARE:
            return Embedding(grid, torus, np.sqrt(share * eigenvalues), 0.0, images)
    raise IllPosedError(
        f"on tori up to {torus[0]} x {torus[1]} nodes periodic images change correlations by {images:.1e} of their "
        "fall; use a shorter roll-off wavelength, larger cells or another model",
        KEYS,
    )


def _folded_spectrum(covariance: SelfAffine, grid: Grid, torus: tuple[int, int]) -> np.ndarray:
    """S [m^4] at the wave vectors of the torus, plus those of all wave vectors that are equal at the nodes."""
    qx = 2 * math.pi * np.fft.fftfreq(torus[0], grid.dx)[:, None]
    qy = 2 * math.pi * np.fft.rfftfreq(torus[1], grid.dy)[None, :]
    shortest = min(covariance.cutoff_wavelengths_m)
    beyond_x, beyond_y = (math.ceil(cell / shortest - 0.5 - 1e-9) for cell in (grid.dx, grid.dy))
    if max(beyond_x, beyond_y) > MOST_FOLDS:
        raise ParameterError(
            f"waves of {shortest:.3g} m are cut off far below cells of {grid.dx:.3g} m x {grid.dy:.3g} m: "
            "cut off at two cells or more",
            scene_keys="roughness.bandwidth",
        )
    total = np.zeros((torus[0], torus[1] // 2 + 1))
    for i in range(-beyond_x, beyond_x + 1):
        for j in range(-beyond_y, beyond_y + 1):
            total += covariance.spectrum(qx + 2 * math.pi * i / grid.dx, qy + 2 * math.pi * j / grid.dy)
    return total


def _image_share(covariance: SelfAffine, grid: Grid, lags: np.ndarray) -> float:
    """Largest difference of the covariance on the torus from the one asked for, over the largest fall on the mesh.

    Over the fall, since a mesh much shorter than the roll-off holds a small part of the variance, and that is its form.
    """
    i = np.unique(np.linspace(0, grid.nx - 1, PROBED_LAGS).astype(int))
    j = np.unique(np.linspace(1 - grid.ny, grid.ny - 1, 2 * PROBED_LAGS - 1).astype(int))
    asked = covariance((i * grid.dx)[:, None], (j * grid.dy)[None, :])
    difference, fall = np.abs(lags[np.ix_(i, j)] - asked).max(), covariance.rms_height_m**2 - asked.min()
    return float(difference / fall) if fall > 0 else 0.0


def _excess(nodes: int, reach: float, doubling: int) -> float:
    """Nodes by which the torus exceeds the mesh on an axis; `reach` is that of the covariance in nodes."""
    first = min(nodes, reach)
    return min(first * 2**doubling, max(first, 2 * reach))


def _even_fast_length(nodes: float) -> int:
    length = int(np.ceil(nodes))
    while (length := fft.good_size(length, True)) % 2:
        length += 1
    return length
