"""What the chain costs, and what textbook methods (`chain_plain`) would cost at the same error.

The CPU seconds of a unit of work are measured on short samples and multiplied by the number of units. Each stage states
in `how` how its units were counted. Common to all stages:

    - Errors are standard errors. A plain mean over K independent samples has the error sigma / sqrt(K). For our error e
      it needs K = K' (s' / e)^2 samples, where K' samples leave the error s'. Of several numbers, the median of K
      counts; `counts` lists K of each.
    - Meshes, spacings and tolerances are those of the scene in both, and their errors are in both.
    - Neither includes what both need or what takes seconds: statistics of windows, designs, limits of the cycle,
      figures, start-up, compilation. Our fits and expansions are included.
    - scipy's error control steps over the nodes of a friction path, where its error far exceeds its tolerance. One
      ratio is at the tolerance where a slip has our error, the other at the tolerance that the scene sets.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roughslip import store
from roughslip.contact.solve import solve
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.oscillator.motion import ensemble_counts
from roughslip.oscillator.path import KeptPath
from roughslip.probability import BetaDistribution
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic, geometry, mass_on_belt, surface_model
from roughslip.surface.karhunen_loeve import karhunen_loeve
from workflow.benchmarks import chain_plain
from workflow.benchmarks.chain_budget import DAMPING, NORMAL, compare_paired, read_friction, read_summary
from workflow.benchmarks.chaos_problem import JUDGED, MEDIAN, QUANTILES, Square, load_scene
from workflow.benchmarks.runner import report_progress
from workflow.evidence.rows import Row, fields
from workflow.monte_carlo.friction import solve_windows

STREAM = 30  # the second entry of every seed
DENSE_NODES = 32  # along an edge: the largest mesh on which LAPACK takes part


class Sizes(NamedTuple):
    """What is run for the measurement: surfaces, strips, paths of ours, and natural periods by scipy."""

    surfaces: int = 100
    strips: int = 16
    paths: int = 4
    periods: float = 2.0


USUAL = Sizes()


@dataclass(frozen=True)
class Work:
    """Units of work, the seconds of each, and the seconds of all other work."""

    units: float
    seconds_each: float
    other_seconds: float = 0.0

    @property
    def seconds(self) -> float:
        """The seconds of the whole stage."""
        return self.units * self.seconds_each + self.other_seconds

    def record(self) -> dict[str, float]:
        """Return what the file holds."""
        names = ("units", "seconds_each", "other_seconds", "seconds")
        return {name: float(getattr(self, name)) for name in names}


@dataclass(frozen=True)
class Stage:
    """A stage of the chain, by our method and by the plain one.

    unit : what is counted
    how : how the units were counted, and what was assumed
    counts : units of the plain method, by the number whose error is the same
    as_asked : the plain method at the scene's own tolerance, where that differs
    """

    name: str
    unit: str
    ours: Work
    plain: Work
    how: str
    counts: Mapping[str, float] = field(default_factory=dict)
    as_asked: Work | None = None

    def record(self, scene: str) -> dict[str, Any]:
        """Return what the file holds."""
        return {
            "scene": scene,
            "stage": self.name,
            "unit": self.unit,
            "ours": self.ours.record(),
            "plain": self.plain.record(),
            "ratio": self.plain.seconds / self.ours.seconds,
            "ratio_at_the_tolerance_asked": (self.as_asked or self.plain).seconds / self.ours.seconds,
            "how": self.how,
            "counts": dict(self.counts),
        }


def samples_for(error: float, samples: int, left: float) -> float:
    """Return how many samples have a mean of this error, if `samples` of them leave the error `left`."""
    return samples * (left / error) ** 2 if error > 0.0 else math.inf


def sum_stages(scene: str, stages: Sequence[Stage]) -> dict[str, Any]:
    """Return the seconds of the whole chain by both methods, and their ratios."""
    ours, plain = (sum(getattr(stage, way).seconds for stage in stages) for way in ("ours", "plain"))
    as_asked = sum((stage.as_asked or stage.plain).seconds for stage in stages)
    return {
        "scene": scene,
        "ours_seconds": ours,
        "plain_seconds": plain,
        "ratio": plain / ours,
        "ratio_at_the_tolerance_asked": as_asked / ours,
    }


def mean_cpu_seconds(calls: Iterable[Callable[[], object]]) -> float:
    """Return the mean CPU seconds of a call."""
    start, count = time.process_time(), 0
    for call in calls:
        call()
        count += 1
    return (time.process_time() - start) / count


def surface_stage(square: Square) -> Stage:
    """Compare modes of the square by symmetry and Lanczos with LAPACK on the whole covariance matrix."""
    order, small = len(square.modes), min(square.grid.nx, DENSE_NODES)
    coarse = geometry.square_grid(load_scene(square.name, {"square.nodes": small}))
    covariance = square.model.covariance
    ours = mean_cpu_seconds([partial(karhunen_loeve, covariance, square.grid, order)])
    plain = mean_cpu_seconds([partial(chain_plain.dense_modes, covariance, coarse, min(order, coarse.size))])
    units = (square.grid.size / coarse.size) ** 3
    how = (
        f"One decomposition. LAPACK: time on {small} x {small} nodes, times the cube of the ratio of nodes. Heights of "
        "samples are sums of these modes in both and count with the solves; strips are embedded in both."
    )
    return Stage("surface", "decompositions of the mesh measured", Work(1, ours), Work(units, plain), how)


def count_surfaces(rows: Sequence[Row], kept: Path) -> dict[str, float]:
    """Return by number the surfaces that direct Monte Carlo needs for the error of the expansion.

    rows : of the budget. The error of the expansion combines its own estimate and its difference from the reference
        beyond the error of that
    kept : the Monte Carlo reference, whose standard errors give the variance of a surface with its four nodes
    """
    reference, counts = store.read(kept), {}
    surfaces = int(reference["surfaces"])
    probability = np.array([float(one) for one in reference["probability"]])
    left = {
        name: float(reference[f"{name}_standard_error"][MEDIAN] / reference[name][MEDIAN])
        for name in ("contact_probability", "mean_pressure")
    }
    for name, judged in zip(QUANTILES, JUDGED, strict=True):
        place = MEDIAN, int(np.argmin(np.abs(probability - judged)))
        left[name] = float(reference["quantile_standard_error"][place] / reference["quantile"][place])
    for name, error in left.items():
        by_source = {row["method"]: row for row in rows if fields(row["case"])["number"] == name}
        off, sampling = by_source["expansion"], by_source["sampling"]
        missed = max(0.0, off["error"] ** 2 - off["standard_error"] ** 2)
        counts[name] = samples_for(math.sqrt(sampling["error"] ** 2 + missed), surfaces, error)
    return counts


def square_stage(square: Square, rows: Sequence[Row], kept: Path, surfaces: int) -> Stage:
    """Compare the expansion of few surfaces with direct Monte Carlo of many, for the pressure at the centre."""
    tolerance = square.scene.numerics.contact_tolerance
    xi, plane = square.design("monte_carlo", surfaces, 1), square.planes[MEDIAN]
    modulus = elastic.material(square.scene).plane_strain_modulus_pa

    def interference(one: np.ndarray) -> np.ndarray:
        return square.surface(one) - plane

    plain = chain_plain.PlainContact.of(square.grid, interference(xi[0]), tolerance)
    solve(square.influence, interference(xi[0]), tolerance)
    ours_each = mean_cpu_seconds(lambda o=one: solve(square.influence, interference(o), tolerance) for one in xi)
    plain_each = mean_cpu_seconds(lambda o=one: plain.solve(square.grid, interference(o), modulus) for one in xi)
    counts = count_surfaces(rows, kept)
    fit_seconds = next(row["fit_seconds"] for row in rows if row["method"] == "sampling")
    how = (
        "Ours: surfaces of the scene's expansion, its fit and draws. Plain: surfaces of direct Monte Carlo with all "
        "four central nodes. The variance of a surface is from the kept reference. Our error is from the budget: the "
        "expansion's own estimate and its difference from the reference, of one design. Median of the numbers."
    )
    ours = Work(square.scene.expansion.samples, ours_each, fit_seconds)
    needed = Work(statistics.median(counts.values()), plain_each)
    return Stage("contact_square", "solves, surface included", ours, needed, how, counts)


def count_strips(
    area: np.ndarray, force: np.ndarray, least: float, summary: Path, levels: Sequence[float]
) -> dict[str, float]:
    """Return by number the strips that direct solves need for the error of a run of the scene.

    area, force : (strips, levels, windows) [m2], [N] of a few strips, whose jackknife gives the variance of a strip
    summary : the kept summary.csv of the scene, whose intervals give our errors
    """
    strips = len(area)
    mu, valid = friction_coefficient(area, force, 1.0, least)

    def numbers(chosen: np.ndarray) -> dict[str, float]:
        found = {}
        for level, percentile in enumerate(levels):
            values = mu[chosen, level][valid[chosen, level]]
            found |= {f"mean_{percentile:g}": float(values.mean()), f"std_{percentile:g}": float(values.std())}
        return found

    whole = numbers(np.arange(strips))
    rows, counts = read_summary(summary), {}
    for name, change in compare_paired(strips, numbers, lambda _: whole).items():
        kind, percentile = name.split("_")
        value, low, high = (rows[float(percentile)][f"combined_{kind}{end}"] for end in ("", "_low", "_high"))
        counts[name] = samples_for((high - low) / (2 * NORMAL * value), strips, change.error)
    return counts


def strip_stage(scene: Scene, kept: Path, sample: int) -> Stage:
    """Compare sweeps of few strips, with an expansion as control variate, with cold solves of many.

    kept : the folder of the scene's kept results
    """
    levels, tolerance = scene.strip.penetration_percentiles, scene.numerics.contact_tolerance
    grid, model = geometry.strip_grid(scene), surface_model.surface_model(scene)
    draw = model.sampler(grid)
    generators = [np.random.default_rng([scene.seed, STREAM, number]) for number in range(sample + 1)]
    solve_windows(scene, [draw(generators.pop())], levels, tolerance)  # compiles
    start = time.process_time()
    drawn = [draw(generator) for generator in generators]
    area, force = solve_windows(scene, drawn, levels, tolerance)
    ours_each = (time.process_time() - start) / sample
    rough, modulus = model.heights(drawn[0]), elastic.material(scene).plane_strain_modulus_pa
    planes = [float(plane) for plane in model.plane_height(np.array([levels[0], 50.0, levels[-1]], dtype=float))]
    plain = chain_plain.PlainContact.of(grid, rough - planes[1], tolerance)
    plain_each = mean_cpu_seconds(lambda at=plane: plain.solve(grid, rough - at, modulus) for plane in planes)
    least = scene.friction.least_contact_fraction * scene.strip.window_m * scene.strip.width_m
    counts = count_strips(area, force, least, kept / "summary.csv", levels)
    cpu = {row["stage"]: row["cpu_seconds"] for row in store.read_json(kept / "costs.json")}
    share = (cpu["chaos_strip"] + cpu["expansion_strip"]) / cpu["contact_strip"]
    strips = scene.strip.samples
    how = (
        f"Ours: strips of the scene, swept over {len(levels)} penetrations, and fit and expansion of "
        f"{scene.strip.expansion_samples} strips: {share:.2f} of the solves by the CPU seconds of the kept "
        "costs.json. Plain: strips of direct solves, each penetration from a cold start, mean over "
        f"{len(planes)} of them on one strip. The variance of a strip is from a jackknife of {sample} solved strips, "
        f"known to {np.sqrt(2 / (sample - 1)):.0%}; our errors are from the intervals in the kept summary.csv. Median "
        "of the numbers."
    )
    ours = Work(strips, ours_each, share * strips * ours_each)
    needed = Work(statistics.median(counts.values()), plain_each * len(levels))
    return Stage("contact_strip", "strips", ours, needed, how, counts)


def oscillator_stage(scene: Scene, summary: Path, paths: int, plain_periods: float) -> Stage:
    """Compare compiled motions of the ensemble with scipy's on the same paths, at the error of a slip."""
    friction, _ = read_friction(summary)
    marginal = BetaDistribution.of_moments(friction.a, friction.b, 0.0, friction.std)
    ensemble, nodes = scene.ensemble, scene.ensemble.nodes_per_correlation_length
    drawn = recursion(FrictionProcess(marginal, friction.length_m), friction.length_m / nodes)
    belt, mean = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, friction.mean)
    options, periods = mass_on_belt.motion_options(scene), float(ensemble.duration_periods)

    def run(number: int, duration: float) -> int:
        path = KeptPath(drawn.realisation([scene.seed, STREAM, number]))
        return ensemble_counts(belt, mean, path, drawn.spacing, duration, DAMPING, options).evaluations

    run(0, 1.0)  # compiles
    start = time.process_time()
    evaluations = sum(run(number, periods) for number in range(paths))
    run_periods = paths * len(DAMPING) * periods
    ours_each = (time.process_time() - start) / run_periods
    tolerance, our_error, plain_error = chain_plain.find_equal_tolerance(options.tolerance, nodes)
    length = int(np.ceil(mass_on_belt.path_length(belt, plain_periods) / drawn.spacing)) + 2
    whole = next(iter(drawn.realisation([scene.seed, STREAM, 0], length)))

    def plain(asked: float) -> tuple[float, float]:
        """Return seconds and evaluations of a natural period, from where a mass departs."""
        begun, count = time.process_time(), 0
        for one in (replace(belt, damping_ratio=damping) for damping in DAMPING):
            departs = one.F * mean.static - 2 * one.damping_ratio * one.V
            moved = chain_plain.simulate(one, mean, whole, drawn.spacing, plain_periods, asked, departs)
            count += moved.evaluations
        run_by_scipy = len(DAMPING) * plain_periods
        return (time.process_time() - begun) / run_by_scipy, count / run_by_scipy

    plain_each, plain_count = plain(tolerance)
    asked_each, asked_count = plain(options.tolerance)
    units = ensemble.realisations * len(ensemble.damping_ratios) * periods
    dampings = ", ".join(f"{damping:g}" for damping in DAMPING)
    how = (
        "Both: realisations x damping ratios x duration, without variance reduction, paths by recursion. Measured at "
        f"D = {dampings}: ours over {paths} paths, scipy's {chain_plain.METHOD} over {plain_periods:g} natural periods "
        f"of one. At scipy's tolerance {tolerance:g} the error of a slip on a path is {plain_error:.1e}, ours "
        f"{our_error:.1e}. Evaluations a period: ours {evaluations / run_periods:.0f}, plain {plain_count:.0f}, at our "
        f"tolerance {options.tolerance:g} {asked_count:.0f}; the rest of the ratio is compiled code."
    )
    works = (Work(units, each) for each in (ours_each, plain_each, asked_each))
    ours, needed, as_asked = works
    return Stage("oscillator", "natural periods", ours, needed, how, as_asked=as_asked)


def measure_stages(name: str, scene: Scene, rows: Sequence[Row], kept: Path, sizes: Sizes) -> list[Stage]:
    """Return every stage of a scene.

    rows : of the budget of its square
    kept : the folder of the scene's kept results
    """
    square = Square.of(name)
    found = [surface_stage(square), square_stage(square, rows, kept / "pressure.nc", sizes.surfaces)]
    report_progress(f"{name}: cost of surfaces and square")
    found.append(strip_stage(scene, kept, sizes.strips))
    report_progress(f"{name}: cost of strips")
    found.append(oscillator_stage(scene, kept / "summary.csv", sizes.paths, sizes.periods))
    report_progress(f"{name}: cost of the oscillator")
    return found
