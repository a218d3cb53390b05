"""Stage scan: statistics of a scan with their intervals, and the models fitted to it."""

import sys
from collections.abc import Iterator

import numpy as np

from roughslip import store
from roughslip.scan import outliers
from roughslip.scan.autocorrelation import Autocorrelation
from roughslip.scan.covariance_fit import CovarianceFit, fitted_covariances
from roughslip.scan.instrument_file import read_scan
from roughslip.scan.statistics import fitted_marginal, scan_statistics
from roughslip.scan.topography import remove_form
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import surface_model
from roughslip.stages.result_tables import scan_table
from roughslip.stages.runtime.command import Job, execute
from roughslip.surface.covariance import Covariance
from roughslip.surface.models import KINDS

STAGE = Stage(
    name="scan",
    reads="roughness.scan",
    inputs={"scan": "grinding roughness.scan.file"},
    result="surface/scan.nc",
    runs_if="roughness.scan",
    memory_mb=320,
    memory_doubles={"scan_points": 40},
)

FAR = 3.0  # standard errors by which a model misses lags or rings in the mean, from which a warning says so


def work(job: Job) -> None:
    """Read, remove form, describe, fit."""
    wanted = job.scene.roughness.scan
    sides = wanted.spacing_x_m, wanted.spacing_y_m
    spacing = None if sides[0] is None or sides[1] is None else (sides[0], sides[1])
    scan = remove_form(read_scan(job.arguments.scan, spacing, wanted.height_unit), wanted.form)
    found_outliers = outliers.outliers(scan)
    treatment = wanted.outliers or "keep"
    job.usage.warn(*outliers.warnings(scan, found_outliers, treatment))
    if treatment == "missing" and found_outliers.any():
        scan = outliers.without(scan, found_outliers, wanted.form)
    kind, covariance, fits = wanted.covariance, None, 0
    with job.usage.core():
        found = scan_statistics(scan)
        rms = float(found.rms_height.value)
        if kind != "measured":
            kinds = KINDS if kind == "best" else (kind,)
            (best, *others), refused = fitted_covariances(kinds, scan, found)
            covariance, fits = best.covariance, 1 + len(others)
            for reason in refused:
                print(f"scan: not fitted: {reason}", file=sys.stderr)
            job.usage.warn(*(f"{covariance.kind} {what}: try measured" for what in misses(best, found.autocorrelation)))
        marginal = fitted_marginal(wanted.marginal, scan, rms)
    if not found.sub_areas.sufficient:
        lengths = f"sub-areas of {found.sub_areas.lengths:.1f} correlation lengths"
        job.usage.warn(f"{lengths}: intervals of the scan are too narrow, scan a larger area")
    job.usage.count(points=scan.heights.size)
    correct = bool(wanted.correct_correlation)
    variables, attributes = surface_model.stored_model(covariance, marginal, correct, rms)
    variables |= scan_table.of_scan(scan, found)
    words = model_in_words(covariance, fits)
    variables["model"] = store.Variable(("model",), np.array([words]), "1", "model of the autocorrelation")
    store.write(job.arguments.output, variables, job.key, attributes)


def misses(fit: CovarianceFit, found: Autocorrelation) -> Iterator[str]:
    """What of the scan a model does not have."""
    for what, misfit in (("autocorrelation", fit.misfit), ("spectrum", fit.spectrum_misfit)):
        if misfit > FAR:
            yield f"misses the {what} by {misfit:.1f} standard errors"
    for axis, length, own in zip("xy", fit.covariance.axis_lengths_m, (found.length_x, found.length_y), strict=True):
        if not own.low <= length <= own.high:
            yield f"misses the 1/e length along {axis}, {own.low:.3g} to {own.high:.3g} m, with {length:.3g} m"


def model_in_words(covariance: Covariance | None, fits: int) -> str:
    """The model for picture and page. covariance : None for the measured autocorrelation; fits : models compared"""
    if covariance is None:
        return "measured autocorrelation"
    shapes = [f"{name.replace('_', ' ')} {getattr(covariance, name):.3g}" for name in covariance.shapes]
    best = [f"best of {fits} models"] if fits > 1 else []
    return ", ".join([f"{covariance.kind.replace('_', ' ')} covariance", *shapes, *best])


if __name__ == "__main__":
    execute(STAGE, work)
