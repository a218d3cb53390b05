"""What the surface of a scan is like: density of heights, moments, autocorrelation, spectrum.

Every statistic comes with a 95 % interval from leaving out one sub-area of the scan at a time (`sub_areas`). Statistics
of heights are those of the measured points.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.probability import Estimate
from roughslip.results import described, result
from roughslip.scan.autocorrelation import Autocorrelation, autocorrelation, sub_areas_for
from roughslip.scan.jackknife import SubAreas, leave_one_out
from roughslip.scan.spectrum import Spectrum, spectrum
from roughslip.scan.topography import Topography
from roughslip.validation import gate

BIN = 0.2  # Sq, width of a bin of the density of heights


@result
class HeightDensity:
    """Density of heights."""

    edges: np.ndarray = described("edges of bins about the mean height", "m", "edges")
    density: Estimate = described("density of heights in the bins", "1/m", "bins")


@result
class ScanStatistics:
    """Statistics of a scan, each with its interval."""

    sub_areas: SubAreas = described("what the intervals are made from; ask it whether it is `sufficient`")
    rms_height: Estimate = described("rms height Sq", "m")
    skewness: Estimate = described("skewness Ssk")
    kurtosis: Estimate = described("kurtosis Sku, 3 for Gaussian heights")
    rms_slope: Estimate = described("rms gradient h' between neighbouring points, so that it depends on their distance")
    rms_curvature: Estimate = described("rms of half the Laplacian between them", "1/m")
    density: HeightDensity = described("density of heights")
    autocorrelation: Autocorrelation = described("autocorrelation of heights")
    spectrum: Spectrum = described("power spectrum of heights")


@gate
def scan_statistics(scan: Topography, parts: SubAreas | None = None) -> ScanStatistics:
    """All statistics of a scan whose form is removed.

    parts : sub-areas, such as those of another scan of the same mesh; its own where not given

    Raises IllPosedError where its correlation is too long for it.
    """
    parts = sub_areas_for(scan) if parts is None else parts
    moments = _moments(scan, parts)
    return ScanStatistics(
        sub_areas=parts,
        rms_height=parts.interval(moments[:, 0], positive=True),
        skewness=parts.interval(moments[:, 1]),
        kurtosis=_kurtosis(parts.interval(moments[:, 2]), float(moments[0, 1])),
        rms_slope=_root_mean_square(parts, np.hypot(_differences(scan, 0, 1), _differences(scan, 1, 1))),
        rms_curvature=_root_mean_square(parts, 0.5 * (_differences(scan, 0, 2) + _differences(scan, 1, 2))),
        density=height_density(scan, parts),
        autocorrelation=autocorrelation(scan, parts),
        spectrum=spectrum(scan, parts),
    )


def _kurtosis(estimate: Estimate, skewness: float) -> Estimate:
    """The interval of the kurtosis cut at its bound 1 + Ssk^2 (Pearson)."""
    return Estimate(estimate.value, np.maximum(estimate.low, 1.0 + skewness**2), estimate.high)


def height_density(scan: Topography, parts: SubAreas) -> HeightDensity:
    """Histogram of the measured heights about their mean, in bins of BIN Sq."""
    z = scan.heights - np.mean(scan.heights[scan.measured])
    measured = z[scan.measured]
    width = BIN * float(np.std(measured))
    first, last = math.floor(measured.min() / width), math.floor(measured.max() / width) + 1
    number = np.floor(z / width).astype(int) - first
    counts = np.stack(
        [np.bincount(number[part][scan.measured[part]], minlength=last - first) for part in parts.slices()]
    )
    rows = leave_one_out(counts, lambda total: total / (total.sum() * width))
    estimate = parts.interval(rows)
    density = Estimate(estimate.value, np.maximum(estimate.low, 0.0), estimate.high)
    return HeightDensity(np.arange(first, last + 1) * width, density)


def _moments(scan: Topography, parts: SubAreas) -> np.ndarray:
    """(1 + B, 3) Sq [m], Ssk and Sku of all measured heights, then without each sub-area."""
    scale = float(np.std(scan.heights[scan.measured]))
    z = np.where(scan.measured, scan.heights - np.mean(scan.heights[scan.measured]), 0.0) / scale
    powers = np.stack([parts.sums(scan.measured * z**k) for k in range(5)], axis=-1)

    def central(totals: np.ndarray) -> np.ndarray:
        m1, m2, m3, m4 = totals[1:] / totals[0]
        variance = m2 - m1**2
        third = m3 - 3.0 * m1 * m2 + 2.0 * m1**3
        fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1**2 * m2 - 3.0 * m1**4
        return np.array([scale * math.sqrt(variance), third / variance**1.5, fourth / variance**2])

    return leave_one_out(powers, central)


def _differences(scan: Topography, axis: int, order: int) -> np.ndarray:
    """Differences (nx, ny) of an order over the distance to that power along an axis, from each point on; NaN where
    a height was interpolated, or the scan ends."""
    measured = np.where(scan.measured, scan.heights, np.nan)
    difference = np.diff(measured, order, axis) / (scan.dx, scan.dy)[axis] ** order
    rows = (order // 2, order - order // 2)  # a second difference stands at the point in its middle
    return np.pad(difference, [rows if each == axis else (0, 0) for each in (0, 1)], constant_values=np.nan)


def _root_mean_square(parts: SubAreas, field: np.ndarray) -> Estimate:
    """Of a field, over where it is known."""
    known = np.isfinite(field)
    sums = np.stack([parts.sums(known), parts.sums(np.where(known, field, 0.0) ** 2)], axis=-1)
    return parts.interval(leave_one_out(sums, lambda total: np.sqrt(total[1] / total[0])), positive=True)
