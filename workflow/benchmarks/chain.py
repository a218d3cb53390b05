"""Measure work and precision of the chain of friction: the CPU time that an accuracy of mean and scatter takes.

An accuracy is the largest half width of the 95 % intervals at penetrations from 20 to 95 %, in units of the mean at the
median. The stages of scene `resolved` run in this process, on the cells h that follow from the accuracy, and on 2h.
Seconds are those of all stages from strip_pilot to friction, without start-up and compilation.

The plain way solves every strip at each penetration from a cold start, without control variate and extrapolation:

    - K independent strips leave the half width w = 1.96 sigma / sqrt(K). K is counted, the strips are not solved.
      Here sigma is the scatter of the influence of a strip, from our run with most strips.
    - The seconds of a strip are measured on one, with conjugate gradients of Polonsky and Keer in numpy.
    - Cells leave the error m, which our extrapolation takes off. For our half width, w = ours - m on the cheapest
      cells of our runs. `mesh_error` is m there.

`true_error` is the largest difference of our numbers from the kept Monte Carlo reference of 4000 direct strips, whose
standard error there is `reference_error`. Both are compared on cells h, thus before our extrapolation, where h is that
of the reference.
"""

from __future__ import annotations

import math
import tempfile
import time
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.allocation import PERCENTILES, influences
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.limits import SHARES
from roughslip.probability.estimate import NORMAL_95
from roughslip.scene.accuracy import discretised
from roughslip.scene.fields import AUTO
from roughslip.scene.loader import load
from roughslip.scene.mistakes import Values
from roughslip.scene.types import Scene, scene_of
from roughslip.stages import chaos_strip, contact_strip, expansion_strip, friction, strip_allocation, strip_pilot
from roughslip.stages.from_scene import geometry, surface_model
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.usage import Usage
from workflow.benchmarks.chaos import KEPT_RESULTS, ROOT
from workflow.benchmarks.contact import Mesh, PolonskyKeer, Problem, tune
from workflow.benchmarks.runner import OURS, case, make_row

SCENE = "resolved"
PLAIN = "plain"
ASKED, QUICK = (0.1, 0.05, 0.03, 0.01), (0.1, 0.05)
LIMIT_S = 3000.0  # accuracy.cost_limit_cpu_s: enough for 0.01
STREAM = 30  # the second entry of the seed of the plain strip

Windows = tuple[np.ndarray, np.ndarray]  # mu in units of the shear strength, and valid, each (strips, windows)


class Run(NamedTuple):
    """What an accuracy took: CPU seconds, strips, half width reached, results of stage friction, windows of strips."""

    seconds: float
    strips: int
    half_width: float
    friction: store.Result
    solved: list[Windows]


def changed(scene: Values, **changes: Mapping[str, object]) -> Values:
    """Return the scene with changed values in its sections."""
    return {**scene, **{name: {**scene.get(name, {}), **values} for name, values in changes.items()}}


def run_stage(stage: ModuleType, scene: Values, output: Path, **arguments: object) -> tuple[float, dict[str, float]]:
    """Run a stage in this process; return its CPU seconds and its counts."""
    options = {"scan": None, "allocation": None, "summary": output.with_suffix(".csv"), "output": output, **arguments}
    usage = Usage(output.with_suffix(".json"), stage.STAGE.name)
    start = time.process_time()
    stage.work(Job(store.Key(scene, "benchmark"), Namespace(**options), usage))
    return time.process_time() - start, usage.did


def run_chain(scene: Values, folder: Path) -> Run:
    """Run the chain for the accuracy of friction that the scene asks. Raises IllPosedError where that is refused."""
    scene = changed(scene, strip={"samples": AUTO, "expansion_samples": AUTO})
    pilot, fitted, allocation, statistics = (folder / f"{name}.nc" for name in ("pilot", "fit", "allocation", "end"))
    typed = scene_of(scene)
    least = typed.friction.least_contact_fraction * typed.strip.window_m * typed.strip.width_m
    seconds = run_stage(strip_pilot, scene, pilot)[0] + run_stage(chaos_strip, scene, fitted, contact=[pilot])[0]
    seconds += run_stage(strip_allocation, scene, allocation, pilot=pilot, expansion=fitted)[0]
    files: dict[ModuleType, list[Path]] = {contact_strip: [pilot], expansion_strip: []}
    for stage, paths in files.items():
        for share in range(SHARES):
            paths.append(folder / f"{stage.STAGE.name}-{share}.nc")
            place = {"first": share, "last": share + 1, "allocation": allocation, "expansion": fitted}
            seconds += run_stage(stage, scene, paths[-1], **place)[0]
    contact, expansion = files.values()
    made = {"contact": contact, "expansion": expansion, "allocation": allocation}
    last, did = run_stage(friction, scene, statistics, **made)
    reached = max(did["friction_mean_reached"], did["friction_std_reached"])
    area, force = friction.area_and_force(store.read_all(contact))
    solved = list(zip(*friction_coefficient(area, force, 1.0, least), strict=True))
    return Run(seconds + last, area.shape[1], reached, store.read(statistics), solved)


def with_own_cells(scene: Values, asked: float) -> Values:
    """Return the scene with an accuracy of mean and scatter, and the cells and the tolerance that follow from it."""
    accuracy = {"friction_mean": asked, "friction_std": asked, "cost_limit_cpu_s": LIMIT_S}
    opened = changed(scene, accuracy=accuracy, strip={"cell_m": AUTO}, numerics={"contact_tolerance": AUTO})
    return discretised(opened)[0]


