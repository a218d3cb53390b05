"""Autocorrelation of a scan: unbiased, without wrap-around, with its 1/e lengths and its lay.

    C(l) = sum of z(x) z(x + l) over the N(l) pairs of measured points at lag l, over N(l), less the mean squared

Both sums come from FFTs padded by the longest lag, so that no pair wraps around, and pairs with a missing point do
not count. Each sub-area gives the pairs whose first point lies in it; the sums of all sub-areas are those of the scan.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability import Estimate
from roughslip.results import described, result
from roughslip.scan.jackknife import ENOUGH_LENGTHS, SubAreas, leave_one_out, sub_areas, widening, wrapped
from roughslip.scan.topography import Topography, high_pass, remove_form

LEVEL = math.exp(-1.0)
KEYS = "roughness.scan.form, roughness.scan.endless_lay, roughness.scan.cutoff_m"  # that help
ANGLES = np.arange(180) * math.pi / 180
GROOVES = math.radians(30.0)  # from an axis: correlations that do not fall within it alone are those of a lay along it
CUTOFFS = (2, 4, 8, 16)  # of the shorter edge: cutoffs that are tried as a help
SHOWN = 3.0  # lags with intervals go to this many times the reach of the autocorrelation above 1/e


@result
class Autocorrelation:
    """Autocorrelation r = C / C(0) at lags of both signs, and what is read from it."""

    lag_x: np.ndarray = described("lags along x, zero in the middle", "m", "lag_x")
    lag_y: np.ndarray = described("lags along y, zero in the middle", "m", "lag_y")
    correlation: Estimate = described("correlation r, with pointwise interval", "1", "lag_x lag_y")
    length_x: Estimate = described("first lag along x at which r falls to 1/e", "m")
    length_y: Estimate = described("first lag along y at which r falls to 1/e", "m")
    lay: Estimate = described(
        "direction of the longest correlation, from the x axis towards y, in (-pi/2, pi/2]; on an "
        "isotropic surface what chance makes it",
        "rad",
    )
    length_along: Estimate = described(
        "1/e length along the lay; of an endless lay the last lag, give or take a cell: no number of a "
        "scan is infinite",
        "m",
    )
    length_across: Estimate = described("1/e length across the lay", "m")
    rows: np.ndarray = described("r of all sub-areas, then without each: what fits need", "1", "rows x y")


def sub_areas_for(scan: Topography, endless: int | None = None) -> SubAreas:
    """Sub-areas of the scan by the reach of its autocorrelation above 1/e on each axis.

    endless : axis of a lay that is taken as infinitely long, 0 or 1; sub-areas then span the scan along it

    Raises IllPosedError, which says what helps, where the autocorrelation does not fall to 1/e within half the scan.
    """
    correlation, radii = _whole(scan)
    if endless is None:
        if not np.isfinite(radii).all():
            raise IllPosedError(_too_long(scan, radii), KEYS)
        extent = np.max(radii * np.abs([np.cos(ANGLES), np.sin(ANGLES)]), axis=1)
    else:
        across = radii[0 if endless else len(ANGLES) // 2]
        if not np.isfinite(across):
            raise IllPosedError(
                f"endless_lay = {'xy'[endless]}: the autocorrelation along {'yx'[endless]} does not fall to 1/e within "
                "half the scan either: try the other axis, or a high-pass, cutoff_m",
                KEYS,
            )
        edges = scan.grid.nx * scan.dx, scan.grid.ny * scan.dy
        extent = np.full(2, across)
        extent[endless] = edges[endless] / ENOUGH_LENGTHS
    parts = replace(sub_areas(scan.grid, float(extent[0]), float(extent[1])), endless=endless)
    return replace(parts, widening=widening(parts, correlation))


def _whole(scan: Topography) -> tuple[np.ndarray, np.ndarray]:
    """Autocorrelation at lags to half the scan, and R at ANGLES."""
    reach = scan.grid.nx // 2, scan.grid.ny // 2
    whole = SubAreas(scan.grid, (1, 1), (math.inf, math.inf))
    correlation = _correlation(_lag_sums(scan, whole, reach)[0])
    return correlation, _radii(correlation, scan, ANGLES)


def _too_long(scan: Topography, radii: np.ndarray) -> str:
    """Where the autocorrelation does not fall, and which of form, lay and high-pass helps: each is tried."""

    def falls(change: Callable[[], Topography]) -> bool:
        try:
            return bool(np.isfinite(_whole(change())[1]).all())
        except ParameterError:  # nothing is left of it, or it has no such waves
            return False

    stuck = ~np.isfinite(radii)
    helps = ["form: quadratic"] if falls(lambda: remove_form(scan, "quadratic")) else []
    for axis, name in enumerate("xy"):
        if np.all(np.abs(wrapped(ANGLES[stuck] - axis * math.pi / 2)) < GROOVES):
            helps.append(f"a lay taken as infinitely long, endless_lay: {name}")
    cutoffs = min(scan.grid.nx * scan.dx, scan.grid.ny * scan.dy) / np.array(CUTOFFS)
    if enough := [cutoff for cutoff in cutoffs if falls(partial(high_pass, scan, float(cutoff)))]:
        helps.append(f"a high-pass, cutoff_m: {enough[0]:.2g}")
    advice = "What helps: " + ", or ".join(helps) if helps else "No form, lay or high-pass helps"
    return (
        f"the autocorrelation at {math.degrees(ANGLES[np.argmax(stuck)]):.0f} degrees from x does not fall to 1/e "
        f"within half the scan. {advice}. Or measure a larger area"
    )


def autocorrelation(scan: Topography, parts: SubAreas) -> Autocorrelation:
    """Autocorrelation with its lengths and lay, all with intervals from leaving out sub-areas.

    The lay is the phase of the second harmonic of R^4, where R(angle) is the distance at which r falls to 1/e. It is
    exact for any contour that is symmetric about its lay, and its longest part dominates. It is smooth in the data,
    unlike the angle of the largest R.
    """
    reach = tuple(
        min(n // 2, math.ceil(SHOWN * extent / step))
        for n, extent, step in zip(scan.grid.shape, parts.extent, (scan.dx, scan.dy), strict=True)
    )
    rows = leave_one_out(_lag_sums(scan, parts, reach), _correlation)
    kx, ky = reach
    longest = math.hypot(kx * scan.dx, ky * scan.dy)
    fourth = np.stack([np.minimum(_radii(row, scan, ANGLES) / longest, 1.0) for row in rows]) ** 4
    lay = wrapped(0.5 * np.arctan2(fourth @ np.sin(2 * ANGLES), fourth @ np.cos(2 * ANGLES)))
    directions = np.array([0.0, math.pi / 2, lay[0], lay[0] + math.pi / 2])
    lengths = np.stack([_radii(row, scan, directions) for row in rows])
    last = np.inf
    if parts.endless is not None:  # known to be at least as long as the last lag
        last = reach[parts.endless] * (scan.dx, scan.dy)[parts.endless]
        lengths[:, [parts.endless, 2]] = np.minimum(lengths[:, [parts.endless, 2]], last)
    if not np.isfinite(lengths).all():
        text = "the autocorrelation without one sub-area does not fall to 1/e"
        raise IllPosedError(f"{text}: take a high-pass, cutoff_m, or measure a larger area", KEYS)
    turned = wrapped(lay[1:] - lay[0])
    turn = np.minimum(parts.half_width(turned - np.mean(turned)), math.pi / 2)
    length_x, length_y, along, across = (
        Estimate(*(np.asarray(last + cells * min(scan.dx, scan.dy)) for cells in (0, -1, 1)))
        if column[0] == last
        else parts.interval(column, positive=True)
        for column in lengths.T
    )
    return Autocorrelation(
        lag_x=np.arange(-kx, kx + 1) * scan.dx,
        lag_y=np.arange(-ky, ky + 1) * scan.dy,
        correlation=parts.interval(rows),
        length_x=length_x,
        length_y=length_y,
        lay=Estimate(lay[0], lay[0] - turn, lay[0] + turn),
        length_along=along,
        length_across=across,
        rows=rows,
    )


def _lag_sums(scan: Topography, parts: SubAreas, reach: tuple[int, ...]) -> np.ndarray:
    """(B, 3, 2 kx + 1, 2 ky + 1): numbers of pairs, sums of z(x) z(x + l), sums of (z(x) + z(x + l)) / 2.

    Each is the mean of lags l and -l, so that it is even.
    """
    exists = scan.measured.astype(np.float64)
    z = np.where(scan.missing, 0.0, scan.heights - np.mean(scan.heights[scan.measured]))
    pad = [(k, k) for k in reach]
    wide_z, wide_exists = np.pad(z, pad), np.pad(exists, pad)
    sums = []
    for part in parts.slices():
        window = tuple(slice(p.start, p.stop + 2 * k) for p, k in zip(part, reach, strict=True))
        shape = [scipy.fft.next_fast_len(w.stop - w.start, real=True) for w in window]
        first_z, first = (np.conj(scipy.fft.rfft2(f[part], s=shape)) for f in (z, exists))
        then_z, then = (scipy.fft.rfft2(f[window], s=shape) for f in (wide_z, wide_exists))
        pairs = _even_lags(first * then, shape, reach)
        products = _even_lags(first_z * then_z, shape, reach)
        ends = _even_lags(0.5 * (first_z * then + first * then_z), shape, reach)
        sums.append(np.stack([0.5 * np.rint(2.0 * pairs), products, ends]))
    return np.stack(sums)


def _even_lags(transform: np.ndarray, shape: list[int], reach: tuple[int, ...]) -> np.ndarray:
    lags = scipy.fft.irfft2(transform, s=shape)[: 2 * reach[0] + 1, : 2 * reach[1] + 1]
    return np.asarray(0.5 * (lags + lags[::-1, ::-1]))


def _correlation(sums: np.ndarray) -> np.ndarray:
    """r from the sums (3, ...) of pairs; the mean is that of the heights at zero lag."""
    pairs, products, ends = sums
    if not (pairs > 0.0).all():
        raise IllPosedError(
            "a lag has no pair of measured points: fewer points may be missing, or measure a larger area"
        )
    centre = tuple(n // 2 for n in pairs.shape)
    mean = ends[centre] / pairs[centre]
    covariance = (products - 2.0 * mean * ends) / pairs + mean**2
    return np.asarray(covariance / covariance[centre])


def _radii(correlation: np.ndarray, scan: Topography, angles: np.ndarray) -> np.ndarray:
    """R (angles,) [m] at which r, bilinear between lags, first falls to 1/e; infinite where it does not."""
    centre = np.array([n // 2 for n in correlation.shape])
    cells = np.stack([np.cos(angles) / scan.dx, np.sin(angles) / scan.dy])
    cells[np.abs(cells) * max(scan.dx, scan.dy) < 1e-12] = 0.0
    step = 0.5 * min(scan.dx, scan.dy)
    to_edge = np.divide(centre[:, None], np.abs(cells), out=np.full(cells.shape, np.inf), where=cells != 0.0)
    furthest = np.min(to_edge, axis=0)
    distance = np.arange(math.floor(furthest.max() / step) + 1) * step
    at = centre[:, None, None] + cells[:, :, None] * distance
    on_ray = scipy.ndimage.map_coordinates(correlation, at, order=1, mode="nearest")
    below = (on_ray < LEVEL) & (distance <= furthest[:, None] * (1.0 + 1e-12))
    k = np.maximum(np.argmax(below, axis=1), 1)
    ray = np.arange(len(angles))
    before, after = on_ray[ray, k - 1], on_ray[ray, k]
    falls = below.any(axis=1)
    share = np.divide(before - LEVEL, before - after, out=np.zeros_like(before), where=falls)
    return np.where(falls, (k - 1 + share) * step, np.inf)
