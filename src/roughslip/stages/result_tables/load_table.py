"""What strips say of load: force and pressure of a window, windows that bear the scene's force, and their scatter."""

import numpy as np

from roughslip import store
from roughslip.friction.pad import (
    ADJACENT,
    WINDOWS,
    adjacent_variance,
    between_pads,
    influence_covariance,
    pad_scatter,
    percentile_of_pressure,
)
from roughslip.friction.statistics import resampled
from roughslip.probability import Estimate
from roughslip.scene.types import Scene
from roughslip.stages.from_scene.surface_model import correlated
from roughslip.stages.runtime.command import Job

TITLES = {
    "force_per_window": ("N", "mean normal force on a window, windows without contact too"),
    "nominal_pressure": ("Pa", "mean normal force over the area of the windows"),
    "load_windows": ("1", "windows that bear the scene's normal force at this penetration"),
    "load_std": ("1", "standard deviation of the friction coefficient of as many windows under one plane"),
}
OF_PADS = {  # of a square of so many windows, or of a row of them as long as one
    "pad_mean": ("1", "mean friction coefficient of a pad, shear strength times area over force of all its windows"),
    "pad_std": ("1", "standard deviation of the friction coefficient of a pad"),
    "pad_independent_windows": ("1", "independent windows whose mean scatters as the pad does"),
}
Table = dict[str, list[Estimate]]  # by name the estimates of all levels


def load_table(
    job: Job, batches: list[store.Result], statistics: tuple[Table, Table], shear: Estimate, weights: np.ndarray
) -> Table:
    """Load of windows and scatter of pads at every penetration.

    batches : of the solved strips, as stage contact_strip leaves them
    statistics : of the solved windows, and of all strips with both meshes
    shear : () [Pa] shear strength
    weights : (1 + R, strips)

    A pad has what the solved strips show of it, times what the other strips and the second mesh change of a window.
    """
    scene, (solved, best) = job.scene, statistics
    strip, surface = scene.strip, correlated(scene, job.arguments.scan)
    forces, *blocks = (store.join(batches, name).swapaxes(0, 1) for name in ("force", "block_area", "block_force"))
    window = round(strip.window_m / strip.window_spacing_m)
    counts = [count for count in ADJACENT if count * window <= blocks[0].shape[2]]
    table: Table = {}
    for level, of_level in enumerate(forces):
        totals = resampled(weights, np.stack((of_level.sum(axis=1), np.ones(len(of_level))), axis=1)).T
        each = totals[0] / totals[1] / of_level.shape[1]
        area, force = (part[level] for part in blocks)
        adjacent = [adjacent_variance(area, force, weights, count * window) for count in counts]
        covariance = influence_covariance(area, force, weights)
        sizes = strip.window_spacing_m, strip.width_m, strip.window_m
        variance = pad_scatter(covariance, adjacent[0], surface, *sizes)
        of_window = shear.value / solved["std"][level].rows[:, None]  # to shares of the scatter of a window
        std, independent = of_window * np.sqrt(variance), variance[:, :1] / variance
        together = solved["ratio_of_sums"][level].rows / solved["mean"][level].rows - 1.0
        mean = 1.0 + together[:, None] * (1.0 - np.minimum(std, 1.0) ** 2)
        own_mean, own_std = (best[name][level].rows[:, None] for name in ("mean", "std"))
        found = {
            "force_per_window": each,
            "nominal_pressure": each / (strip.window_m * strip.width_m),
            "pad_mean": own_mean * mean,
            "pad_std": own_std * std,
            "pad_independent_windows": independent,
            "adjacent_std": own_std * of_window * np.sqrt(np.stack(adjacent, axis=1)),
        }
        if scene.oscillator.normal_force_n is not None:
            windows = scene.oscillator.normal_force_n / each
            of_load = np.sqrt(between_pads(variance, np.maximum(windows, 1.0)))
            found |= {"load_windows": windows, "load_std": (own_std * of_window)[:, 0] * of_load}
        for name, rows in found.items():
            table.setdefault(name, []).append(Estimate.from_rows(rows))
    return table


def load_variables(scene: Scene, table: Table) -> dict[str, store.Variable]:
    """A load table with its units, and the penetration of the scene's nominal pressure where it gives one."""
    count = table["adjacent_std"][0].value.size
    variables = {
        "pad_windows": store.Variable(("pad",), WINDOWS, "1", "windows of a pad"),
        "adjacent_windows": store.Variable(("adjacent",), np.array(ADJACENT[:count]), "1", "windows along a strip"),
    }
    title = "standard deviation of the friction coefficient of adjacent windows together, as measured along the strips"
    titles: dict[str, tuple[tuple[str, ...], str, str]] = {name: (("level",), *one) for name, one in TITLES.items()}
    titles |= {name: (("level", "pad"), *one) for name, one in OF_PADS.items()}
    titles["adjacent_std"] = (("level", "adjacent"), "1", title)
    for name, estimates in table.items():
        dimensions, unit, title = titles[name]
        columns = [np.array([getattr(each, part) for each in estimates]) for part in ("value", "low", "high")]
        variables |= store.with_interval(name, dimensions, columns, unit, title)
    wanted = None if scene.load is None else scene.load.nominal_pressure_pa
    if wanted is not None:
        pressure = np.stack([each.rows for each in table["nominal_pressure"]], axis=1)
        levels = np.array(scene.strip.penetration_percentiles, dtype=float)
        found = Estimate.from_rows(percentile_of_pressure(levels, pressure, wanted))
        title = "penetration at which the mean pressure of the strips is the scene's nominal pressure"
        ends = [found.value, found.low, found.high]
        variables |= store.with_interval("load_percentile", (), ends, "percent", title)
    return variables
