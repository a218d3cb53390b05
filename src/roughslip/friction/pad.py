"""Friction of a pad of many windows under one rigid plane: its mean, its scatter, and the load that it bears.

All windows share the plane, so the pad has mu = tau sum(A) / sum(N) over all of them, light ones too. To first order it
scatters by the influence g = (tau A - mu N) / mean(N) of its parts (Hampel et al., Robust Statistics, 1986, ch. 2)::

    Var mu(pad) = mean over pairs of parts of C_g

C_g is measured along the strips, on blocks shorter than a window. What a Gaussian surface with the correlation rho does
at one place has C_g = sum_m a_m rho^m, a_m >= 0 (Mehler's formula). Non-negative least squares gives a_m, and a part
without correlation that takes what is shorter than rho. So rho carries C_g across the belt and beyond the strip.
Windows of a strip are solved alone: the elastic displacement by the neighbours across the belt is not in C_g.

`Blocks` are of strips, or of periodic cells that bear the same nominal pressure. Whole strips or cells are resampled.
Blocks give the scatter of pads, their own ratios that of single windows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import scipy  # its parts when they are used
from numpy.polynomial.legendre import legvander

from roughslip.errors import IllPosedError
from roughslip.friction.windows import Windows, estimate_of, resampled, window_sums
from roughslip.probability import Estimate

POWERS = (1, 2, 4, 8)  # of rho; those between are nearly sums of them
WINDOWS = 4.0 ** np.arange(11)  # of a pad, at which its scatter is given
NODE, WEIGHT = np.polynomial.legendre.leggauss(8)  # in a panel
FINEST = 8.0  # panels in a correlation length next to no distance
ROUNDING = 1e-7  # of the mean of friction, taken for no scatter
LEAST_SHARE = 1e-6  # of 1 / windows: the variance of a mean without long waves may be zero but for rounding

Correlation = Callable[[np.ndarray, np.ndarray], np.ndarray]
Estimates = dict[str, Estimate]


@dataclass(frozen=True)
class Surface:
    """Correlation of the heights.

    correlation : rho of distances along and across the belt [m], 1 at zero
    lengths_m : [m] 1/e lengths along and across
    """

    correlation: Correlation
    lengths_m: tuple[float, float]


def mean_powers(
    surface: Surface, length_m: float, width_m: float, lag_m: float | Sequence[float] | np.ndarray = 0.0
) -> np.ndarray:
    """Means of rho^m over pairs of points of two equal rectangles, one a lag along the belt behind the other.

    lag_m : () or (K,) [m]

    Returns (POWERS,) or (K, POWERS). The distance of two points has the density of a triangle along either edge. Panels
    double from an eighth of a correlation length on; the error is below 1e-4 where rho is smooth. The mean across the
    belt is taken once, and interpolated along it between the nodes of a panel.
    """
    lags, scale = np.atleast_1d(lag_m), surface.lengths_m[0]
    y, weight_y = distances(width_m, 0.0, surface.lengths_m[1])
    ends = graded(scale / FINEST, float(lags.max()) + length_m)
    low, half = ends[:-1], np.diff(ends) / 2.0
    rho = surface.correlation((low[:, None] + half[:, None] * (1.0 + NODE)).reshape(-1, 1), y[None, :])
    across = np.array([(rho**power @ weight_y).reshape(-1, len(NODE)) for power in POWERS])
    legendre = across @ (legvander(NODE, len(NODE) - 1) * WEIGHT[:, None]) * (np.arange(len(NODE)) + 0.5)
    means = []
    for lag in lags:
        x, weight = distances(length_m, float(lag), scale)
        panel = np.minimum(np.searchsorted(ends, np.abs(x), side="right") - 1, len(half) - 1)
        at = legvander((np.abs(x) - low[panel]) / half[panel] - 1.0, len(NODE) - 1)
        means.append(np.einsum("mxk,xk,x->m", legendre[:, panel], at, weight))
    return np.reshape(means, (*np.shape(lag_m), len(POWERS)))


def graded(step: float, end: float) -> np.ndarray:
    """Distances from zero to at least the end, at steps that double."""
    return step * (2.0 ** np.arange(1 + math.ceil(math.log2(2.0 + end / step))) - 1.0)


def distances(edge: float, lag: float, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Distances of points on two intervals `edge` long, a lag apart, and the weights of a mean over pairs."""
    low, high = lag - edge, lag + edge
    steps = graded(scale / FINEST, high)
    ends = np.unique([low, lag, high, *(x for x in (*steps, *-steps) if low < x < high)])
    half = np.diff(ends)[:, None] / 2.0
    x = (ends[:-1, None] + half * (1.0 + NODE)).ravel()
    return x, (half * WEIGHT).ravel() * (1.0 - np.abs(x - lag) / edge) / edge