def is_judged(percentiles: np.ndarray) -> np.ndarray:
    """Return at which penetrations an accuracy holds."""
    return (percentiles >= PERCENTILES[0]) & (percentiles <= PERCENTILES[1])


def find_true_error(friction: Mapping[str, np.ndarray], reference: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Return the largest relative difference from direct strips on the same cells, and their relative standard error.

    friction : of its stage; reference : area over force [1/Pa], at all its penetrations
    """
    places, judged = np.searchsorted(reference["percentile"], friction["percentile"]), is_judged(friction["percentile"])
    (median,) = np.flatnonzero(friction["percentile"] == 50.0)
    errors: list[tuple[float, float]] = []
    for name in ("mean", "std"):
        ours = (
            friction[f"combined_{name}"]
            / (1.0 + friction[f"mesh_change_of_{name}"])
            / friction["combined_mean"][median]
        )
        direct = reference[name][places] / reference["mean"][places[median]]
        known = (reference[f"{name}_standard_error"] / reference[name])[places]
        errors += zip(np.abs(ours / direct - 1.0)[judged].tolist(), known[judged].tolist(), strict=True)
    return max(errors)


def time_plain_strip(scene: Scene) -> float:
    """Return CPU seconds of the cold solves of one strip at all penetrations, with a solver tuned to the tolerance."""
    model, mesh = surface_model.surface_model(scene), Mesh(geometry.strip_grid(scene))
    solver, tolerance = PolonskyKeer(mesh.grid, mesh.displacement), scene.numerics.contact_tolerance
    rough = model.heights(model.sampler(mesh.grid)(np.random.default_rng([scene.seed, STREAM, 0])))
    percentiles = np.array([50.0, *scene.strip.penetration_percentiles])
    first, *problems = (Problem(rough, float(plane)) for plane in model.plane_height(percentiles))
    setting, _ = tune(solver, first, 0.0, tolerance, 5 * tolerance, mesh.displacement.residual)
    start = time.process_time()
    for problem in problems:
        solver.solve(problem, 0.0, setting)
    return time.process_time() - start


def measure_scene(scene: Values, reference: Mapping[str, np.ndarray], asked: Sequence[float]) -> dict[str, Any]:
    """Return the summary and the rows."""
    own = {accuracy: with_own_cells(scene, accuracy) for accuracy in asked}
    runs: dict[float, Run] = {}
    refused: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        few = changed(scene, strip={"penetration_percentiles": [20.0, 50.0, 95.0]})
        run_chain(with_own_cells(few, 0.3), Path(folder))  # compiles
        for accuracy in asked:
            try:
                runs[accuracy] = run_chain(own[accuracy], Path(folder))
            except IllPosedError as error:
                refused[case(scene=SCENE, asked=accuracy)] = str(error)
    most = max(runs.values(), key=lambda run: run.strips)
    percentiles = most.friction["percentile"]
    of_strip = [influences(*windows) for windows in most.solved]  # by penetration
    of_median = of_strip[int(np.flatnonzero(percentiles == 50.0)[0])][:, :1]
    judged = [influence for influence, counts in zip(of_strip, is_judged(percentiles), strict=True) if counts]
    scatter = float(max((influence - of_median).std(axis=0, ddof=1).max() for influence in judged))
    # By cell the error of the mesh and seconds of a plain strip; of the last run on it.
    cells: dict[float, tuple[float, float]] = {}
    for accuracy, run in runs.items():
        changes = [run.friction[f"mesh_change_of_{name}"][is_judged(percentiles)] for name in ("mean", "std")]
        cells[own[accuracy]["strip"]["cell_m"]] = (
            float(np.abs(changes).max()),
            time_plain_strip(scene_of(own[accuracy])),
        )
    rows, ratios = [], {}
    for accuracy, run in runs.items():
        name, more = case(scene=SCENE, asked=accuracy), {"cell_m": own[accuracy]["strip"]["cell_m"]}
        if more["cell_m"] == scene["strip"]["cell_m"]:
            errors = find_true_error(run.friction, reference)
            more |= dict(zip(("true_error", "reference_error"), errors, strict=True))
        rows.append(make_row(name, OURS, run.half_width, [run.seconds], run.strips, **more))
        # K independent strips leave 1.96 sigma / sqrt(K), on the cheapest cells that leave less than our half width.
        plain = []
        for h, (left, seconds) in cells.items():
            if left < run.half_width:
                strips = (NORMAL_95 * scatter / (run.half_width - left)) ** 2
                plain.append((strips * seconds, math.ceil(strips), {"mesh_error": left, "cell_m": h}))
        if plain:
            seconds, strips, more = min(plain, key=lambda option: option[0])
            rows.append(make_row(name, PLAIN, run.half_width, [seconds], strips, **more))
            ratios[name] = seconds / run.seconds
    exponent = -float(np.polyfit(np.log(list(runs)), np.log([run.seconds for run in runs.values()]), 1)[0])
    measured = {"scatter_of_strip": scatter, "strips": most.strips}
    measured["plain_strip_seconds"] = {h: seconds for h, (_, seconds) in cells.items()}
    summary = {"exponent": exponent, "plain_over_ours": ratios, "refused": refused, "measured": measured}
    return {"summary": summary, "rows": rows}


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary and the rows."""
    reference = store.read(KEPT_RESULTS / SCENE / "friction.nc")
    return measure_scene(load(SCENE, ROOT / "config" / "scenes"), reference, QUICK if quick else ASKED)
