"""Statistics of a scan as variables of a result."""

import math

import numpy as np

from roughslip.probability.estimate import columns_of
from roughslip.scan.spectrum import rings
from roughslip.scan.statistics import ScanStatistics
from roughslip.scan.topography import Topography
from roughslip.store import Variable, with_interval
from roughslip.surface.covariance import Covariance

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


def of_scan(scan: Topography, statistics: ScanStatistics, outliers: np.ndarray) -> dict[str, Variable]:
    """Every statistic with its interval, a map to draw, and the mesh.

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
        "sufficient": Variable((), int(parts.sufficient), "1", "1 where the sub-areas are long enough for intervals"),
        "lag_x": Variable(("lag_x",), correlation.lag_x, "m", "lag along x"),
        "lag_y": Variable(("lag_y",), correlation.lag_y, "m", "lag along y"),
        "density_edge": Variable(("edge",), statistics.density.edges, "m", "edges of bins of height"),
        "wavenumber": Variable(("ring",), spectrum.wavenumber, "rad m-1", "wavenumber"),
    }
    for name, titles in NUMBERS.items():
        estimate = getattr(statistics if hasattr(statistics, name) else correlation, name)
        variables |= with_interval(name, (), columns_of(estimate), *titles)
    lags = ("lag_x", "lag_y")
    variables |= with_interval("correlation", lags, columns_of(correlation.correlation), "1", "autocorrelation")
    variables |= with_interval("density", ("bin",), columns_of(statistics.density.density), "m-1", "density of heights")
    variables |= with_interval("power", ("ring",), columns_of(spectrum.power), "m4", "radially averaged power spectrum")
    return variables


def of_model(covariance: Covariance, scan: Topography, statistics: ScanStatistics) -> dict[str, Variable]:
    """A fitted model at the lags and on the rings of a scan; of an endless lay, at the lags across it alone."""
    parts, own = statistics.sub_areas, statistics.autocorrelation
    lags = [own.lag_x[:, None], own.lag_y[None, :]]
    if parts.endless is not None:
        lags[parts.endless] = 0.0 * lags[parts.endless]
    correlation = np.asarray(covariance(*lags)) / covariance.rms_height_m**2
    found = {"model_correlation": Variable(("lag_x", "lag_y"), correlation, "1", "autocorrelation of the model")}
    if parts.endless is None:
        power = rings(scan.grid, parts).expected(covariance.spectrum)
        found["model_power"] = Variable(("ring",), power, "m4", "radially averaged power spectrum of the model")
    return found
