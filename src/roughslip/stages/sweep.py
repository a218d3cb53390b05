"""Stage sweep: the variants of a scene in one table, with the numbers that an engineer compares."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.oscillator.changed import PARAMETERS
from roughslip.probability.estimate import NORMAL_95
from roughslip.report.machine import nearest_limit
from roughslip.report.page import Number, Row, sweep_page, sweep_table
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
# By name of a column: its heading, its unit, and the file and variable of the number.
NUMBERS = {
    "mean_friction": ("Mean friction, median penetration", "1", _FRICTION, "combined_mean"),
    "std_friction": ("Standard deviation of friction, median penetration", "1", _FRICTION, "combined_std"),
    "std_friction_of_pad": ("Standard deviation of friction of the pad under its load", "1", _LOAD, "load_std"),
    "real_area": ("Real area of contact over the apparent area", "1", _LOAD, "real_area"),
    "mean_cycles": ("Mean cycles, where the damping of the scene is in its list", "1", _MOTION, "mean_cycles"),
    "hopf_damping": ("Damping below which sliding is unstable, no scatter", "1", _LIMITS, "hopf_damping"),
    "existence_limit": ("Damping above which no cycle exists, no scatter", "1", _LIMITS, "existence_limit"),
}
# The same of answer.json; a limit is where stick-slip ends, or begins.
ANSWERED = {
    "probability": ("Probability of stick-slip", "1"),
    "friction_mean": ("Mean friction under the load", "1"),
    "friction_deviation": ("Standard deviation of its friction, one window", "1"),
    "amplitude": ("Half of peak to peak", "m"),
    "frequency": ("Frequency", "Hz"),
    **{f"limit_{name}": (f"Limit of the {own.title}", own.unit) for name, own in PARAMETERS.items()},
}
TITLES = ANSWERED | {name: (title, unit) for name, (title, unit, _, _) in NUMBERS.items()}


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
        half = NORMAL_95 * float(result[f"{name}_error"][index])
        return value, value - half, value + half
    if f"{name}_low" in result:
        return value, float(result[f"{name}_low"][index]), float(result[f"{name}_high"][index])
    return value, None, None


def numbers(files: Mapping[str, Path]) -> dict[str, Number]:
    """Those of NUMBERS that the results of a scene have. files : by their names"""
    results = {file: store.read(files[file]) for *_, file, _ in NUMBERS.values() if file in files}
    values = {
        name: number(results[file], variable)
        for name, (_, _, file, variable) in NUMBERS.items()
        if variable in results.get(file, ())
    }
    return {name: value for name, value in values.items() if value is not None}


def of_answer(answer: Mapping[str, Any]) -> dict[str, Number]:
    """Those of ANSWERED that an answer has."""
    answered = {name: answer[name] for name in ANSWERED if name in answer}
    nearest = {f"limit_{name}": nearest_limit(answer, of_parameter) for name, of_parameter in answer["limits"].items()}
    return {
        name: (number["value"], *(number["interval"] or (None, None)))
        for name, number in (answered | nearest).items()
        if number and number["value"] is not None
    }


def row(scene: str, swept: Mapping[str, Any], files: Mapping[str, Path]) -> Row:
    """What a variant found. files : its results by name"""
    answer = store.read_json(files["answer.json"]) if "answer.json" in files else {"given": False}
    if not answer["given"]:
        return Row(scene, swept, numbers(files))
    others = numbers(files)
    others.pop("mean_friction", None)  # it is not of the load
    return Row(scene, swept, of_answer(answer) | others, answer)


def work(job: Job) -> None:
    """Write page and table."""
    variants = dict(job.key.configuration["variants"])
    rows = [row(name, variants[name], files) for name, files in job.files.items()]
    store.write_text(job.arguments.output, sweep_page(rows, job.key.configuration["description"], TITLES))
    store.write_text(job.arguments.table, sweep_table(rows, TITLES))
    job.usage.count(scenes=len(rows))
