"""The Monte Carlo reference of the friction coefficient of windows: strips that are solved directly.

A sample is one strip, from default_rng([seed, STREAM, number]), solved at every penetration of the scene as in stage
contact_strip; no strip is one of the study. The reference is in units of the shear strength, as area over force [1/Pa],
because a scene derives the shear strength from the estimated mean at the median. Standard errors are from resampled
strips.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from roughslip import store
from roughslip.contact.edge import contact_shares
from roughslip.contact.solve import sweep
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.statistics import strip_weights, window_statistics
from roughslip.scene.mistakes import Values
from roughslip.scene.types import Scene, scene_of, slice_for, without_nulls
from roughslip.stages.from_scene import elastic, geometry, surface_model

SAMPLES = {"resolved": (4000, 200)}  # by scene, of its reference and of a batch, which takes four minutes
TOLERANCE = 1e-6  # changes area over force by 3e-6 at most, in 0.6 of the time of the study's 1e-10
STREAM = 25  # the second entry of every seed; 20 and 24 are of the pressure, 21 to 23 and 27 to 30 of benchmarks
REPLICATES = 1000  # a standard error is then known to 2 %
SEED = 26
NUMBERS = {"mean": "Pa-1", "std": "Pa-1", "variation": "1", "skewness": "1", "kurtosis": "1", "missing_share": "1"}


def slice_of(scene: Values) -> Values:
    """The part of a scene that its solves depend on."""
    part = without_nulls(slice_for(scene, "contact_strip"))
    del part["strip"]["training_samples"]
    part["numerics"] = {"contact_area": part["numerics"]["contact_area"]}
    part["friction"] = {"least_contact_fraction": scene["friction"]["least_contact_fraction"]}
    return part


def solve_windows(
    scene: Scene, fields: Iterable[np.ndarray], percentiles: Sequence[float], tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return area [m2] and force [N] (strips, penetrations, windows) of fields (nx, ny) [m] on the strip of a scene."""
    grid, model = geometry.strip_grid(scene), surface_model.surface_model(scene)
    influence, lie = elastic.influence(scene, grid), geometry.windows(scene)
    planes = model.plane_height(np.array(percentiles, dtype=float)).tolist()
    hardness, sums = elastic.hardness_pa(scene), []
    corrected = scene.numerics.contact_area == "corrected"
    for field in fields:
        of_strip = np.empty((2, len(planes), lie.count))
        solutions = sweep(influence, model.heights(field), planes, tolerance, hardness_pa=hardness)
        for level, solution in enumerate(solutions):
            cells = contact_shares(solution.pressure, hardness) if corrected else solution.contact
            of_strip[:, level] = [grid.cell_area * lie.sums(field) for field in (cells, solution.pressure)]
        sums.append(of_strip)
    area, force = np.stack(sums, axis=1)
    return area, force


def solve(configuration: Values, first: int, last: int) -> dict[str, store.Variable]:
    """Solve strips first ... last - 1."""
    scene = scene_of(configuration)
    sample = surface_model.surface_model(scene).sampler(geometry.strip_grid(scene))
    seeds = ([scene.seed, STREAM, number] for number in range(first, last))
    fields = (sample(np.random.default_rng(seed)) for seed in seeds)
    area, force = solve_windows(scene, fields, scene.strip.penetration_percentiles, TOLERANCE)
    shape = ("sample", "level", "window")
    return {
        "area": store.Variable(shape, area, "m2", "contact area of the window"),
        "force": store.Variable(shape, force, "N", "normal force on the window"),
    }


def gather(configuration: Values, batches: Sequence[Mapping[str, np.ndarray]]) -> dict[str, store.Variable]:
    """Return the statistics of the windows of all strips, with standard errors.

    Raises IllPosedError as `window_statistics` does, for example for too few strips in contact.
    """
    area, force = (store.join(batches, name) for name in ("area", "force"))
    strip, rows = configuration["strip"], []
    least = configuration["friction"]["least_contact_fraction"] * strip["window_m"] * strip["width_m"]
    weights = strip_weights(len(area), REPLICATES, np.random.default_rng(SEED))
    for level in range(area.shape[1]):
        statistics = window_statistics(*friction_coefficient(area[:, level], force[:, level], 1.0, least), weights)
        rows.append([getattr(statistics, name) for name in NUMBERS])
    table = {
        "percentile": store.Variable(("level",), strip["penetration_percentiles"], "percent", "penetration"),
        "strips": store.Variable((), len(area), "1", "strips that were solved"),
    }
    for (name, unit), estimates in zip(NUMBERS.items(), zip(*rows, strict=True), strict=True):
        title = f"{name.replace('_', ' ')} of area over force of windows"
        errors = [estimate.replicates.std(ddof=1) for estimate in estimates]
        table[name] = store.Variable(("level",), [float(each.value) for each in estimates], unit, title)
        table[f"{name}_standard_error"] = store.Variable(("level",), errors, unit, f"standard error of the {title}")
    return table
