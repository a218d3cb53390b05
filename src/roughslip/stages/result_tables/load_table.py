"""What strips say of load: force and pressure of a window, windows that bear the scene's force, and their scatter."""

import numpy as np

from roughslip import store
from roughslip.friction.pad import (
    WINDOWS,
    adjacent_variance,
    between_pads,
    influence_covariance,
    mehler_parts,
    pad_scatter,
)
from roughslip.friction.statistics import estimate_of, resampled
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of
from roughslip.stages.result_tables.pad_autocorrelation import PARTS, correlated
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
    scene, (solved, _) = job.scene, statistics
    strip, surface = scene.strip, correlated(scene, job.arguments.scan)
    forces, *blocks = (store.join(batches, name).swapaxes(0, 1) for name in ("force", "block_area", "block_force"))
    window = round(strip.window_m / strip.window_spacing_m)
    table: Table = {}
    for level, of_level in enumerate(forces):
        totals = resampled(weights, np.stack((of_level.sum(axis=1), np.ones(len(of_level))), axis=1)).T
        each = totals[0] / totals[1] / of_level.shape[1]
        area, force = (part[level] for part in blocks)
        adjacent = adjacent_variance(area, force, weights, window)
        covariance = influence_covariance(area, force, weights)
        sizes = strip.window_spacing_m, strip.width_m, strip.window_m
        parts = mehler_parts(covariance, surface, *sizes[:2])
        variance = pad_scatter(parts, adjacent, surface, *sizes)
        of_window = shear.value / solved["std"][level].rows[:, None]  # to shares of the scatter of a window
        std = of_window * np.sqrt(variance)
        together = solved["ratio_of_sums"][level].rows / solved["mean"][level].rows - 1.0
        mean = 1.0 + together[:, None] * (1.0 - np.minimum(std, 1.0) ** 2)
        own_mean, own_std = (of_all(name, level, statistics)[:, None] for name in ("mean", "std"))
        columns = {
            "force_per_window": each,
            "nominal_pressure": each / (strip.window_m * strip.width_m),
            "pad_mean": own_mean * mean,
            "pad_std": own_std * std,
            "pad_parts": parts,
        }
        if scene.oscillator.normal_force_n is not None:
            windows = scene.oscillator.normal_force_n / each
            of_load = np.sqrt(between_pads(variance, np.maximum(windows, 1.0)))
            columns |= {"load_windows": windows, "load_std": (own_std * of_window)[:, 0] * of_load}
        for name, rows in columns.items():
            table.setdefault(name, []).append(estimate_of(_kind(name), rows, weights.shape[1]))
    return table


def _kind(name: str) -> str:
    return "std" if name.endswith("std") else "mean"


def of_all(name: str, level: int, statistics: tuple[Table, Table]) -> np.ndarray:
    """Mean or std (1 + R,) of the solved windows of a level, times what the other strips and the second mesh change.

    Where windows without contact are left out, the others touch lightly, and their moments have a heavy tail. The
    change is then that of the next level without such windows, if there is one.
    """
    solved, best = statistics
    missing = [float(share.value) for share in solved["missing_share"]]
    full = next((k for k in range(level, len(missing)) if missing[k] == 0.0), level)
    if full == level:
        return best[name][level].rows
    return solved[name][level].rows * best[name][full].rows / solved[name][full].rows


def load_variables(table: Table) -> dict[str, store.Variable]:
    """Load tables with their units."""
    variables = {"pad_windows": store.Variable(("pad",), WINDOWS, "1", "windows of a pad")}
    titles: dict[str, tuple[tuple[str, ...], str, str]] = {name: (("level",), *title) for name, title in TITLES.items()}
    titles |= {name: (("level", "pad"), *title) for name, title in OF_PADS.items()}
    titles["pad_parts"] = ("level", "part"), *PARTS
    for name, estimates in table.items():
        dimensions, unit, title = titles[name]
        variables |= store.with_interval(name, dimensions, columns_of(estimates), unit, title)
    return variables
