"""Stage budget: how sure stick-slip and its limits are, and the part of each uncertain number of the scene.

Sources are the friction curve, the friction process, the surface, the contact solves, and each number of the
oscillator and the load. Contact solves carry the standard errors of scatter and correlation length that the friction
statistics have. A surface under a load carries those of its height and length, of the scan or as the scene gives them.
They change the scatter as powers by the law of scatter (`friction.scatter_law`). A friction record carries the
covariance of its curve, and that of the logarithms of its scatter and length.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError, InputError
from roughslip.friction.pad import pad_edges
from roughslip.friction.scatter_law import Covariance, scatter_by_law
from roughslip.oscillator.budget import VIBRATION, Budget, uncertainty_budget
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.machine import PARAMETERS, Machine
from roughslip.oscillator.table_law import TableLaw, law_from_scene
from roughslip.probability import Source
from roughslip.probability.estimate import NORMAL_95
from roughslip.report.budget_words import budget_summary
from roughslip.scene.part import Scene
from roughslip.scene.schema import source_of
from roughslip.study.from_scene import Stream, elastic
from roughslip.study.from_scene.machine import friction_of, machine_of, oscillator_of, own_windows
from roughslip.study.from_scene.surface_model import gaussian_model
from roughslip.study.job import Job

SAMPLES = 64  # the 95 % intervals of the indices then reach some 0.15 to 0.3 either way
SCAN, SURFACE, SOLVES = "scan", "surface", "contact solves"
MEAN = "friction.mean"
SCATTER, LENGTH = "friction.statistics.standard_deviation", "friction.statistics.correlation_length_m"
STATIC, TABLE, FORCE = "oscillator.static_friction", "oscillator.friction_table", "load.force_n"
OF_SOLVES = {"solved.scatter": "std", "solved.length": "length_least_squares"}  # factors of mean 1, by column
OF_SCAN = {"scan.height": "rms_height", "scan.length": "length_x"}  # the same, of the scan
OF_SURFACE = {"scan.height": "roughness.rms_height_m", "scan.length": "roughness.correlation_length_m"}
RECORDED_CURVE, RECORDED_SCATTER = "recorded curve", "recorded scatter"
STEP = 0.05  # relative, of the height and length by which the powers of the law of scatter are found


def work(scene: Scene, job: Job) -> None:
    """Write the budget, and in budget.json its summary too, with what to measure next."""
    answer = store.read_json(job.path("answer"))
    if not answer["given"]:
        raise InputError(f"figure_budget: {answer['summary'][0]}")
    inputs = uncertain_inputs(scene, job.optional("friction"), job.optional("scan"))
    options: Any = {"samples": SAMPLES, "seed": (scene.seed, Stream.BUDGET)}
    found = uncertainty_budget(inputs.machine, inputs.sources, band_of(answer), **options)
    job.count(machines=SAMPLES * (len(inputs.sources) + 2) if inputs.sources else 1)
    result = {
        **asdict(found),
        "answer": answer["probability"],
        "units": {name: "1" if name == VIBRATION else PARAMETERS[name].unit for name in found.limits},
    }
    store.write_json(job.outputs["text"], result | {"summary": budget_summary(result)})
    store.write(job.output, variables(found), job.key)


def band_of(answer: Mapping[str, Any]) -> tuple[float, float] | None:
    """Damping ratios of 95 % and of 5 % stick-slip, between which it ends as damping grows; None without both."""
    ends = []
    for label in ("0.95", "0.05"):
        for side, change in (("above", "falls below"), ("below", "rises above")):
            one = answer["limits"]["damping"][side][label]
            ends += [float(one["value"])] if one is not None and one["change"] == change else []
    return (ends[0], ends[1]) if len(ends) == 2 and ends[0] < ends[1] else None


def variables(found: Budget) -> dict[str, store.Variable]:
    """The budget as arrays over results and sources."""
    results = {"probability": found.probability, **found.limits}
    source, both = ("source",), ("result", "source")
    names = list(found.probability.first)
    shares = np.reshape([found.outcome[name] for name in names] or [(0.0, 0.0, 0.0)], (-1, 3))
    stored = {
        "source_name": store.Variable(source, np.array(names or [""]), "1", "sources of uncertainty"),
        "result_name": store.Variable(("result",), np.array(list(results)), "1", "results; limits are of the cycle"),
        **store.with_interval("outcome", source, shares.T, "1", "share of the variance of the outcome"),
        "outcome_scatter": store.Variable((), found.scatter, "1", "the same, of the scatter of friction"),
        "averaged_probability": store.Variable((), found.probability.mean, "1", "over all that is uncertain"),
    }
    for name, title in (("first", "first Sobol' index"), ("total", "total Sobol' index")):
        parts = [list(getattr(one, name).values()) or [(0.0, 0.0, 0.0)] for one in results.values()]
        stored |= store.with_interval(name, both, np.moveaxis(np.array(parts), -1, 0), "1", title)
    return stored


@dataclass(frozen=True)
class UncertainInputs:
    """Sources, and the machine at values of their inputs by name: dotted keys, or those of OF_SOLVES and OF_SCAN."""

    sources: tuple[Source, ...]
    machine: Callable[[Mapping[str, float]], Machine]


def uncertain_inputs(scene: Scene, statistics: Path | None, scan: Path | None = None) -> UncertainInputs:
    """What is uncertain in a scene. statistics, scan : the files of the friction and of the scan, if any"""
    own, friction = machine_of(scene, statistics), friction_of(scene, statistics)
    solved = scene.friction.statistics is None
    recorded = () if statistics is None else sources_of_record(store.read(statistics), scene.friction.scatter)
    of_surface, powers = _of_surface(scene, scan) if solved and not recorded and scene.load is not None else ({}, {})

    def machine(values: Mapping[str, float]) -> Machine:
        def factor(key: str) -> float:
            return values[key] / value_of(scene, key) if key in values else 1.0

        of_mean = factor(MEAN)
        scatter = factor(SCATTER) * values.get("solved.scatter", 1.0) * (of_mean if solved else 1.0)
        scatter *= values.get("record.scatter", 1.0)
        length = factor(LENGTH) * values.get("solved.length", 1.0) * values.get("record.length", 1.0)
        scatter *= math.prod(values.get(name, 1.0) ** power for name, power in powers.items())
        mean, deviation = of_mean * friction.mean, scatter * friction.deviation
        section = section_at(scene, values, mean)
        made = Machine(
            oscillator_of(section),
            law_of_record(own.law, values) if recorded else law_from_scene(section, mean),
            replace(friction, mean=mean, deviation=deviation, length_m=length * friction.length_m),
            own.options,
            own.over_load,
        )
        return made.changed({"load": values[FORCE]}) if FORCE in values else made

    inputs = _of_scene(scene) | {SURFACE if scan is None else SCAN: of_surface}
    if solved and statistics is not None and not recorded:
        inputs[SOLVES] = _relative_errors(own_windows(store.read(statistics)), OF_SOLVES)
    sources = (Source.independent(name, of) for name, of in inputs.items() if of)
    return UncertainInputs((*recorded, *sources), machine)


def sources_of_record(friction: store.Result, kind: str) -> tuple[Source, ...]:
    """Curve and scatter of a friction record; none where friction is of another kind. kind : of its scatter"""
    if "record_mean" not in friction:
        return ()
    values = np.append(friction["curve_at_rest"], friction["curve"])
    points = {f"record.curve.{point}": float(value) for point, value in enumerate(values)}
    factor = np.vstack([friction["curve_factor_at_rest"], friction["curve_factor"]])
    curve = Source(RECORDED_CURVE, points, factor @ factor.T)
    covariance = np.expm1(friction[f"{kind}_log_covariance"])  # of factors of mean 1
    if not np.isfinite(covariance).all():
        return (curve,)
    return curve, Source(RECORDED_SCATTER, {"record.scatter": 1.0, "record.length": 1.0}, covariance)


def law_of_record(own: FrictionLaw, values: Mapping[str, float]) -> FrictionLaw:
    """The table of a record at other points, the first of them at rest; of limits as `machine.law_of`."""
    assert isinstance(own, TableLaw)
    points = [values.get(f"record.curve.{point}", value) for point, value in enumerate(own.values)]
    static = max(values.get(STATIC, own.static), points[1])
    return replace(own, values=(min(points[0], static), *points[1:]), static=static)


def powers_of_scatter(
    covariance: Covariance, modulus_pa: float, pressure_pa: float, pad_m: tuple[float, float]
) -> dict[str, float]:
    """d ln CV / d ln of height and length of a surface whose shape is held, by name of OF_SCAN; arguments as there.

    None where the law has no value: heights whose slope has no limit.
    """

    def log_scatter(height: float, length: float) -> float:
        """The scatter depends on p / (E* h'), and on the pad over the length."""
        pad = pad_m[0] / length, pad_m[1] / length
        return math.log(scatter_by_law(covariance, modulus_pa, pressure_pa * length / height, pad))

    less, more = math.exp(-STEP), math.exp(STEP)
    try:
        rises = log_scatter(more, 1.0) - log_scatter(less, 1.0), log_scatter(1.0, more) - log_scatter(1.0, less)
    except IllPosedError:
        return {}
    return {name: rise / (2.0 * STEP) for name, rise in zip(OF_SCAN, rises, strict=True)}


def value_of(scene: Scene, key: str) -> float:
    """The number that a scene gives under a dotted key."""
    value: Any = scene
    for part in key.split("."):
        value = value[int(part)] if part.isdigit() else getattr(value, part)
    return float(value)


def _of_scene(scene: Scene) -> dict[str, dict[str, tuple[float, float]]]:
    """Value and standard uncertainty of the numbers that the scene gives with one, by source."""
    inputs: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in ("friction curve", "friction process")}
    for key, uncertainty in scene.standard_uncertainties:
        if key in OF_SURFACE.values():
            continue
        name = source_of(key)
        inputs.setdefault(name, {})[key] = value_of(scene, key), uncertainty
    return inputs


