"""Stage sweep: the variants of a scene in one table, with the numbers that an engineer compares."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.report.sweep_page import Number, Row, sweep_page, sweep_table
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="sweep",
    reads="description",
    result="sweep.html",
    outputs={"table": "sweep.csv"},
)

_FRICTION, _MOTION, _LIMITS = "friction/statistics.nc", "oscillator/statistics.nc", "oscillator/deterministic.nc"
_LOAD = "friction/under_load.nc"
# By name of a column: its heading, and the file and variable of the number.
NUMBERS = {
    "mean_friction": ("Mean friction, median penetration", _FRICTION, "combined_mean"),
    "std_friction": ("Standard deviation of friction, median penetration", _FRICTION, "combined_std"),
    "mean_friction_of_pad": ("Mean friction of the pad under its load", _LOAD, "load_mean"),
    "std_friction_of_pad": ("Standard deviation of friction of the pad under its load", _LOAD, "load_std"),
    "real_area": ("Real area of contact over the apparent area", _LOAD, "real_area"),
    "stick_slip_probability": ("Probability of stick-slip, at the damping of the scene", _MOTION, "cycling_share"),
    "mean_cycles": ("Mean cycles, where the damping of the scene is in its list", _MOTION, "mean_cycles"),
    "reattachment_m": ("Mean reattachment point X_gh [m]", _MOTION, "reattachment_mean"),
    "hopf_damping": ("Damping below which sliding is unstable, no scatter", _LIMITS, "hopf_damping"),
    "existence_limit": ("Damping above which no cycle exists, no scatter", _LIMITS, "existence_limit"),
}
_NORMAL_95 = 1.96  # standard errors from the mean to the end of the interval


def number(result: store.Result, name: str) -> Number | None:
    """A number of a result with its interval, None where it has none; at the median, or at the damping of the scene."""
    dimensions = result.variable(name).dimensions
    index: tuple[int, ...] = ()
    if dimensions == ("level",):
        index = (int(np.argmin(np.abs(result["percentile"] - 50.0))),)
    elif dimensions == ("damping",):
        index = (int(np.argmin(np.abs(result["damping_ratio"] - result["nominal_damping"]))),)
        if result["damping_ratio"][index] != result["nominal_damping"]:
            return None
    value = float(result[name][index])
    if not np.isfinite(value):
        return None
    if f"{name}_error" in result:
        half = _NORMAL_95 * float(result[f"{name}_error"][index])
        return value, value - half, value + half
    if f"{name}_low" in result:
        return value, float(result[f"{name}_low"][index]), float(result[f"{name}_high"][index])
    return value, None, None


def numbers(files: Mapping[str, Path]) -> dict[str, Number]:
    """Those of NUMBERS that the results of a scene have. files : by their names"""
    results = {
        file: store.read(files[file]) for file in sorted({file for _, file, _ in NUMBERS.values()} & files.keys())
    }
    values = {name: number(results[file], variable) for name, (_, file, variable) in NUMBERS.items() if file in results}
    return {name: value for name, value in values.items() if value is not None}


def work(job: Job) -> None:
    """Write page and table."""
    variants = dict(job.key.configuration["variants"])
    rows = [Row(name, variants[name], numbers(files)) for name, files in job.files.items()]
    titles = {name: title for name, (title, _, _) in NUMBERS.items()}
    store.write_text(job.arguments.output, sweep_page(rows, job.key.configuration["description"], titles))
    store.write_text(job.arguments.table, sweep_table(rows, titles))
    job.usage.count(scenes=len(rows))
