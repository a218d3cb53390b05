"""Statistics of a scan and of its sampled twins as variables of a result."""

import math
from collections.abc import Sequence

import numpy as np

from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of
from roughslip.scan.jackknife import SubAreas
from roughslip.scan.statistics import ScanStatistics
from roughslip.scan.topography import Topography
from roughslip.store import Result, Variable, with_interval

MOST_DRAWN = 400  # points on an axis of a map that is drawn
NUMBERS = {
    "rms_height": ("m", "root mean square of the heights, Sq"),
    "skewness": ("1", "skewness of the heights"),
    "kurtosis": ("1", "kurtosis of the heights, 3 where they are Gaussian"),
    "length_x": ("m", "1/e length of the autocorrelation along x"),
    "length_y": ("m", "1/e length of the autocorrelation along y"),
    "length_along": ("m", "1/e length of the autocorrelation along the lay"),
    "length_across": ("m", "1/e length of the autocorrelation across the lay"),
    "lay": ("rad", "angle from x to the lay"),
}


def numbers_of(statistics: ScanStatistics) -> dict[str, Estimate]:
    """The statistics that are one number each."""
    of_heights = ("rms_height", "skewness", "kurtosis")
    return {name: getattr(statistics if name in of_heights else statistics.autocorrelation, name) for name in NUMBERS}


def of_scan(scan: Topography, statistics: ScanStatistics, outliers: np.ndarray) -> dict[str, Variable]:
    """Every statistic with its interval, a map to draw, and the mesh and sub-areas that twins need.

    outliers : (nx, ny) bool, true at outliers of the scan
    """
    parts, correlation, spectrum = statistics.sub_areas, statistics.autocorrelation, statistics.spectrum
    step = math.ceil(max(scan.grid.shape) / MOST_DRAWN)
    axis = ("axis",)
    marked = np.zeros([-(-n // step) for n in scan.grid.shape], dtype=int)  # a point drawn stands for step x step
    np.maximum.at(marked, tuple(np.nonzero(outliers)[axis] // step for axis in (0, 1)), 1)
    variables = {
        "outliers": Variable((), int(outliers.sum()), "1", "points that are outliers of the heights"),
        "map_outlier": Variable(("map_x", "map_y"), marked, "1", "1 where a point of the map stands for outliers"),
        "map": Variable(("map_x", "map_y"), scan.heights[::step, ::step], "m", "heights, thinned"),
        "map_x": Variable(("map_x",), scan.grid.x()[::step], "m", "place along x"),
        "map_y": Variable(("map_y",), scan.grid.y()[::step], "m", "place along y"),
        "points": Variable(axis, np.array(scan.grid.shape), "1", "points of the scan along x and y"),
        "spacing": Variable(axis, np.array([scan.dx, scan.dy]), "m", "distances of neighbouring points"),
        "missing": Variable((), float(scan.missing.mean()), "1", "share of the points that have no height"),
        "read": Variable(("reading",), np.array([scan.read]), "1", "what was read of the file, cut and missing"),
        "sub_areas": Variable(axis, np.array(parts.counts), "1", "sub-areas along x and y"),
        "extent": Variable(axis, np.array(parts.extent), "m", "reach of the autocorrelation above 1/e"),
        "widening": Variable((), parts.widening, "1", "factor of standard errors for what sub-areas share"),
        "endless": Variable(
            (), -1 if parts.endless is None else parts.endless, "1", "axis of an endless lay; -1 without"
        ),
        "sufficient": Variable((), int(parts.sufficient), "1", "1 where the sub-areas are long enough for intervals"),
        "lag_x": Variable(("lag_x",), correlation.lag_x, "m", "lag along x"),
        "lag_y": Variable(("lag_y",), correlation.lag_y, "m", "lag along y"),
        "density_edge": Variable(("edge",), statistics.density.edges, "m", "edges of bins of height"),
        "wavenumber": Variable(("ring",), spectrum.wavenumber, "rad m-1", "wavenumber"),
    }
    for name, estimate in numbers_of(statistics).items():
        variables |= with_interval(name, (), columns_of(estimate), *NUMBERS[name])
    lags = ("lag_x", "lag_y")
    variables |= with_interval("correlation", lags, columns_of(correlation.correlation), "1", "autocorrelation")
    variables |= with_interval("density", ("bin",), columns_of(statistics.density.density), "m-1", "density of heights")
    variables |= with_interval("power", ("ring",), columns_of(spectrum.power), "m4", "radially averaged power spectrum")
    return variables


def sub_areas_of(result: Result, scan: Topography) -> SubAreas:
    """The sub-areas of the scan, for a twin of its mesh."""
    counts, extent = result["sub_areas"], result["extent"]
    endless = None if result["endless"] < 0 else int(result["endless"])
    numbers, extents = (int(counts[0]), int(counts[1])), (float(extent[0]), float(extent[1]))
    return SubAreas(scan.grid, numbers, extents, float(result["widening"]), endless)


def of_twins(twins: Sequence[tuple[Topography, ScanStatistics]], edges: np.ndarray) -> dict[str, Variable]:
    """What twins, one or more, show of the same, a row a twin. edges : [m] of bins of height."""
    twin, step = ("twin",), math.ceil(max(twins[0][0].grid.shape) / MOST_DRAWN)
    first = twins[0][0].heights[::step, ::step]
    tables = np.stack([statistics.autocorrelation.correlation.value for _, statistics in twins])
    density = [np.histogram(z.heights, edges)[0] / z.heights.size / np.diff(edges) for z, _ in twins]
    powers = [statistics.spectrum.power.value for _, statistics in twins]
    i, j = tables.shape[1] // 2, tables.shape[2] // 2
    variables = {
        "twin_map": Variable(("map_x", "map_y"), first, "m", "heights of the first twin, thinned"),
        "twin_correlation_x": Variable(("twin", "lag_x"), tables[:, :, j], "1", "autocorrelation along x"),
        "twin_correlation_y": Variable(("twin", "lag_y"), tables[:, i, :], "1", "autocorrelation along y"),
        "twin_density": Variable(("twin", "bin"), np.stack(density), "m-1", "density of heights"),
        "twin_power": Variable(("twin", "ring"), np.stack(powers), "m4", "radially averaged power spectrum"),
    }
    for name, (unit, title) in NUMBERS.items():
        values = np.array([float(numbers_of(statistics)[name].value) for _, statistics in twins])
        variables[f"twin_{name}"] = Variable(twin, values, unit, title)
    return variables
