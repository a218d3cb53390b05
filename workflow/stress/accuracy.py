"""Stress campaign of accuracies asked of friction: random scenes, each judged by an independent run on finer cells.

A scene has a random covariance, strip, penetrations and accuracy. The stages choose cells, tolerance and strips, or
refuse with the nearest accuracy. The judge draws other surfaces, solves them one by one from a cold start on half the
cells, and has no expansion and no extrapolation. Many strips on the cells of the scene give the statistics, and a few
on both meshes what half the cells change:

    T = T_h(all) + T_h/2(few) - T_h(few),   var T = var(g_h) / all + var(g_h/2 - g_h) / few

- T: logarithms of mean and standard deviation, less that of the mean at the median penetration
- g: influences of a strip on T

A number is a false claim where it is farther from T than 4 standard errors of both and what the mesh of T leaves, half
of its last change. A run whose interval is wider than asked says so, and claims that interval. `within` in the summary
counts problems with all numbers within the 95 % error asked and known.
"""

from __future__ import annotations

import itertools
import math
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from roughslip.contact.area import contact_shares
from roughslip.contact.solve import solve
from roughslip.errors import IllPosedError, RoughslipError
from roughslip.friction.allocation import influences
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.scene.loader import load
from roughslip.scene.mistakes import Values
from roughslip.scene.types import Scene, scene_of
from roughslip.stages.from_scene import elastic, geometry, surface_model
from workflow.benchmarks.chain import ROOT, Run, Windows, changed, is_judged, run_chain
from workflow.evidence.rows import Row
from workflow.stress import runner
from workflow.stress.runner import Verdict, choose, has_advice, log_uniform, verdict_of

STAGE = "accuracy"
PROBLEMS = 100
KINDS = {"gaussian": {}, "matern": {"smoothness": 2.5}}
SHORTEST, FEWEST_WINDOWS = 8, 4  # correlation lengths and windows of a strip
LEAST_CELLS = 8.0  # in contact, of a window that counts
LIMIT_S = 3.0  # accuracy.cost_limit_cpu_s
FEW, MANY = 24, 300  # strips of the judge on both meshes, and on the cells of the scene
SIGMAS, NORMAL_95 = 4.0, 1.96
TOLERANCE = 1e-6  # of the judge
STREAM = 31  # the second entry of the seeds of its strips


