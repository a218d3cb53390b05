"""The stages of the chain measured, our way and the plain one: surfaces, square, strips, oscillator."""

from __future__ import annotations

import csv
import time
from collections.abc import Sequence
from dataclasses import replace
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
from roughslip.stages.from_scene import elastic, geometry, mass_on_belt, surface_model
from roughslip.surface.karhunen_loeve import karhunen_loeve
from workflow.benchmarks import chain_plain
from workflow.benchmarks.chain_cost import Stage, Work, median_count, samples_for
from workflow.benchmarks.chain_oscillator import DAMPING, told
from workflow.benchmarks.chain_problem import jackknifed
from workflow.benchmarks.chain_square import LEVEL
from workflow.benchmarks.chaos_problem import JUDGED, QUANTILES, Square
from workflow.benchmarks.measure import Row, fields, say
from workflow.benchmarks.surface_peers import dense_modes
from workflow.references.friction_solves import windows

STREAM = 30  # the second entry of every seed
DENSE_NODES = 32  # along an edge: the largest mesh on which LAPACK takes part
NORMAL = 1.96


class Sample(NamedTuple):
    """What is run for the measurement: surfaces, strips, paths of ours, and natural periods by scipy."""

    surface_model: int = 100
    strips: int = 16
    paths: int = 4
    periods: float = 2.0


USUAL = Sample()


def surface_stage(square: Square) -> Stage:
    """Modes of the square: ours by symmetry and Lanczos, plain by LAPACK on the whole covariance matrix."""
    order, small = len(square.modes), min(square.grid.nx, DENSE_NODES)
    coarse = geometry.square_grid({"square": square.configuration["square"] | {"nodes": small}})
    covariance = square.model.covariance
    ours = chain_plain.seconds_each([lambda: karhunen_loeve(covariance, square.grid, order)])
    plain = chain_plain.seconds_each([lambda: dense_modes(covariance, coarse, min(order, coarse.size))])
    units = (square.grid.size / coarse.size) ** 3
    how = (
        f"one decomposition; LAPACK's time on {small} x {small} nodes, times the cube of the ratio of nodes. Heights "
        "of samples are sums of these modes in both and count with the solves; strips are embedded in both."
    )
    return Stage("surface", "decompositions of the mesh measured", Work(1, ours), Work(units, plain), how)


def square_counts(rows: Sequence[Row], kept: Path) -> dict[str, float]:
    """Surfaces of direct Monte Carlo by number, at the error of the expansion.

    rows : of the budget; the expansion's error is what it tells itself and what it is off the reference beyond the
        error of that
    kept : the reference, whose standard errors and surfaces give the variance of a surface with its four nodes
    """
    reference, counts = store.read(kept), {}
    surfaces_ = int(reference["surfaces"])
    probability = [float(one) for one in reference["probability"]]
    left = {
        name: float(reference[f"{name}_standard_error"][LEVEL] / reference[name][LEVEL])
        for name in ("contact_probability", "mean_pressure")
    }
    for name, judged in zip(QUANTILES, JUDGED, strict=True):
        place = LEVEL, int(np.argmin(np.abs(np.array(probability) - judged)))
        left[name] = float(reference["quantile_standard_error"][place] / reference["quantile"][place])
    for name, error in left.items():
        by_source = {row["method"]: row for row in rows if fields(row["case"])["number"] == name}
        off, sampling = by_source["expansion"], by_source["sampling"]
        missed = max(0.0, off["error"] ** 2 - off["standard_error"] ** 2)
        counts[name] = samples_for(float(np.sqrt(sampling["error"] ** 2 + missed)), surfaces_, error)
    return counts


