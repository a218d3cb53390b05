"""Campaign of accuracies asked of friction: random scenes, each judged by an independent run on finer cells.

A scene has a random covariance, strip, penetrations and accuracy. The stages choose cells, tolerance and strips, or
refuse with the nearest accuracy. The judge draws other surfaces, solves them one by one from a cold start on half the
cells, and has no expansion and no extrapolation. Many strips on the cells of the scene give the statistics, and a few
on both meshes what half the cells change:

    T = T_h(all) + T_h/2(few) - T_h(few),   var T = var(g_h) / all + var(g_h/2 - g_h) / few

- T: logarithms of mean and standard deviation, less that of the mean at the median penetration
- g: influences of a strip on T

A number is a false claim where it is farther from T than 4 standard errors of both and what the mesh of T leaves, half
of its last change. A run whose interval is wider than asked says so, and claims that interval.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from roughslip.contact.area import contact_shares
from roughslip.contact.solve import solve
from roughslip.errors import IllPosedError
from roughslip.friction.allocation import influences
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.scene.loader import load
from roughslip.scene.mistakes import Values
from roughslip.scene.types import Scene, scene_of
from roughslip.stages.from_scene import elastic, geometry, surface_model
from workflow.benchmarks.chain import ROOT, Run, Windows, changed, is_judged, run_chain
from workflow.stress.runner import Problem, Verdict, choose, log_uniform, unless, verdict_of

KINDS: dict[str, dict[str, float]] = {"gaussian": {}, "matern": {"smoothness": 2.5}}
SHORTEST, FEWEST_WINDOWS = 8, 4  # correlation lengths and windows of a strip
LEAST_CELLS = 8.0  # in contact, of a window that counts
LIMIT_S = 3.0  # accuracy.cost_limit_cpu_s
FEW, MANY = 24, 300  # strips of the judge on both meshes, and on the cells of the scene
SIGMAS, NORMAL_95 = 4.0, 1.96
TOLERANCE = 1e-6  # of the judge
STREAM = 31  # the second entry of the seeds of its strips


def problem(seed: int, number: int) -> Problem:
    """Return the problem of this number."""
    values = random_scene(seed, number)
    asked = values["accuracy"]["friction_mean"]

    def solved() -> tuple[Scene, Run]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "random.yaml")
            path.write_text(yaml.safe_dump(values), encoding="utf-8")  # JSON writes 2e-06, which is text in YAML
            scene = load(path, ROOT / "config" / "scenes")
            return scene, run_chain(scene, Path(folder))

    names = {"kind": values["roughness"]["covariance"], "asked": asked}
    return Problem(names, solved, lambda run: judge(run[1], asked, *independent(run[0])), unless(False, IllPosedError))


def random_scene(seed: int, number: int) -> Values:
    """Return a scene as a user writes it; all lengths are multiples of the cell."""
    generator = np.random.default_rng([seed, number])
    light, deep = (float(one) for one in (generator.integers(20, 40), generator.integers(60, 96)))
    cells, window = int(generator.integers(8, 15)), 4 * int(generator.integers(3, 9))
    kind, width = choose(generator, tuple(KINDS)), 2 * int(generator.integers(4, 13))
    windows = max(-(-SHORTEST * cells // window), FEWEST_WINDOWS) + int(generator.integers(0, 4))
    h, rms, asked = (float(f"{log_uniform(generator, *ends):.3g}") for ends in ((-6.3, -5.3), (-7.5, -6), (-1.5, -0.5)))
    lengths = {"width": width, "window": window, "window_spacing": window // 2, "cell": 1}
    lengths |= {"length": windows * window, "margin": 4 * cells, "expansion_spacing": 2}
    roughness = {"covariance": kind, "rms_height_m": rms, "correlation_length_m": cells * h, **KINDS[kind]}
    percentiles = {"penetration_percentiles": [light, 50.0, deep]}
    return {
        "extends": "resolved",
        "targets": ["figure3"],
        "friction": {"least_contact_fraction": max(1e-3, LEAST_CELLS / (width * window))},
        "accuracy": {"friction_mean": asked, "friction_std": asked, "cost_limit_cpu_s": LIMIT_S},
        "roughness": roughness,
        "strip": {f"{name}_m": count * h for name, count in lengths.items()} | percentiles,
    }


def judge(run: Run, asked: float, known: np.ndarray, error: np.ndarray, mesh: np.ndarray) -> Verdict:
    """Return the verdict on the numbers of a run; its residual is the largest difference over the 95 % error.

    known, error, mesh : (levels, 2) T of the independent run, its standard error and what its mesh leaves
    """
    found, percentile = (
        np.log([run.friction["combined_mean"], run.friction["combined_std"]]).T,
        run.friction["percentile"],
    )
    (median,) = np.flatnonzero(percentile == 50.0)
    away, ours = np.abs(found - found[median, 0] - known), max(asked, run.half_width) / NORMAL_95
    sigma = np.hypot(ours, error)
    places = [(level, which) for level in np.flatnonzero(is_judged(percentile)) for which in (0, 1)]
    places.remove((median, 0))
    limit = SIGMAS * sigma + mesh
    conditions = {f"{('mean', 'std')[at[1]]} at {percentile[at[0]]:g} %": (away[at], limit[at]) for at in places}
    return verdict_of(conditions, max(away[at] * SIGMAS / (limit[at] * NORMAL_95) for at in places))


def independent(values: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (levels, 2) T of plain runs, its standard error, and what the mesh leaves of it."""
    scene, fine = (scene_of(one) for one in (values, changed(values, strip={"cell_m": values["strip"]["cell_m"] / 2})))
    percentiles, model = np.array(scene.strip.penetration_percentiles), surface_model.surface_model(fine)
    planes, median = model.plane_height(percentiles), int(np.flatnonzero(percentiles == 50.0)[0])
    streams = (np.random.default_rng([scene.seed, STREAM, number]) for number in range(FEW + MANY))
    sample, sample_fine = (model.sampler(geometry.strip_grid(one)) for one in (scene, fine))
    few = [model.heights(sample_fine(next(streams))) for _ in range(FEW)]
    many = [field[1::2, 1::2] for field in few] + [model.heights(sample(next(streams))) for _ in range(MANY)]
    on_cells, on_half = (windows_of(*one, planes) for one in ((scene, many), (fine, few)))
    of_few = [(mu[:FEW], valid[:FEW]) for mu, valid in on_cells]
    (many_t, many_g), (few_t, few_g), (half_t, half_g) = (statistics(x, median) for x in (on_cells, of_few, on_half))
    change = half_t - few_t
    variance = many_g.var(axis=1, ddof=1) / (FEW + MANY) + (half_g - few_g).var(axis=1, ddof=1) / FEW
    return many_t + change, np.sqrt(variance), np.abs(change) / 2


def windows_of(scene: Scene, surfaces: Sequence[np.ndarray], planes: np.ndarray) -> list[Windows]:
    """By level, friction in units of the shear strength and whether it is defined, of cold solves."""
    on, lie = elastic.influence(scene, geometry.strip_grid(scene)), geometry.windows(scene)
    sums = np.empty((2, len(planes), len(surfaces), lie.count))
    for level, plane in enumerate(planes):
        for row, heights in enumerate(surfaces):
            pressure = solve(on, heights - plane, TOLERANCE).pressure
            sums[:, level, row] = lie.sums(contact_shares(pressure, math.inf)), lie.sums(pressure)
    least = scene.friction.least_contact_fraction * scene.strip.window_m * scene.strip.width_m
    return list(zip(*friction_coefficient(*(on.grid.cell_area * sums), 1.0, least), strict=True))


def statistics(levels: Sequence[Windows], median: int) -> tuple[np.ndarray, np.ndarray]:
    """T (levels, 2) and the influences g (levels, strips, 2) of its strips."""
    t = np.array([np.log([mu[valid].mean(), mu[valid].std()]) for mu, valid in levels])
    g = np.array([influences(*windows) for windows in levels])
    return t - t[median, 0], g - g[median, :, :1]
