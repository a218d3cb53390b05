"""Stage friction: statistics of the friction coefficient over penetration, or under a load and over loads about it."""

from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.pad import ROUNDING, WINDOWS, Blocks, between_pads, pads
from roughslip.friction.table import FrictionTable, WindowLayout, friction_table
from roughslip.friction.table_variables import missing_warnings, summary, table_variables
from roughslip.friction.windows import Windows, estimate_of, resampled
from roughslip.probability import Estimate
from roughslip.probability.estimate import columns_of
from roughslip.scene.part import Scene
from roughslip.study.friction_under_load import PARTS, correlated, correlation_variables, load_results
from roughslip.study.from_scene import Stream, geometry
from roughslip.study.job import Job

REPLICATES = 400
UNSEEN = 5e-3  # noise that no statistic shows
MODELS = ("solved", "expansion")
TITLES: dict[str, tuple[tuple[str, ...], str, str]] = {  # a pad is a square of so many windows, or a row of them
    "force_per_window": (("level",), "N", "mean normal force on a window, windows without contact too"),
    "nominal_pressure": (("level",), "Pa", "mean normal force over the area of the windows"),
    "load_windows": (("level",), "1", "windows that bear the scene's normal force at this penetration"),
    "load_std": (("level",), "1", "standard deviation of the friction coefficient of as many windows under one plane"),
    "pad_mean": (("level", "pad"), "1", "mean friction coefficient of a pad, by area over force of all its windows"),
    "pad_std": (("level", "pad"), "1", "standard deviation of the friction coefficient of a pad"),
    "pad_parts": (("level", "part"), *PARTS),
}


def work(scene: Scene, job: Job) -> None:
    """Write every statistic with its interval, and summary.csv."""
    files = store.read_all(job.paths("blocks"))
    solved, expanded = ([file for file in files if file.attributes["model"] == model] for model in MODELS)
    if scene.load is None:
        variables, text = over_penetration(job, solved, expanded)
    else:
        (own,) = blocks_of(scene, solved)
        variables, text = load_results(job, own, over_loads(scene, solved), solved)
    store.write(job.output, variables, job.key)
    store.write_text(job.outputs["summary"], text)


def blocks_of(scene: Scene, batches: list[store.Result], size: str = "") -> list[Blocks]:
    """The blocks of all samples at each level. size : at the end of names"""
    area, force = (store.join(batches, name + size) for name in ("area", "force"))
    sizes, periodic = (scene.strip.window_spacing_m, scene.strip.width_m, scene.strip.window_m), scene.load is not None
    return [Blocks(area[:, level], force[:, level], *sizes, periodic) for level in range(area.shape[1])]


def over_loads(scene: Scene, solved: list[store.Result]) -> dict[float, Blocks]:
    """The blocks of cells under the pressures about the load, by pressure [Pa]."""
    found: dict[float, Blocks] = {}
    for size in (f"_{number}" for number in range(1, int(solved[0].attributes["sizes"]))):
        found |= dict(zip(solved[0][f"at{size}"].tolist(), blocks_of(scene, solved, size), strict=True))
    return found


def over_penetration(
    job: Job, solved: list[store.Result], expanded: list[store.Result]
) -> tuple[dict[str, store.Variable], str]:
    """Calibrate the shear strength at the median; statistics of every penetration, and the text of summary.csv."""
    scene, strip, seed = job.scene, job.scene.strip, job.scene.seed
    blocks = blocks_of(scene, solved)
    sums = [each.windows for each in blocks]
    others = [each.windows for each in blocks_of(scene, expanded)] if expanded else None
    percentiles = np.array(strip.penetration_percentiles, dtype=float)
    layout = WindowLayout(percentiles, strip.window_m, strip.window_spacing_m, sums[0][0].shape[1])
    least, draws, mean = geometry.least_contact_area(scene), [seed, Stream.BOOTSTRAP], scene.friction.mean
    rest: Any = least, layout, mean, REPLICATES, draws, job.progress
    try:
        table = friction_table(sums, others, *rest)
    except IllPosedError as error:
        table = friction_table(unresolved(sums, np.random.default_rng([*draws, layout.count])), others, *rest)
        job.warn(f"noise of {UNSEEN:g} of the range stands for no scatter: {error.in_scene}")
    known = table.layout.percentiles
    loads = load_table(job, [blocks[int(np.flatnonzero(percentiles == level)[0])] for level in known], table)
    job.warn(*(f"the penetration of {level:g} % is left out: {reason}" for level, reason in table.missing.items()))
    job.warn(*missing_warnings(table.solved["missing_share"], known))
    job.count(windows=sums[0][0].size, expanded_windows=others[0][0].size if others else 0)
    variables = table_variables(table) | loads
    variables |= correlation_variables(scene, job.optional("scan"))
    return variables, summary(variables)


def unresolved(sums: list[Windows], generator: np.random.Generator) -> list[Windows]:
    """Windows with noise of ROUNDING of their mean, or UNSEEN of their range, for contact that yields in most of them.

    There mu = tau / H has no scatter, in all strips or in those of a resampled set.
    """
    noisy = []
    for area, force in sums:
        mu = area[force > 0.0] / force[force > 0.0]
        share = max(ROUNDING, UNSEEN * float(np.ptp(mu) / mu.mean())) if mu.size else ROUNDING
        noisy.append((area * (1.0 + share * generator.standard_normal(area.shape)), force))
    return noisy


def load_table(job: Job, blocks: list[Blocks], friction: FrictionTable) -> dict[str, store.Variable]:
    """Load of windows and scatter of pads at every penetration. blocks : of the solved strips, by level

    A pad has what the solved strips show of it, times what the other strips change of a window.
    """
    scene, strip, weights, solved = job.scene, job.scene.strip, friction.weights, friction.solved
    surface = correlated(scene, job.optional("scan"))
    table: dict[str, list[Estimate]] = {}  # by name the estimates of all levels
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
    variables = {"pad_windows": store.Variable(("pad",), WINDOWS, "1", "windows of a pad")}
    for name, estimates in table.items():
        dimensions, unit, title = TITLES[name]
        variables |= store.with_interval(name, dimensions, columns_of(estimates), unit, title)
    return variables


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
