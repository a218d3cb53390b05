"""A measured topography: heights on a mesh of rectangular cells, its missing points filled, its form removed.

Waves longer than a cutoff are removed by the areal Gaussian high-pass of ISO 16610-61.

The mean over the weights exp(-pi r^2 / (alpha lambda)^2) is taken off, with alpha^2 = ln(2) / pi. It keeps
exp(-pi (alpha lambda / wavelength)^2) of a wave, one half at the cutoff lambda. The weights are a product, so that both
axes are filtered one after the other. At the rim they are cut off. There the mean is the value of the
weighted least squares line, as ISO 16610-28 allows. So a plane is taken off to the last point.

Outliers, as dust, dirt and bad pixels, are spots far from the bulk of heights and from their surroundings.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
import scipy
import scipy.sparse
from numpy.polynomial.legendre import legvander
from scipy.ndimage import binary_dilation, find_objects, label
from scipy.sparse.linalg import spsolve

from roughslip.errors import InputError, ParameterError
from roughslip.grid import Grid
from roughslip.results import described, result
from roughslip.surface.plausibility import MOST_SLOPE
from roughslip.validation import gate

Form = Literal["mean", "plane", "quadratic"]

FEWEST_NODES = 32  # on each axis: below this no statistic of a scan has an interval worth the name
# Largest share of points without a height. Filled points are too smooth, and they lower the spectrum in proportion.
MOST_MISSING = 0.10
RIM_MISSING = 0.5  # an outer row or column that misses more than this share is cut off
ROUNDING = 1e-10  # heights that scatter by less than this share of their range before removal of form are rounding


@result
class Topography:
    """Heights of a scan, complete on its mesh."""

    heights: np.ndarray = described("heights, finite everywhere", "m", "x y")
    dx: float = described("distance of neighbouring points along x", "m")
    dy: float = described("distance of neighbouring points along y", "m")
    missing: np.ndarray = described("true where the instrument gave no height and one was interpolated", "1", "x y")
    read: str = described("array or channel, size, what was cut and how many points are missing, in words", default="")
    cut: float = described("share of the points read that lay in an empty rim and were cut off", default=0.0)

    def __post_init__(self) -> None:
        if self.heights.ndim != 2 or self.heights.dtype != np.float64 or not np.isfinite(self.heights).all():
            raise ParameterError("heights of a topography are (nx, ny), float64 and finite")
        if self.missing.shape != self.heights.shape or self.missing.dtype != bool or self.missing.all():
            raise ParameterError("missing must be bool, of the shape of the heights, and leave some of them")
        _ = self.grid  # refuses impossible cells

    @property
    def grid(self) -> Grid:
        """The mesh of the scan."""
        nx, ny = self.heights.shape
        return Grid(nx, ny, self.dx, self.dy)

    @property
    def measured(self) -> np.ndarray:
        """(nx, ny) bool, true where the height was measured: what statistics of heights are taken of."""
        return ~self.missing


def topography(heights: np.ndarray, dx: float, dy: float, source: str, words: str = "heights in m") -> Topography:
    """A topography from what an instrument gave: rim cut off, holes filled.

    heights : (nx, ny) [m], x along the belt; NaN, infinite or masked where there is none
    dx, dy : [m] distances of neighbouring points
    source : names the scan in messages, such as the path of its file
    words : what the heights are in their file, for `read`

    Outer rows and columns that miss more than RIM_MISSING of their points are cut off one at a time, the emptiest
    first. Holes are filled by harmonic interpolation.

    Raises InputError, one line that names the source, for a scan that is no map, is constant, or misses more than
    MOST_MISSING of what is left inside the rim.
    """
    heights = np.ma.filled(np.ma.array(heights, dtype=np.float64), np.nan)
    if heights.ndim != 2:
        raise InputError(f"{source}: holds {heights.ndim}-dimensional heights; a map of heights has two dimensions")
    if not (np.isfinite([dx, dy]).all() and min(dx, dy) > 0.0):
        raise InputError(f"{source}: points lie {dx} m x {dy} m apart; both distances must be positive and finite")
    missing = ~np.isfinite(heights)
    if missing.all():
        raise InputError(f"{source}: no point has a height; at most {MOST_MISSING:.0%} of a scan may be missing")
    inside = _inside_rim(missing)
    (rows, columns), heights, missing = heights.shape, heights[inside], missing[inside]
    cut = 1.0 - heights.size / (rows * columns)
    kept = f"{heights.shape[0]} x {heights.shape[1]} of {rows} x {columns} points used, {cut:.1%} cut off as empty rim"
    if min(heights.shape) < FEWEST_NODES:
        raise InputError(
            f"{source}: {heights.shape[0]} x {heights.shape[1]} points with heights; a scan needs at least "
            f"{FEWEST_NODES} on each axis" + (f"; {kept}" if cut else "")
        )
    if missing.mean() > MOST_MISSING:
        raise InputError(
            f"{source}: {missing.mean():.1%} of the points have no height; at most {MOST_MISSING:.0%} may be missing"
            + (f"; {kept}" if cut else "")
        )
    if np.ptp(heights[~missing]) == 0.0:
        raise InputError(f"{source}: all heights are equal; a scan must show some roughness")
    holes = f"{missing.sum()} missing ({100 * missing.mean():.2g} %), interpolated" if missing.any() else "none missing"
    distances = f"{1e6 * dx:.4g} x {1e6 * dy:.4g} µm apart"
    size = kept if cut else f"{rows} x {columns} points"
    read = f"{words}; {size}, {distances}; {holes}"
    return Topography(_filled(heights, missing, dx, dy), float(dx), float(dy), np.ascontiguousarray(missing), read, cut)


@gate
def remove_form(scan: Topography, form: Form) -> Topography:
    """The scan less its form, the least squares over its measured points; holes are filled anew.

    form : "mean", "plane" or "quadratic" (all six terms to degree two in x and y)

    Legendre polynomials on the mesh keep the normal equations well conditioned. Raises ParameterError for another form
    and where nothing but rounding is left.
    """
    degree = get_args(Form).index(form)
    of_x, of_y = (legvander(np.linspace(-1.0, 1.0, n), degree).T for n in scan.grid.shape)
    terms = [(p, of_y[j]) for i, p in enumerate(of_x) for j in range(degree + 1 - i)]
    weight = scan.measured.astype(np.float64)
    normal = np.array([[np.einsum("x,xy,y", p * r, weight, q * s) for r, s in terms] for p, q in terms])
    right = np.array([np.einsum("x,xy,y", p, weight * scan.heights, q) for p, q in terms])
    shape = sum(c * np.outer(p, q) for c, (p, q) in zip(np.linalg.solve(normal, right), terms, strict=True))
    residual = scan.heights - shape
    before, after = np.ptp(scan.heights[scan.measured]), np.std(residual[scan.measured])
    if after <= ROUNDING * before:
        raise ParameterError(f"nothing is left of the scan once its {form} is removed: remove less, or scan a surface")
    return replace(scan, heights=_filled(residual, scan.missing, scan.dx, scan.dy))


def _inside_rim(missing: np.ndarray) -> tuple[slice, slice]:
    """What is left when outer lines that miss more than RIM_MISSING are cut off, the emptiest first."""
    low, high = [0, 0], list(missing.shape)
    while True:
        inside = slice(low[0], high[0]), slice(low[1], high[1])
        part = missing[inside]
        shares = [part[0].mean(), part[-1].mean(), part[:, 0].mean(), part[:, -1].mean()]
        emptiest = int(np.argmax(shares))
        if shares[emptiest] <= RIM_MISSING:
            return inside
        axis, end = divmod(emptiest, 2)
        if high[axis] - low[axis] == 1:
            return inside  # a single line is left, which no statistic takes anyway
        if end:
            high[axis] -= 1
        else:
            low[axis] += 1


def _filled(heights: np.ndarray, missing: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """Heights whose missing ones solve the discrete Laplace equation, with no slope across the edge of the scan.

    Harmonic rather than biharmonic: holes lie next to steep flanks, where a biharmonic surface overshoots, while a
    harmonic one stays within the heights around the hole. Rather than nearest: no steps, which raise the spectrum.
    """
    filled, holes = np.where(missing, 0.0, heights), np.flatnonzero(missing)
    if not holes.size:
        return filled
    number, edges = np.arange(missing.size).reshape(missing.shape), []
    for axis, step in enumerate((dx, dy)):
        near = np.delete(missing, 0, axis) | np.delete(missing, -1, axis)
        one, other = (np.delete(number, end, axis)[near] for end in (0, -1))
        edges.append((np.full(one.size, step**-2), one, other))
    weight, one, other = (np.concatenate(parts) for parts in zip(*edges, strict=True))
    graph = scipy.sparse.coo_array((weight, (one, other)), shape=(missing.size, missing.size))
    laplacian = scipy.sparse.csgraph.laplacian(graph, symmetrized=True).tocsr()[holes]
    filled[missing] = spsolve(laplacian[:, holes].tocsc(), -(laplacian @ filled.ravel()))
    return filled


ALPHA = math.sqrt(math.log(2.0) / math.pi)
REACH = 1.7  # cutoffs from the point at which the weight is 1e-18
FEWEST_CELLS = 5.0  # of a cutoff: sums over nodes then give one half to 3e-8


def high_pass(scan: Topography, cutoff_m: float) -> Topography:
    """The scan less its waves longer than `cutoff_m` [m], those of what fills its holes with them.

    Raises ParameterError for a cutoff below FEWEST_CELLS cells or above the shorter edge of the scan, and where
    nothing but rounding is left.
    """
    minimum = FEWEST_CELLS * max(scan.dx, scan.dy)
    maximum = min(scan.grid.nx * scan.dx, scan.grid.ny * scan.dy)
    if not minimum <= cutoff_m <= maximum:
        raise ParameterError(
            f"cutoff_m = {cutoff_m:.3g}; allowed are {minimum:.3g} m, five cells of the scan, to "
            f"{maximum:.3g} m, its shorter edge",
            scene_keys="roughness.scan.cutoff_m",
        )
    long = _smoothed(_smoothed(scan.heights, cutoff_m / scan.dx).T, cutoff_m / scan.dy).T
    left = scan.heights - long
    if np.std(left) <= ROUNDING * np.ptp(scan.heights):
        raise ParameterError(f"cutoff_m = {cutoff_m:.3g}: no shorter waves are left of the scan")
    return replace(scan, heights=left)


def _smoothed(heights: np.ndarray, cutoff: float) -> np.ndarray:
    """Weighted least squares lines along the first axis, each at its own point. cutoff : [cells]"""
    points = len(heights)
    reach = min(points - 1, math.ceil(REACH * cutoff))
    lag = np.arange(-reach, reach + 1)
    weight = np.exp(-math.pi * (lag / (ALPHA * cutoff)) ** 2)[:, None]
    # sums over neighbours at x + lag; a convolution turns the lags round
    of_heights, with_lag = (
        scipy.signal.fftconvolve(heights, kernel[::-1], mode="full", axes=0)[reach : reach + points]
        for kernel in (weight, weight * lag[:, None])
    )
    ones = np.ones(points)
    s0, s1, s2 = (np.convolve(ones, (weight[:, 0] * lag**k)[::-1])[reach : reach + points, None] for k in range(3))
    return np.asarray((s2 * of_heights - s1 * with_lag) / (s0 * s2 - s1**2))


LEAST_SLOPE = 1e-3  # rms; machined surfaces have some 0.03 to 0.5, a wrong prefix changes them by 1000


def slope_warnings(scan: Topography) -> Iterator[str]:
    """A line where the rms slope between neighbouring points is implausible."""
    along, across = (np.mean(np.diff(scan.heights, axis=axis) ** 2) for axis in (0, 1))
    slope = math.sqrt(along / scan.dx**2 + across / scan.dy**2)
    if not LEAST_SLOPE <= slope <= MOST_SLOPE:
        steep = f"above {MOST_SLOPE:g}, too steep for a half-space"
        yield (
            f"rms slope {slope:.3g} between neighbouring points of the scan is "
            f"{steep if slope > MOST_SLOPE else f'below {LEAST_SLOPE:g}, smoother than machined surfaces'}. Check the "
            f"units of its heights, which scatter by {np.std(scan.heights):.3g} m, and of their distance, "
            f"{scan.dx:.3g} m: roughness.scan.file, and height_unit and spacing_m where the file gives none"
        )


MAD = 1.4826  # standard deviation of Gaussian heights over their median absolute deviation
TAIL = 1.645  # and the distance of their 5 % quantiles from the median, in standard deviations
FAR = 6.0  # deviations of the bulk from the median
ABOVE = 4.0  # deviations of the bulk beyond the surroundings
SURROUNDINGS = (1, 3)  # nodes from a spot to them, its flanks left out
MOST_BELOW = 0.9  # share of the surroundings that must lie below: a groove that goes on takes more of them
LARGEST = 0.01  # share of the scan in a spot
LONGEST = 5.0  # square of the diagonal of its box over its area: 2.5 of a disc, larger for a scratch or groove
SQUARE = np.ones((3, 3), dtype=bool)


def outliers_of(scan: Topography) -> np.ndarray:
    """(nx, ny) bool, true at measured points that are outliers.

    On each side the deviation of the bulk is the larger of two: from the median absolute deviation, and from the 5 %
    quantile. Deep valleys of a plateau, or the dimples of a texture, widen it. A spot is a connected set of points that
    lie FAR of them from the median. It is one of outliers where it is small and compact, and its median lies ABOVE of
    them beyond its surroundings. Grooves and scratches are no such spots. A few deep pores are: they look alike.
    """
    measured = scan.heights[scan.measured]
    z = scan.heights - np.median(measured)
    spread = MAD * float(np.median(np.abs(z[scan.measured])))
    outliers = np.zeros(z.shape, dtype=bool)
    for side in (z, -z):
        deviation = max(spread, float(np.quantile(side[scan.measured], 0.95)) / TAIL)
        if deviation == 0.0:
            continue
        spots, _ = label(side > FAR * deviation, SQUARE)
        for number, box in enumerate(find_objects(spots), start=1):
            area = np.count_nonzero(spots[box] == number)
            diagonal = sum((part.stop - part.start) ** 2 for part in box)
            if area > LARGEST * z.size or diagonal > LONGEST * area:
                continue
            near, far = SURROUNDINGS
            around = tuple(slice(max(0, part.start - far), part.stop + far) for part in box)
            spot = spots[around] == number
            ring = binary_dilation(spot, SQUARE, far) & ~binary_dilation(spot, SQUARE, near) & (spots[around] == 0)
            heights = side[around]
            if ring.any() and np.median(heights[spot]) - np.quantile(heights[ring], MOST_BELOW) > ABOVE * deviation:
                outliers[around] |= spot
    return outliers & scan.measured


def without_outliers(scan: Topography, outliers: np.ndarray, form: Form) -> Topography:
    """The scan with its `outliers` (nx, ny) missing, and its form removed anew."""
    read = f"{scan.read}; {outliers.sum()} outliers treated as missing"
    return remove_form(replace(scan, missing=scan.missing | outliers, read=read), form)


def outlier_warnings(scan: Topography, outliers: np.ndarray, treatment: str) -> Iterator[str]:
    """How many outliers, where the largest lies, and what is done with them."""
    if outliers.any():
        away = np.where(outliers, np.abs(scan.heights - np.median(scan.heights[scan.measured])), 0.0)
        i, j = np.unravel_index(np.argmax(away), away.shape)
        kept = "kept and change all statistics; roughness.scan.outliers: missing leaves them out"
        yield (
            f"{outliers.sum()} points of the scan are outliers, up to {away[i, j] * 1e6:.3g} µm from the median at "
            f"x {i * scan.dx * 1e6:.4g} µm, y {j * scan.dy * 1e6:.4g} µm: they are "
            f"{kept if treatment == 'keep' else 'treated as missing (roughness.scan.outliers)'}"
        )
