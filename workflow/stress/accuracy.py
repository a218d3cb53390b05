"""Accuracies asked of friction: random scenes, each judged by an independent run on finer cells.

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

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from roughslip.errors import IllPosedError
from roughslip.friction.allocation import influences
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.probability.estimate import NORMAL_95
from roughslip.scene.loader import load
from roughslip.scene.mistakes import Values
from roughslip.scene.types import Scene, scene_of
from roughslip.stages.from_scene import geometry, surface_model
from workflow.benchmarks.chain import ROOT, changed, is_judged, run_chain
from workflow.monte_carlo.friction import solve_windows
from workflow.stress.runner import Trial, choose, log_uniform

KINDS: dict[str, dict[str, float]] = {"gaussian": {}, "matern": {"smoothness": 2.5}}
SHORTEST, FEWEST_WINDOWS = 8, 4  # correlation lengths and windows of a strip
LEAST_CELLS = 8.0  # in contact, of a window that counts
LIMIT_S = 3.0  # accuracy.cost_limit_cpu_s
FEW, MANY = 24, 300  # strips of the judge on both meshes, and on the cells of the scene
SIGMAS = 4.0
TOLERANCE = 1e-6  # of the judge
STREAM = 31  # the second entry of the seeds of its strips


def attempt(trial: Trial) -> None:
    """Run the chain of friction on a random scene and compare mean and scatter at every judged penetration."""
    values = draw_scene(trial.rng)
    asked = values["accuracy"]["friction_mean"]
    trial.case |= {"kind": values["roughness"]["covariance"], "asked": asked}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "random.yaml")
        path.write_text(yaml.safe_dump(values), encoding="utf-8")  # JSON writes 2e-06, which is text in YAML
        trial.answers = (IllPosedError,)
        scene = load(path, ROOT / "config" / "scenes")
        run = run_chain(scene, Path(folder))
    trial.answers = ()
    judge(trial, run.friction, max(asked, run.half_width), *independent(scene))


def judge(
    trial: Trial, friction: dict, half_width: float, known: np.ndarray, error: np.ndarray, mesh: np.ndarray
) -> None:
    """Check results of stage friction; known, error, mesh : (levels, 2) T, its standard error, what its mesh leaves."""
    claimed, percentile = np.log([friction["combined_mean"], friction["combined_std"]]).T, friction["percentile"]
    (median,) = np.flatnonzero(percentile == 50.0)
    away = np.abs(claimed - claimed[median, 0] - known)
    limit = SIGMAS * np.hypot(half_width / NORMAL_95, error) + mesh
    for level in np.flatnonzero(is_judged(percentile)):
        for which, name in enumerate(("mean", "std")):
            if (level, which) != (median, 0):
                trial.check(f"{name} at {percentile[level]:g} %", away[level, which], limit[level, which])


def draw_scene(rng: np.random.Generator) -> Values:
    """Draw a scene as a user writes it; all lengths are multiples of the cell."""
    light, deep = (float(drawn) for drawn in (rng.integers(20, 40), rng.integers(60, 96)))
    cells, window = int(rng.integers(8, 15)), 4 * int(rng.integers(3, 9))
    kind, width = choose(rng, tuple(KINDS)), 2 * int(rng.integers(4, 13))
    windows = max(-(-SHORTEST * cells // window), FEWEST_WINDOWS) + int(rng.integers(0, 4))
    h, rms, asked = (float(f"{log_uniform(rng, *ends):.3g}") for ends in ((-6.3, -5.3), (-7.5, -6), (-1.5, -0.5)))
    lengths = {"width": width, "window": window, "window_spacing": window // 2, "cell": 1}
    lengths |= {"length": windows * window, "margin": 4 * cells, "expansion_spacing": 2}
    return {
        "extends": "resolved",
        "targets": ["figure3"],
        "friction": {"least_contact_fraction": max(1e-3, LEAST_CELLS / (width * window))},
        "accuracy": {"friction_mean": asked, "friction_std": asked, "cost_limit_cpu_s": LIMIT_S},
        "roughness": {"covariance": kind, "rms_height_m": rms, "correlation_length_m": cells * h, **KINDS[kind]},
        "strip": {f"{name}_m": count * h for name, count in lengths.items()}
        | {"penetration_percentiles": [light, 50.0, deep]},
    }


def independent(values: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (levels, 2) T of plain runs, its standard error, and what the mesh leaves of it."""
    scene, fine = (scene_of(own) for own in (values, changed(values, strip={"cell_m": values["strip"]["cell_m"] / 2})))
    model, median = surface_model.surface_model(fine), scene.strip.penetration_percentiles.index(50.0)
    streams = (np.random.default_rng([scene.seed, STREAM, number]) for number in range(FEW + MANY))
    sample, sample_fine = (model.sampler(geometry.strip_grid(own)) for own in (scene, fine))
    few = [sample_fine(next(streams)) for _ in range(FEW)]
    all_ = windows_of(scene, [*(field[1::2, 1::2] for field in few), *map(sample, streams)])
    on_few = [part[:FEW] for part in all_]
    (all_t, all_g), (few_t, few_g), (half_t, half_g) = (
        statistics(*windows, median) for windows in (all_, on_few, windows_of(fine, few))
    )
    change = half_t - few_t
    variance = all_g.var(axis=1, ddof=1) / (FEW + MANY) + (half_g - few_g).var(axis=1, ddof=1) / FEW
    return all_t + change, np.sqrt(variance), np.abs(change) / 2


def windows_of(scene: Scene, fields: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return (strips, levels, windows) friction over the shear strength, and where it is defined, by cold solves."""
    percentiles = scene.strip.penetration_percentiles
    area, force = np.concatenate(
        [solve_windows(scene, fields, [percentile], TOLERANCE) for percentile in percentiles], axis=2
    )
    minimum = scene.friction.least_contact_fraction * scene.strip.window_m * scene.strip.width_m
    return friction_coefficient(area, force, 1.0, minimum)


def statistics(mu: np.ndarray, valid: np.ndarray, median: int) -> tuple[np.ndarray, np.ndarray]:
    """Return T (levels, 2) and the influences g (levels, strips, 2) of its strips."""
    levels = [(mu[:, level], valid[:, level]) for level in range(mu.shape[1])]
    t = np.array([np.log([windows[counts].mean(), windows[counts].std()]) for windows, counts in levels])
    g = np.array([influences(*windows) for windows in levels])
    return t - t[median, 0], g - g[median, :, :1]