def square_stage(square: Square, rows: Sequence[Row], kept: Path, sample: int) -> Stage:
    """Pressure at the centre: an expansion of few surfaces, or direct Monte Carlo of many."""
    terms, tolerance = square.configuration["expansion"], square.configuration["numerics"]["contact_tolerance"]
    xi, plane = square.design("monte_carlo", sample, 1), square.planes[LEVEL]
    modulus = elastic.material(square.configuration).plane_strain_modulus_pa
    plain = chain_plain.PlainContact.of(square.grid, square.surface(xi[0]) - plane, tolerance)
    solve(square.influence, square.surface(xi[0]) - plane, tolerance)
    ours_each = chain_plain.seconds_each(
        [lambda one=one: solve(square.influence, square.surface(one) - plane, tolerance) for one in xi]
    )
    plain_each = chain_plain.seconds_each(
        [lambda one=one: plain.solve(square.grid, square.surface(one) - plane, modulus) for one in xi]
    )
    counts = square_counts(rows, kept)
    besides = next(row["fit_seconds"] for row in rows if row["method"] == "sampling")
    how = (
        "ours: surfaces that the expansion of the scene takes, its fit and draws besides. Plain: surfaces of direct "
        "Monte Carlo with all four central nodes; variance of a surface from the kept reference, our error from the "
        "budget: what the expansion tells of itself and what it misses the reference by, of one design. Median of "
        "numbers."
    )
    name, unit = "contact_square", "solves, surface included"
    return Stage(
        name, unit, Work(terms["samples"], ours_each, besides), Work(median_count(counts), plain_each), how, counts
    )


