"""Stage scan: statistics of a scan with their intervals, and the models fitted to it, or why there is none.

The best of the models fitted to a scan whose surfaces can be sampled on the meshes of the scene.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.probability import empirical_distribution, translate
from roughslip.probability.distributions import EmpiricalDistribution
from roughslip.scan.autocorrelation import Autocorrelation, sub_areas_for
from roughslip.scan.covariance_fit import CovarianceFit, fitted_covariances
from roughslip.scan.instrument_file import read_scan
from roughslip.scan.statistics import ScanStatistics, rings, scan_statistics
from roughslip.scan.topography import (
    Topography,
    high_pass,
    outlier_warnings,
    outliers_of,
    remove_form,
    without_outliers,
)
from roughslip.scene.part import Scene
from roughslip.study.from_scene import geometry, surface_model
from roughslip.study.job import Job
from roughslip.surface import model as surface
from roughslip.surface.covariance import Covariance
from roughslip.surface.models import KINDS

MOST_DRAWN = 400  # points on an axis of a map that is drawn
BINS = 50  # of the density of heights
WIDE_RIM = 0.10  # share of the points that an empty rim may take without a warning
FAR = 3.0  # standard errors by which a model misses lags or rings in the mean, from which a warning says so
UNSAMPLED = {"figure_scan", "figure2"}  # targets that draw no strips; squares are expanded in modes


def meshes(scene: Scene) -> dict[str, Grid]:
    """On which surfaces of the scene are sampled, by name."""
    if UNSAMPLED.issuperset(scene.targets) or scene.strip.cell_m is None:
        return {}
    return {"strip": geometry.strip_grid(scene), "expansion of a strip": geometry.lattice(scene).grid}


def best_sampled(
    fits: Sequence[CovarianceFit],
    marginal: EmpiricalDistribution | None,
    correct_correlation: bool,
    on: dict[str, Grid],
    endless: int | None = None,
) -> tuple[CovarianceFit, list[str]]:
    """The first of the fits whose surfaces can be sampled on every mesh, and a line for each one before it.

    on : meshes by name
    endless : axis of a lay that is taken as infinitely long

    Raises IllPosedError, which names the keys, where no fit can be.
    """
    left: list[str] = []
    for fit in fits:
        kind = fit.covariance.kind
        try:
            model = surface.gaussian_model(fit.covariance, None, marginal, correct_correlation=correct_correlation)
            model = surface_model.with_lay(model, endless, model.lengths_m[0])
        except IllPosedError as error:
            left.append(f"{kind} cannot have these heights ({error})")
            continue
        for name, grid in on.items():
            try:
                model.sampler(grid)
            except (IllPosedError, ParameterError) as error:
                reason = str(error).partition(";")[0]
                left.append(f"{kind} cannot be sampled on the mesh of the {name}, {grid.nx} x {grid.ny} ({reason})")
                break
        else:
            return fit, left
    raise IllPosedError(
        f"no surface of this model of the scan can be sampled: {'; '.join(left)}. Take roughness.scan.covariance: "
        f"{'best or ' if len(fits) == 1 else ''}measured, or a high-pass roughness.scan.cutoff_m"
    )


def work(scene: Scene, job: Job) -> None:
    """Read, remove form, describe, fit."""
    wanted = scene.roughness.scan
    scan, found_outliers, warnings = prepared(wanted, job.path("scan"))
    print(f"scan: {scan.read}", file=sys.stderr, flush=True)
    job.warn(*warnings)
    statistics = scan_statistics(scan, sub_areas_for(scan, endless_axis(wanted)))
    helping = ["outliers", "marginal"]  # where the heights are the reason
    try:
        marginal = translated_marginal(wanted.marginal, scan, float(statistics.rms_height.value))
        helping.append("covariance")
        variables, attributes, words = fitted_model(job, scan, statistics, marginal)
    except (ConvergenceError, IllPosedError, ParameterError) as error:  # the scan is drawn without a model
        reason = f"{error.in_scene}. {surface_model.what_helps(wanted, helping)}"
        job.warn(f"the scan has no model: {reason}")
        variables, attributes, words = {}, {"no_model": reason}, f"none: {reason}"
    if not statistics.sub_areas.sufficient:
        lengths = f"sub-areas of {statistics.sub_areas.lengths:.1f} correlation lengths"
        job.warn(f"{lengths}: intervals of the scan are too narrow, scan a larger area")
    job.count(points=scan.heights.size)
    variables |= of_scan(scan, statistics, found_outliers)
    variables["model"] = store.Variable((), words, "1", "model of the autocorrelation")
    store.write(job.output, variables, job.key, attributes)


def prepared(wanted: Any, file: Path) -> tuple[Topography, np.ndarray, list[str]]:
    """The scan of a file without form, outliers and waves beyond the cutoff, its outliers, and warnings.

    wanted : the section `roughness.scan`
    """
    scan = remove_form(read_scan(file, wanted.spacing_m, wanted.height_unit), wanted.form)
    warnings = []
    if scan.cut > WIDE_RIM:
        warnings.append(f"{scan.cut:.0%} of the scan lies in an empty rim and is cut off: {scan.read}")
    outliers, treatment = outliers_of(scan), wanted.outliers or "keep"
    warnings += outlier_warnings(scan, outliers, treatment)
    if treatment == "missing" and outliers.any():
        scan = without_outliers(scan, outliers, wanted.form)
    return scan if wanted.cutoff_m is None else high_pass(scan, wanted.cutoff_m), outliers, warnings


def endless_axis(wanted: Any) -> int | None:
    """The axis of an endless lay."""
    return None if wanted.endless_lay is None else "xy".index(wanted.endless_lay)


def of_scan(scan: Topography, statistics: ScanStatistics, outlying: np.ndarray) -> dict[str, store.Variable]:
    """Every statistic with its interval, a map to draw, and the mesh. outlying : (nx, ny) bool, true at outliers"""
    step, axis, on_map = math.ceil(max(scan.grid.shape) / MOST_DRAWN), ("axis",), ("map_x", "map_y")
    marked = np.zeros([-(-n // step) for n in scan.grid.shape], dtype=int)  # a point drawn stands for step x step
    np.maximum.at(marked, tuple(places // step for places in np.nonzero(outlying)), 1)
    heights, is_sufficient = scan.heights[scan.measured], statistics.sub_areas.sufficient
    density, edges = np.histogram(heights - heights.mean(), BINS, density=True)
    variables = {
        "outliers": store.Variable((), int(outlying.sum()), "1", "points that are outliers of the heights"),
        "map_outlier": store.Variable(on_map, marked, "1", "1 where a point of the map stands for outliers"),
        "map": store.Variable(on_map, scan.heights[::step, ::step], "m", "heights, thinned"),
        "map_x": store.Variable(("map_x",), scan.grid.x()[::step], "m", "place along x"),
        "map_y": store.Variable(("map_y",), scan.grid.y()[::step], "m", "place along y"),
        "points": store.Variable(axis, np.array(scan.grid.shape), "1", "points of the scan along x and y"),
        "spacing": store.Variable(axis, np.array([scan.dx, scan.dy]), "m", "distances of neighbouring points"),
        "missing": store.Variable((), float(scan.missing.mean()), "1", "share of the points that have no height"),
        "read": store.Variable((), scan.read, "1", "what was read of the file, cut and missing"),
        "sufficient": store.Variable((), is_sufficient, "1", "whether the sub-areas are long enough for intervals"),
        "density_edge": store.Variable(("edge",), edges, "m", "edges of bins of height"),
        "density": store.Variable(("bin",), density, "m-1", "density of heights"),
    }
    for part in (statistics, statistics.autocorrelation, statistics.spectrum):
        variables |= store.variables_of(part, leave_out=("rows",))
    return variables


def of_model(covariance: Covariance, scan: Topography, statistics: ScanStatistics) -> dict[str, store.Variable]:
    """A fitted model at the lags and on the rings of a scan; of an endless lay, at the lags across it alone."""
    parts, own = statistics.sub_areas, statistics.autocorrelation
    lags = [own.lag_x[:, None], own.lag_y[None, :]]
    if parts.endless is not None:
        lags[parts.endless] = 0.0 * lags[parts.endless]
    correlation = np.asarray(covariance(*lags)) / covariance.rms_height_m**2
    found = {"model_correlation": store.Variable(("lag_x", "lag_y"), correlation, "1", "autocorrelation of the model")}
    if parts.endless is None:
        power = rings(scan.grid, parts).expected(covariance.spectrum)
        found["model_power"] = store.Variable(("R",), power, "m4", "radially averaged power spectrum of the model")
    return found


def fitted_model(
    job: Job,
    scan: Topography,
    statistics: ScanStatistics,
    marginal: EmpiricalDistribution | None,
) -> tuple[dict[str, store.Variable], dict[str, str], str]:
    """The stored model of a scan, its variables and attributes, and what it is in words.

    Raises IllPosedError, ConvergenceError or ParameterError where the scan has no model that can be sampled.
    """
    wanted, endless = job.scene.roughness.scan, statistics.sub_areas.endless
    kind, covariance, words = wanted.covariance, None, "measured autocorrelation"
    correct, drawn = job.scene.roughness.correct_correlation, {}
    if kind != "measured":
        kinds = KINDS if kind == "best" else (kind,)
        fitted, refused = fitted_covariances(kinds, scan, statistics)
        best, left = best_sampled(fitted, marginal, correct, meshes(job.scene), endless)
        covariance = best.covariance
        words, drawn = model_in_words(best, len(fitted) - len(left)), of_model(covariance, scan, statistics)
        job.warn(*(f"a better model, {model}: {covariance.kind} is taken, or try measured" for model in left))
        for reason in refused:
            print(f"scan: not fitted: {reason}", file=sys.stderr)
        job.warn(
            *(f"{covariance.kind} {what}: try measured" for what in misses(best, statistics.autocorrelation, endless))
        )
    if wanted.endless_lay is not None:
        words += f", endless lay along {wanted.endless_lay}"
    if wanted.cutoff_m is not None:
        words += f", without waves above {1e6 * wanted.cutoff_m:.3g} µm"
    rms_height_m = float(statistics.rms_height.value)
    stored, attributes = surface_model.stored_model(covariance, marginal, correct, rms_height_m, endless)
    return drawn | stored, attributes, words


def translated_marginal(kind: str, scan: Topography, rms_height_m: float) -> EmpiricalDistribution | None:
    """The law of the heights, None for "gaussian".

    Raises IllPosedError where a Gaussian field has no translation to it, without the advice of `translate`, which is
    for those who choose shapes.
    """
    if kind == "gaussian":
        return None
    try:
        marginal = empirical_distribution(scan.heights[scan.measured], rms_height_m)
        translate(marginal)
        return marginal
    except IllPosedError as error:
        reason = str(error).partition("; use")[0]
        raise IllPosedError(f"heights of this distribution cannot be sampled: {reason}") from error


def misses(fit: CovarianceFit, autocorrelation: Autocorrelation, endless: int | None = None) -> Iterator[str]:
    """What of the scan a model does not have; lengths along an endless lay, an axis, do not count."""
    for what, misfit in (("autocorrelation", fit.misfit), ("spectrum", fit.spectrum_misfit)):
        if misfit > FAR:
            yield f"misses the {what} by {misfit:.1f} standard errors"
    for axis, length, own in zip(
        "xy", fit.covariance.axis_lengths_m, (autocorrelation.length_x, autocorrelation.length_y), strict=True
    ):
        if "xy".index(axis) != endless and not own.low <= length <= own.high:
            yield f"misses the 1/e length along {axis}, {own.low:.3g} to {own.high:.3g} m, with {length:.3g} m"


def model_in_words(fit: CovarianceFit, fits: int) -> str:
    """The model for picture and page. fits : models compared"""
    covariance = fit.covariance
    shapes = [f"{name.replace('_', ' ')} {getattr(covariance, name):.3g}" for name in covariance.shapes]
    best = [f"best of {fits} models"] if fits > 1 else []
    misfit = f"misfit {fit.misfit:.2g} standard errors"
    return ", ".join([f"{covariance.kind.replace('_', ' ')} covariance", *shapes, *best, misfit])