@dataclass(frozen=True, eq=False)
class Blocks:
    """Contact of blocks at one level.

    area, force : (S, X, Y) [m^2], [N] of the blocks of S strips or cells, X along and Y across the belt
    block_m, width_m, window_m : length of a block, its width and that of a window, length of a window
    periodic : whether the last block along the belt is followed by the first
    """

    area: np.ndarray
    force: np.ndarray
    block_m: float
    width_m: float
    window_m: float
    periodic: bool

    @property
    def samples(self) -> int:
        """Number of strips or cells."""
        return len(self.area)

    @property
    def window(self) -> int:
        """Blocks of a window."""
        return round(self.window_m / self.block_m)

    @cached_property
    def rows(self) -> Windows:
        """Area and force (S Y, X) of the blocks one behind the other."""
        area, force = (part.transpose(0, 2, 1).reshape(-1, part.shape[1]) for part in (self.area, self.force))
        return area, force

    @cached_property
    def windows(self) -> Windows:
        """Area and force (S Y, W) of the windows that begin at each block, across the period too where there is one."""
        around = self.window - 1 if self.periodic else 0
        area, force = (
            window_sums(np.concatenate((part, part[:, :around]), axis=1), self.window, 1) for part in self.rows
        )
        return area, force

    def of_rows(self, weights: np.ndarray) -> np.ndarray:
        """Counts (1 + R, S Y) of the rows from those (1 + R, S) of the samples."""
        return np.repeat(weights, self.area.shape[2], axis=1)