def strip_counts(area: np.ndarray, force: np.ndarray, least: float, summary: Path, levels: Sequence[float]) -> dict:
    """Strips of direct solves by number, at the error of the solved strips with the expansion as control.

    area, force : (strips, levels, windows) [m2], [N] of a few strips, whose jackknife gives the variance of a strip
    summary : the summary.csv that is kept of the scene, whose intervals tell our errors
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
    left = jackknifed(strips, numbers, lambda _: whole)
    with summary.open(encoding="utf-8") as table:
        rows = {float(line["percentile"]): line for line in csv.DictReader(table)}
    counts = {}
    for name, change in left.items():
        kind, percentile = name.split("_")
        value, low, high = (float(rows[float(percentile)][f"combined_{kind}{end}"]) for end in ("", "_low", "_high"))
        counts[name] = samples_for((high - low) / (2 * NORMAL * value), strips, change.error)
    return counts


def strip_stage(scene: dict[str, Any], summary: Path, costs: Path, sample: int, plain_levels: Sequence[float]) -> Stage:
    """Friction of windows: sweeps of few strips with an expansion as control, or cold solves of many."""
    levels, tolerance = scene["strip"]["penetration_percentiles"], scene["numerics"]["contact_tolerance"]
    grid, model = geometry.strip_grid(scene), surface_model.surface_model(scene)
    draw = model.sampler(grid)
    generators = [np.random.default_rng([scene["seed"], STREAM, number]) for number in range(sample + 1)]
    windows(scene, [draw(generators.pop())], levels, tolerance)  # what is compiled and planned at the first
    start = time.process_time()
    drawn = [draw(generator) for generator in generators]
    area, force = windows(scene, drawn, levels, tolerance)
    ours_each = (time.process_time() - start) / sample
    rough, modulus = model.heights(drawn[0]), elastic.material(scene).plane_strain_modulus_pa
    planes = [float(plane) for plane in model.plane_height(np.array(plain_levels, dtype=float))]
    plain = chain_plain.PlainContact.of(grid, rough - planes[len(planes) // 2], tolerance)
    plain_each = chain_plain.seconds_each(
        [lambda plane=plane: plain.solve(grid, rough - plane, modulus) for plane in planes]
    )
    window_area = scene["strip"]["window_m"] * scene["strip"]["width_m"]
    least = scene["friction"]["least_contact_fraction"] * window_area
    counts = strip_counts(area, force, least, summary, levels)
    cpu = {row["stage"]: row["cpu_seconds"] for row in store.read_json(costs)}
    share = (cpu["chaos_strip"] + cpu["expansion_strip"]) / cpu["contact_strip"]
    strips = scene["strip"]["samples"]
    how = (
        f"ours: strips of the scene, swept over {len(levels)} penetrations; besides, fit and expansion "
        f"of {scene['strip']['expansion_samples']} strips, {share:.2f} of the solves by the CPU seconds of the "
        "kept costs.json. Plain: strips of direct solves, each penetration from a cold start, mean over "
        f"{len(planes)} of them on one strip; variance of a strip by a jackknife of {sample} solved here, which tells "
        f"it to {np.sqrt(2 / (sample - 1)):.0%}; our errors from the intervals in the kept summary.csv. Median "
        "of numbers."
    )
    ours = Work(strips, ours_each, share * strips * ours_each)
    return Stage("contact_strip", "strips", ours, Work(median_count(counts), plain_each * len(levels)), how, counts)


def oscillator_stage(scene: dict[str, Any], summary: Path, paths: int, plain_periods: float) -> Stage:
    """The ensemble: compiled motions, or scipy's on the same paths, at the error of a slip."""
    friction, _ = told(summary)
    law = BetaDistribution.of_moments(friction.a, friction.b, 0.0, friction.std)
    nodes, ensemble = scene["ensemble"]["nodes_per_correlation_length"], scene["ensemble"]
    drawn = recursion(FrictionProcess(law, friction.length_m), friction.length_m / nodes)
    belt, mean = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, friction.mean)
    options, periods = mass_on_belt.run_options(scene), float(ensemble["duration_periods"])

    def run(number: int, duration: float) -> int:
        path = KeptPath(drawn.realisation([scene["seed"], STREAM, number]))
        return ensemble_counts(belt, mean, path, drawn.spacing, duration, DAMPING, **options).evaluations

    run(0, 1.0)  # compiles
    start = time.process_time()
    evaluations = sum(run(number, periods) for number in range(paths))
    run_periods = paths * len(DAMPING) * periods
    ours_each = (time.process_time() - start) / run_periods
    tolerance, our_error, plain_error = chain_plain.tolerance_of_the_same_error(options["tolerance"], nodes)
    whole = next(iter(drawn.realisation([scene["seed"], STREAM, 0], _nodes(belt, plain_periods, drawn.spacing))))
    belts = [replace(belt, damping_ratio=damping) for damping in DAMPING]

    def plain(asked: float) -> tuple[float, float]:
        """Seconds and evaluations of a natural period, from where a mass departs."""
        begun, count = time.process_time(), 0
        for one in belts:
            departs = one.F * mean.static - 2 * one.damping_ratio * one.V
            count += chain_plain.motion(one, mean, whole, drawn.spacing, plain_periods, asked, departs).evaluations
        run = len(belts) * plain_periods
        return (time.process_time() - begun) / run, count / run

    plain_each, plain_taken = plain(tolerance)
    asked_each, asked_taken = plain(options["tolerance"])
    units = ensemble["realisations"] * len(ensemble["damping_ratios"]) * periods
    taken = evaluations / run_periods
    how = (
        "both: realisations x damping ratios x duration, no variance reduction in either, paths by recursion; at D = "
        f"{', '.join(f'{damping:g}' for damping in DAMPING)}, ours over {paths} paths, scipy's {chain_plain.METHOD} "
        f"over {plain_periods:g} natural periods of one, at its tolerance {tolerance:g}, where a slip on a path errs "
        f"by {plain_error:.1e} and ours by {our_error:.1e}. Evaluations a period: ours {taken:.0f}, plain "
        f"{plain_taken:.0f}, at the tolerance asked of ours, {options['tolerance']:g}, {asked_taken:.0f}; the rest is "
        "compiled code."
    )
    works = (Work(units, each) for each in (ours_each, plain_each, asked_each))
    ours_, plain_, as_asked = works
    return Stage("oscillator", "natural periods", ours_, plain_, how, as_asked=as_asked)


def _nodes(belt: Any, periods: float, spacing: float) -> int:
    return int(np.ceil(mass_on_belt.path_length(belt, periods) / spacing)) + 2


def stages(name: str, scene: dict[str, Any], rows: Sequence[Row], kept: Path, sample: Sample) -> list[Stage]:
    """Every stage of a scene.

    rows : of the budget of its square
    kept : the folder of what git keeps of the scene
    """
    square, summary = Square.of(name), kept / "summary.csv"
    levels = scene["strip"]["penetration_percentiles"]
    found = [surface_stage(square), square_stage(square, rows, kept / "pressure.nc", sample.surfaces)]
    say(f"{name}: cost of surfaces and square")
    found.append(strip_stage(scene, summary, kept / "costs.json", sample.strips, (levels[0], 50.0, levels[-1])))
    say(f"{name}: cost of strips")
    found.append(oscillator_stage(scene, summary, sample.paths, sample.periods))
    say(f"{name}: cost of the oscillator")
    return found