@dataclass(frozen=True)
class AccuracyProblem:
    """A scene that asks for an accuracy.

    number, kind : of the problem, of KINDS
    cells : in a correlation length; width, window : [cells]
    windows : that lie side by side on a strip; as many lie half a window further, but for one
    cell_m, rms_height_m : [m]
    percentiles : [%] of penetration, 50 among them
    asked : half width of mean and standard deviation, relative
    """

    number: int
    kind: str
    cells: int
    width: int
    window: int
    windows: int
    cell_m: float
    rms_height_m: float
    percentiles: tuple[float, ...]
    asked: float

    def values(self, folder: Path) -> Values:
        """The scene, read and checked as one that a user writes."""
        h = self.cell_m
        lengths = {"width": self.width, "window": self.window, "window_spacing": self.window // 2, "cell": 1}
        lengths |= {"length": self.windows * self.window, "margin": 4 * self.cells, "expansion_spacing": 2}
        values = {
            "extends": "resolved",
            "targets": ["figure3"],
            "friction": {"least_contact_fraction": max(1e-3, LEAST_CELLS / (self.width * self.window))},
            "accuracy": {"friction_mean": self.asked, "friction_std": self.asked, "cost_limit_cpu_s": LIMIT_S},
            "roughness": {
                "covariance": self.kind,
                "rms_height_m": self.rms_height_m,
                "correlation_length_m": self.cells * h,
                **KINDS[self.kind],
            },
            "strip": {f"{name}_m": count * h for name, count in lengths.items()}
            | {"penetration_percentiles": list(self.percentiles)},
        }
        path = folder / "random.yaml"
        path.write_text(yaml.safe_dump(values), encoding="utf-8")  # JSON writes 2e-06, which is text in YAML
        return load(path, ROOT / "config" / "scenes")


def random_problem(seed: int, number: int) -> AccuracyProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    light, deep = generator.integers(20, 40), generator.integers(60, 96)
    cells, window = int(generator.integers(8, 15)), 4 * int(generator.integers(3, 9))
    return AccuracyProblem(
        number=number,
        kind=choose(generator, tuple(KINDS)),
        cells=cells,
        width=2 * int(generator.integers(4, 13)),
        window=window,
        windows=max(-(-SHORTEST * cells // window), FEWEST_WINDOWS) + int(generator.integers(0, 4)),
        cell_m=float(f"{log_uniform(generator, -6.3, -5.3):.3g}"),
        rms_height_m=float(f"{log_uniform(generator, -7.5, -6):.3g}"),
        percentiles=(float(light), 50.0, float(deep)),
        asked=float(f"{log_uniform(generator, -1.5, -0.5):.3g}"),
    )


def row_of(seed: int, number: int) -> Row:
    """Return the row of the problem of this number."""
    return runner.problem_row(STAGE, random_problem(seed, number), judged, is_answer)


def is_answer(_: AccuracyProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: a refusal of the accuracy, with advice."""
    return isinstance(error, IllPosedError) and has_advice(error)


def judged(problem: AccuracyProblem) -> Verdict:
    """Run the scene and an independent one and compare. Raises IllPosedError where the accuracy is refused."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = problem.values(folder)
        return judge(problem, run_chain(scene, folder), *independent(scene))


def judge(problem: AccuracyProblem, run: Run, known: np.ndarray, error: np.ndarray, mesh: np.ndarray) -> Verdict:
    """Return the verdict on the numbers of a run; its residual is the largest difference over the 95 % error.

    known, error, mesh : (levels, 2) T of the independent run, its standard error and what its mesh leaves
    """
    found = np.log([run.friction["combined_mean"], run.friction["combined_std"]]).T
    (median,) = np.flatnonzero(run.friction["percentile"] == 50.0)
    away = np.abs(found - found[median, 0] - known)
    ours = max(problem.asked, run.half_width) / NORMAL_95  # a run that misses what was asked warns of it
    conditions = {}
    for level in np.flatnonzero(is_judged(run.friction["percentile"])):
        for which, statistic in enumerate(("mean", "std")):
            if (level, which) != (median, 0):
                sigma = np.hypot(ours, error[level, which])
                name = f"{statistic} at {run.friction['percentile'][level]:g} %"
                conditions[name] = away[level, which], SIGMAS * sigma + mesh[level, which]
    allowed = {name: limit / SIGMAS * NORMAL_95 for name, (_, limit) in conditions.items()}
    return verdict_of(conditions, max(away / allowed[name] for name, (away, _) in conditions.items()))


def independent(values: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (levels, 2) T of plain runs, its standard error, and what the mesh leaves of it."""
    scene, fine = (scene_of(one) for one in (values, changed(values, strip={"cell_m": values["strip"]["cell_m"] / 2})))
    grid, percentiles = geometry.strip_grid(scene), np.array(scene.strip.penetration_percentiles)
    fine_grid = geometry.strip_grid(fine)
    model = surface_model.surface_model(fine)
    planes = model.plane_height(percentiles)
    streams = (np.random.default_rng([scene.seed, STREAM, number]) for number in range(FEW + MANY))
    sample, sample_fine = model.sampler(grid), model.sampler(fine_grid)
    few = [model.heights(sample_fine(next(streams))) for _ in range(FEW)]
    many = [field[1::2, 1::2] for field in few] + [model.heights(sample(next(streams))) for _ in range(MANY)]
    on_cells, on_half = (_windows(*one, planes) for one in ((scene, many), (fine, few)))
    of_few = [(mu[:FEW], valid[:FEW]) for mu, valid in on_cells]
    median = int(np.flatnonzero(percentiles == 50.0)[0])
    (many_t, many_g), (few_t, few_g), (half_t, half_g) = (
        _statistics(one, median) for one in (on_cells, of_few, on_half)
    )
    change = half_t - few_t
    variance = many_g.var(axis=1, ddof=1) / (FEW + MANY) + (half_g - few_g).var(axis=1, ddof=1) / FEW
    return many_t + change, np.sqrt(variance), np.abs(change) / 2


def _windows(scene: Scene, surfaces: Sequence[np.ndarray], planes: np.ndarray) -> list[Windows]:
    """By level, friction in units of the shear strength and whether it is defined, of cold solves."""
    on = elastic.influence(scene, geometry.strip_grid(scene))
    lie, sums = geometry.windows(scene), np.empty((2, len(planes), len(surfaces), geometry.windows(scene).count))
    for (level, plane), (row, heights) in itertools.product(enumerate(planes), enumerate(surfaces)):
        pressure = solve(on, heights - plane, TOLERANCE).pressure
        sums[:, level, row] = lie.sums(contact_shares(pressure, math.inf)), lie.sums(pressure)
    least = scene.friction.least_contact_fraction * scene.strip.window_m * scene.strip.width_m
    return list(zip(*friction_coefficient(*(on.grid.cell_area * sums), 1.0, least), strict=True))


def _statistics(levels: Sequence[Windows], median: int) -> tuple[np.ndarray, np.ndarray]:
    """T (levels, 2) and the influences g (levels, strips, 2) of its strips."""
    t = np.array([np.log([mu[valid].mean(), mu[valid].std()]) for mu, valid in levels])
    g = np.array([influences(*windows) for windows in levels])
    return t - t[median, 0], g - g[median, :, :1]


if __name__ == "__main__":
    sys.exit(runner.command(__doc__, STAGE, row_of, PROBLEMS))