def influence_covariance(blocks: Blocks, counts: np.ndarray) -> np.ndarray:
    """C_g (1 + R, lags) [1/Pa^2] at lags from 0 on, of so many blocks each, for tau = 1, pooled over rows.

    counts : (1 + R, rows) from `Blocks.of_rows`; each replicate has its own mu = sum(A) / sum(N)

    Lags of cells reach half a period: beyond, a block is nearer on the other side. Raises IllPosedError where no block
    carries force.
    """
    size = blocks.area.shape[1]
    of_a, of_f = (np.fft.rfft(values, 2 * size, axis=1) for values in blocks.rows)
    products = (np.abs(of_a) ** 2, 2.0 * (of_a * of_f.conj()).real, np.abs(of_f) ** 2)
    sums = [np.fft.irfft(product, axis=1)[:, :size] / (size - np.arange(size)) for product in products]
    return _of_products(sums, blocks, counts)[:, : size // 2 if blocks.periodic else size]


def adjacent_variance(blocks: Blocks, counts: np.ndarray) -> np.ndarray:
    """Variance (1 + R,) [1/Pa^2] of the mean influence of a window, as measured at every place."""
    a, f = (window_sums(values, blocks.window, 1) / blocks.window for values in blocks.rows)
    squares = [np.mean(product, axis=1, keepdims=True) for product in (a * a, 2.0 * a * f, f * f)]
    return np.maximum(_of_products(squares, blocks, counts)[:, 0], 0.0)


def _of_products(products: list[np.ndarray], blocks: Blocks, weights: np.ndarray) -> np.ndarray:
    """(1 + R, n) mean of A A' - mu (A N' + N A') + mu^2 N N' over mean(N)^2, from means (rows, n) of each row."""
    strips = weights.sum(axis=1)[:, None]
    aa, af, ff = (resampled(weights, product) / strips for product in products)
    of_strips = np.stack([values.mean(axis=1) for values in blocks.rows], axis=1)
    mean_a, mean_f = (resampled(weights, of_strips) / strips).T[:, :, None]
    if not (mean_f > 0.0).all():
        raise IllPosedError("in a resampled set of strips no block carries force: deepen the penetration")
    mu = mean_a / mean_f
    return np.asarray((aa - mu * af + mu**2 * ff) / mean_f**2)


def mehler_parts(covariance: np.ndarray, surface: Surface, block_m: float, width_m: float) -> np.ndarray:
    """a_m and the part without correlation (1 + R, POWERS and one more), relative to each other.

    Where the covariance shows no part, as where nothing scatters, all is without correlation.

    covariance : (1 + R, B) from `influence_covariance`
    block_m, width_m : length of a block, width of the strip
    """
    blocks = covariance.shape[1]
    table = np.column_stack((means_of_blocks(surface, block_m, width_m, blocks), np.arange(blocks) == 0))
    noise = np.sqrt(blocks - np.arange(blocks))  # C_g of a lag is known as from so many pairs
    q, r = np.linalg.qr(table * noise[:, None])
    seen = (covariance * noise) @ q
    scale = float(np.linalg.norm(seen[0])) or 1.0
    parts = np.array([scipy.optimize.nnls(r, row / scale)[0] for row in seen])
    parts[~parts.any(axis=1), -1] = 1.0
    return parts


@lru_cache(maxsize=4)
def means_of_blocks(surface: Surface, block_m: float, width_m: float, blocks: int) -> np.ndarray:
    """Means (blocks, POWERS) of rho^m over pairs of points of two blocks at each distance, as of `mean_powers`."""
    return mean_powers(surface, block_m, width_m, block_m * np.arange(blocks))


@lru_cache(maxsize=4)
def means_of_pads(
    surface: Surface, block_m: float, width_m: float, window_m: float, length_m: float | None
) -> np.ndarray:
    """Means (1 + WINDOWS, M) as of `pad_means` without a lag: of a window, and of pads."""
    pads = [(window_m, width_m), *(pad_edges(count, window_m, width_m, length_m) for count in WINDOWS)]
    return np.array([pad_means(surface, block_m, width_m, pad, np.zeros(1))[0] for pad in pads])


def pad_edges(windows: float, window_m: float, width_m: float, length_m: float | None = None) -> tuple[float, float]:
    """Length and width [m] of a pad: as long as given, else a square, or as long as a window and narrower."""
    area = windows * window_m * width_m
    length = min(max(math.sqrt(area), window_m), windows * window_m) if length_m is None else length_m
    return length, area / length


def pad_scatter(
    parts: np.ndarray,
    adjacent: np.ndarray,
    surface: Surface,
    block_m: float,
    width_m: float,
    window_m: float,
    length_m: float | None = None,
) -> np.ndarray:
    """Variance (1 + R, WINDOWS) [1/Pa^2] of pads from what the blocks of strips show, for tau = 1.

    parts : (1 + R, M) from `mehler_parts`
    adjacent : (1 + R,) of a single window, from `adjacent_variance`
    block_m, width_m, window_m : length of a block, width of the strip, length of a window
    length_m : of the pads, as of `pad_edges`

    A window has its own variance; that of pads differs from it as sum_m a_m mean(rho^m) does. a_m are those of each
    replicate.
    """
    modelled = parts @ means_of_pads(surface, block_m, width_m, window_m, length_m).T
    fallen = np.maximum(modelled[:, 1:] / modelled[:, :1], LEAST_SHARE / WINDOWS)
    return np.asarray(np.maximum(adjacent, LEAST_SHARE * adjacent[0])[:, None] * fallen)


def pad_means(
    surface: Surface, block_m: float, width_m: float, pad_m: tuple[float, float], lags_m: np.ndarray
) -> np.ndarray:
    """Means (K, M) of rho^m, and of what has no correlation, over pairs of points of a pad and of the pad a lag behind.

    block_m, width_m : length of a block, width of the strip
    pad_m : length and width of the pad
    lags_m : (K,) [m] slipped distances from 0 on

    Their product with a row of `mehler_parts` is the covariance of the friction of the pad over the slipped distance.
    Without correlation it is the triangle 1 - s / length: the friction of a long pad is correlated over its own length.
    """
    length, width = pad_m
    none = block_m * width_m / (length * width) * np.maximum(1.0 - lags_m / length, 0.0)
    return np.column_stack((mean_powers(surface, length, width, lags_m), none))


def between_pads(variance: np.ndarray, windows: np.ndarray) -> np.ndarray:
    """Variance (1 + R,) of pads of as many windows : (1 + R,), at least 1: power laws between WINDOWS, and beyond."""
    place = np.log(windows) / math.log(WINDOWS[1])
    low = np.clip(place.astype(int), 0, len(WINDOWS) - 2)
    rows, share, logs = np.arange(len(place)), place - low, np.log(variance)
    return np.exp(logs[rows, low] * (1.0 - share) + logs[rows, low + 1] * share)


def pads(
    blocks: Blocks, surface: Surface, weights: np.ndarray, length_m: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Parts (1 + R, M) of the influence of blocks, as of `mehler_parts`, and the variance of pads, as of `pad_scatter`.

    weights : (1 + R, S) counts of strips or cells, from `strip_weights`
    length_m : of pads; None for squares

    Friction that does not scatter, as of contact that yields everywhere, scatters by the share ROUNDING of its mean.
    """
    counts = blocks.of_rows(weights)
    parts = mehler_parts(influence_covariance(blocks, counts), surface, blocks.block_m, blocks.width_m)
    adjacent = np.maximum(adjacent_variance(blocks, counts), (ROUNDING * blocks.area.sum() / blocks.force.sum()) ** 2)
    return parts, pad_scatter(parts, adjacent, surface, blocks.block_m, blocks.width_m, blocks.window_m, length_m)


def pad_estimates(
    blocks: Blocks, surface: Surface, weights: np.ndarray, windows: float = 1.0, length_m: float | None = None
) -> Estimates:
    """What cells show of pads under their load, for a shear strength of 1 Pa, by name.

    weights, length_m : as of `pads`
    windows : of the pad that bears the load, at least 1

    ratio : () [1/Pa] area over force of all blocks
    pad_std : (WINDOWS,) [1/Pa] standard deviation of this ratio of pads
    load_std : () [1/Pa] that of the pad of the load
    pad_parts : of the powers of the correlation in the influence
    no_contact : () [-] share of the windows without contact
    """
    parts, variance = pads(blocks, surface, weights, length_m)
    totals = resampled(weights, np.stack((blocks.area.sum(axis=(1, 2)), blocks.force.sum(axis=(1, 2))), axis=1)).T
    counts, empty = blocks.of_rows(weights), (blocks.windows[1] <= 0.0).mean(axis=1, keepdims=True)
    rows = {
        "ratio": totals[0] / totals[1],
        "pad_std": np.sqrt(variance),
        "load_std": np.sqrt(between_pads(variance, np.full(len(weights), float(windows)))),
        "pad_parts": parts,
        "no_contact": (resampled(counts, empty) / counts.sum(axis=1)[:, None])[:, 0],
    }
    return _estimates(rows, blocks.samples)


def under_load(found: Estimates, mean: float, pressure_pa: float, cells: int) -> Estimates:
    """The same at the shear strength that gives the pad this mean, with that strength and the real area.

    found : from `pad_estimates` of so many cells under this nominal pressure
    """
    ratio = found["ratio"].rows
    shear = mean / ratio
    rows = {
        "shear_strength": shear,
        "real_area": ratio * pressure_pa,
        "load_mean": np.full(len(ratio), mean),
        "load_std": shear * found["load_std"].rows,
        "pad_std": shear[:, None] * found["pad_std"].rows,
    }
    return found | _estimates(rows, cells)


def _estimates(rows: dict[str, np.ndarray], cells: int) -> Estimates:
    kinds = {name: "std" if name.endswith("std") else "mean" for name in rows}
    found = {name: estimate_of(kinds[name], values, cells) for name, values in rows.items()}
    if share := found.get("no_contact"):  # the margin of few cells may leave [0, 1]
        found["no_contact"] = replace(share, low=np.maximum(share.low, 0.0), high=np.minimum(share.high, 1.0))
    return found