def _of_surface(scene: Scene, scan: Path | None) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
    """Relative errors of height and length of the surface, and the powers by which they change the scatter."""
    given = dict(scene.standard_uncertainties)
    of_scene = {name: (1.0, given[key] / value_of(scene, key)) for name, key in OF_SURFACE.items() if key in given}
    if scan is None and not of_scene:
        return {}, {}
    strip, modulus = scene.strip, elastic.material(scene).plane_strain_modulus_pa
    pad = pad_edges(scene.oscillator.windows_in_parallel, strip.window_m, strip.width_m, scene.load.pad_length_m)
    covariance = gaussian_model(scene, scan).covariance
    powers = powers_of_scatter(covariance, modulus, scene.load.nominal_pressure_pa, pad)
    if scan is None and not powers:
        raise InputError("roughness: heights whose slope has no limit take no standard uncertainty: give numbers alone")
    found = of_scene if scan is None else _relative_errors(store.read(scan), OF_SCAN)
    return (found if powers else {}), powers


def _relative_errors(result: Mapping[str, np.ndarray], columns: Mapping[str, str]) -> dict[str, tuple[float, float]]:
    """Value 1 and relative standard error by name, from 95 % intervals of columns; without those that have none."""
    errors = {}
    for name, column in columns.items():
        value, low, high = (float(result[f"{column}{end}"]) for end in ("", "_low", "_high"))
        error = (high - low) / (2.0 * NORMAL_95 * value)
        if math.isfinite(error) and error > 0.0:
            errors[name] = 1.0, error
    return errors


def section_at(scene: Scene, values: Mapping[str, float], mean: float) -> SimpleNamespace:
    """The section `oscillator` at other values of its numbers. mean : friction coefficient

    A limit of stick that is the first coefficient of the table stays that; none falls below it.
    """
    section, memory = SimpleNamespace(**vars(scene.oscillator)), scene.oscillator.memory
    section.memory = memory and SimpleNamespace(**vars(memory))
    for key, value in values.items():
        part, _, name = key.rpartition(".")
        if part in ("oscillator", "oscillator.memory"):
            setattr(section.memory if part == "oscillator.memory" else section, name, value)
    if (table := scene.oscillator.friction_table) is not None:
        rows = [(speed, values.get(f"{TABLE}.{row}.1", value)) for row, (speed, value) in enumerate(table)]
        if scene.oscillator.static_friction in (None, table[0][1]):
            own = table[0][1] if section.static_friction is None else section.static_friction
            section.static_friction = values.get(f"{TABLE}.0.1", own)
            rows[0] = rows[0][0], section.static_friction
        section.friction_table, mean = tuple(rows), rows[0][1]
    if section.static_friction is not None:
        section.static_friction = max(section.static_friction, mean)
    return section
