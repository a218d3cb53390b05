"""What strips say of load: force and pressure of a window, windows that bear the scene's force, and their scatter."""

import numpy as np

from roughslip import store
from roughslip.friction.pad import WINDOWS, Blocks, between_pads, pads
from roughslip.friction.table import FrictionTable
from roughslip.friction.windows import estimate_of, resampled
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of
from roughslip.study.job import Job
from roughslip.study.result_tables.pad_autocorrelation import PARTS, correlated

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


def load_table(job: Job, blocks: list[Blocks], friction: FrictionTable) -> Table:
    """Load of windows and scatter of pads at every penetration. blocks : of the solved strips, by level

    A pad has what the solved strips show of it, times what the other strips change of a window.
    """
    scene, strip, weights, solved = job.scene, job.scene.strip, friction.weights, friction.solved
    surface = correlated(scene, job.optional("scan"))
    table: Table = {}
    for level, of_level in enumerate(blocks):
        force = of_level.windows[1]
        totals = resampled(weights, np.stack((force.sum(axis=1), np.ones(len(force))), axis=1)).T
        each = totals[0] / totals[1] / force.shape[1]
        parts, variance = pads(of_level, surface, weights)
        of_window = friction.shear.value / solved["std"][level].rows[:, None]  # to shares of the scatter of a window
        std = of_window * np.sqrt(variance)
        together = solved["ratio_of_sums"][level].rows / solved["mean"][level].rows - 1.0
        mean = 1.0 + together[:, None] * (1.0 - np.minimum(std, 1.0) ** 2)
        own_mean, own_std = (of_all(name, level, friction)[:, None] for name in ("mean", "std"))
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
            kind = "std" if name.endswith("std") else "mean"
            table.setdefault(name, []).append(estimate_of(kind, rows, weights.shape[1]))
    return table


def of_all(name: str, level: int, friction: FrictionTable) -> np.ndarray:
    """Mean or std (1 + R,) of the solved windows of a level, times what the other strips change.

    Where windows without contact are left out, the others touch lightly, and their moments have a heavy tail. The
    change is then that of the next level without such windows, if there is one.
    """
    solved, best = friction.solved, friction.combined
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
