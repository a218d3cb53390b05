"""Measure the whole chain: the error budget of every number in the figures, and the cost of the same error otherwise.

Figure 2: the pressure at the centre at median penetration. Figure 3: mean and standard deviation of mu at three
penetrations, in units of the mean at the median. Figure 5: cycles at three damping ratios.

`cost` compares the CPU time of the stages with that of textbook methods without what this project adds. The seconds of
a unit of work are measured on short samples and multiplied by the number of units; `how` states how it was counted:

    - Errors are standard errors. A plain mean over K independent samples has the error sigma / sqrt(K). For our error e
      it needs K = K' (s' / e)^2 samples, where K' samples leave the error s'. Of several numbers, the median of K
      counts.
    - Meshes, spacings and tolerances are those of the scene in both, and their errors are in both.
    - Neither includes what both need or what takes seconds: modes, statistics of windows, designs, limits of the cycle,
      figures, start-up, compilation. Our fits and expansions are included.
"""

from __future__ import annotations

import math
import statistics
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from roughslip import store
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.motion import ensemble_counts
from roughslip.oscillator.path import KeptPath
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry, mass_on_belt, surface_model
from workflow.benchmarks import chain_budget as budget
from workflow.benchmarks import oscillator
from workflow.benchmarks.chaos import KEPT_RESULTS, MEDIAN, MonteCarloReference, Square, read_references
from workflow.benchmarks.contact_peers import PolonskyKeer, tune
from workflow.benchmarks.contact_problem import Judge, Problem
from workflow.benchmarks.runner import report_progress, run_command
from workflow.evidence.rows import Row, fields
from workflow.monte_carlo.friction import solve_windows

METHOD = "RK45"  # solve_ivp's own choice
STREAM = 30  # the second entry of every seed


class Sizes(NamedTuple):
    """What is measured: scenes, the samples of the error budget, those of the cost, and natural periods by scipy."""

    scenes: tuple[str, ...] = ("paper", "resolved")
    surfaces: int = 2000
    strips: int = 40
    paths: int = 400
    cost_surfaces: int = 100
    cost_strips: int = 16
    cost_paths: int = 4
    plain_periods: float = 2.0


QUICK = Sizes(("paper",), 100, 4, 5, 20, 3, 1, 0.4)


def summarise(rows: Sequence[Row]) -> dict[str, dict[str, object]]:
    """Return for each number its value, its error from all sources, as if independent, and the largest source."""
    by_number: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_number[row["case"]].append(row)
    return {
        case: {
            "value": of_number[-1]["value"],
            "error": math.sqrt(sum(row["error"] ** 2 for row in of_number)),
            "largest": max(of_number, key=lambda row: row["error"])["method"],
        }
        for case, of_number in by_number.items()
    }


# The cost of a stage.


def work(units: float, seconds_each: float, other_seconds: float = 0.0) -> dict[str, float]:
    """Return units of work, the seconds of each, the seconds of all other work, and those of the whole stage."""
    found = {"units": float(units), "seconds_each": seconds_each, "other_seconds": other_seconds}
    return {**found, "seconds": units * seconds_each + other_seconds}


def stage_cost(
    stage: str,
    unit: str,
    ours: dict[str, float],
    plain: dict[str, float],
    how: str,
    as_asked: dict[str, float] | None = None,
) -> dict[str, Any]:
    """Return what the file holds of a stage. `as_asked` is the plain method at the scene's own tolerance."""
    return {
        "stage": stage,
        "unit": unit,
        "ours": ours,
        "plain": plain,
        "ratio": plain["seconds"] / ours["seconds"],
        "ratio_at_the_tolerance_asked": (as_asked or plain)["seconds"] / ours["seconds"],
        "how": how,
    }


def sum_stages(scene: str, stages: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the seconds of the whole chain by both methods, and their ratios."""
    ours, plain = (sum(stage[way]["seconds"] for stage in stages) for way in ("ours", "plain"))
    as_asked = sum(stage["ratio_at_the_tolerance_asked"] * stage["ours"]["seconds"] for stage in stages)
    ratios = {"ratio": plain / ours, "ratio_at_the_tolerance_asked": as_asked / ours}
    return {"scene": scene, "ours_seconds": ours, "plain_seconds": plain, **ratios}


def samples_for(error: float, samples: int, left: float) -> float:
    """Return how many samples have a mean of this error, if `samples` of them leave the error `left`."""
    return samples * (left / error) ** 2 if error > 0.0 else math.inf


def mean_cpu_seconds(call: Callable[[Any], object], arguments: Sequence[Any]) -> float:
    """Return the mean CPU seconds of a call."""
    start = time.process_time()
    for argument in arguments:
        call(argument)
    return (time.process_time() - start) / len(arguments)


def plain_contact(grid: Grid, interference: np.ndarray, tolerance: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return solves by conjugate gradients of Polonsky and Keer in numpy, each from a cold start.

    interference : (nx, ny) [m] a first problem, to which the solver is tuned
    """
    solver = PolonskyKeer(grid)
    setting = tune(solver, Problem(grid, interference, 0.0), 0.0, tolerance, 5 * tolerance, Judge(grid)).setting
    return lambda one: solver.solve(Problem(grid, one, 0.0), 0.0, setting)[0]


def count_surfaces(rows: Sequence[Row], reference: MonteCarloReference) -> dict[str, float]:
    """Return by number the surfaces that direct Monte Carlo needs for the error of the expansion.

    rows : of the budget. The error of the expansion combines its own estimate and its difference from the reference
        beyond the error of that
    """
    counts = {}
    for name, left in reference.plain_error.items():
        by_source = {row["method"]: row for row in rows if fields(row["case"])["number"] == name}
        off, sampling = by_source["expansion"], by_source["sampling"]
        missed = max(0.0, off["error"] ** 2 - off["standard_error"] ** 2)
        counts[name] = samples_for(math.sqrt(sampling["error"] ** 2 + missed), reference.surfaces, left)
    return counts


def square_cost(square: Square, rows: Sequence[Row], reference: MonteCarloReference, surfaces: int) -> dict[str, Any]:
    """Compare the expansion of few surfaces with direct Monte Carlo of many, for the pressure at the centre."""
    tolerance, plane = square.scene.numerics.contact_tolerance, square.planes[MEDIAN]
    xi = square.design("monte_carlo", surfaces, 1)
    plain = plain_contact(square.grid, square.surface(xi[0]) - plane, tolerance)
    solve(square.influence, square.surface(xi[0]) - plane, tolerance)  # compiles
    ours_each = mean_cpu_seconds(lambda one: solve(square.influence, square.surface(one) - plane, tolerance), xi)
    plain_each = mean_cpu_seconds(lambda one: plain(square.surface(one) - plane), xi)
    fit_seconds = next(row["fit_seconds"] for row in rows if "fit_seconds" in row)
    how = (
        "Ours: surfaces of the scene's expansion, its fit and draws. Plain: surfaces of direct Monte Carlo with four "
        "nodes each, whose variance is from the kept reference. Our error is from the budget. Median of the numbers."
    )
    ours = work(square.scene.expansion.samples, ours_each, fit_seconds)
    needed = work(statistics.median(count_surfaces(rows, reference).values()), plain_each)
    return stage_cost("contact_square", "solves, surface included", ours, needed, how)


def count_strips(
    scene: Scene, area: np.ndarray, force: np.ndarray, summary: Path, levels: Sequence[float]
) -> dict[str, float]:
    """Return by number the strips that direct solves need for the error of a run of the scene.

    area, force : (strips, levels, windows) [m2], [N] of a few strips, whose jackknife gives the variance of a strip
    summary : the kept summary.csv of the scene, whose intervals give our errors
    """
    numbers, rows, counts = budget.window_moments(scene, area, force, levels), budget.read_summary(summary), {}
    whole = numbers(np.arange(len(area)))
    for name, change in budget.compare_paired(len(area), numbers, lambda _: whole).items():
        _, kind, percentile = name.split("_")
        value, error = budget.read_number(rows[float(percentile)], f"combined_{kind}")
        counts[name] = samples_for(error / value, len(area), change.error)
    return counts


def strip_cost(scene: Scene, kept: Path, sample: int) -> dict[str, Any]:
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
    rough = model.heights(drawn[0])
    planes = [float(plane) for plane in model.plane_height(np.array([levels[0], 50.0, levels[-1]], dtype=float))]
    plain = plain_contact(grid, rough - planes[1], tolerance)
    plain_each = mean_cpu_seconds(lambda plane: plain(rough - plane), planes)
    counts = count_strips(scene, area, force, kept / "summary.csv", levels)
    cpu = {row["stage"]: row["cpu_seconds"] for row in store.read_json(kept / "costs.json")}
    share = (cpu["chaos_strip"] + cpu["expansion_strip"]) / cpu["contact_strip"]
    strips = scene.strip.samples
    how = (
        f"Ours: strips of the scene, swept over {len(levels)} penetrations, and fit and expansion of "
        f"{scene.strip.expansion_samples} strips: {share:.2f} of the solves by the kept costs.json. Plain: strips of "
        f"direct solves, each penetration from a cold start, mean over {len(planes)} of them. The variance of a strip "
        f"is from a jackknife of {sample} strips, known to {np.sqrt(2 / (sample - 1)):.0%}. Our errors are from the "
        "kept summary.csv. Median of the numbers."
    )
    ours = work(strips, ours_each, share * strips * ours_each)
    needed = work(statistics.median(counts.values()), plain_each * len(levels))
    return stage_cost("contact_strip", "strips", ours, needed, how)


class PlainMotion(NamedTuple):
    """A motion by scipy: cycles, evaluations of the right-hand side, and X [m] where the mass stuck again last."""

    cycles: int
    evaluations: int
    stuck_m: float


def simulate_plainly(
    belt: Oscillator, law: StribeckLaw, path: np.ndarray, spacing: float, periods: float, tolerance: float, x: float
) -> PlainMotion:
    """Simulate a motion by scipy from rest on the belt, without excitation.

    path : (nodes,) mu_S at the slipped distances 0, spacing, ...
    spacing : [m]
    x : [m] X at the start

    Stick lasts until the force reaches the static limit; slip is integrated until X' = V.
    """
    scatter, end = oscillator.interpolate(path, spacing), 2 * np.pi * periods
    tau, s, cycles, evaluations = 0.0, 0.0, 0, 0
    while True:
        stuck = x
        limit = belt.F * max(law.static + float(scatter(s)), 0.0) - 2 * belt.damping_ratio * belt.V
        tau, x = tau + max(limit - x, 0.0) / belt.V, max(limit, x)
        if tau + oscillator.OFF >= end:
            return PlainMotion(cycles, evaluations, stuck)
        found = oscillator.integrate_slip(belt, law, scatter, (tau, x, s), end, METHOD, tolerance)
        evaluations += found.nfev
        if not len(found.t_events[0]):
            return PlainMotion(cycles, evaluations, stuck)
        cycles += bool((found.y[1] < 0.0).any())
        tau, (x, _, s) = float(found.t_events[0][0]), found.y_events[0][0]


def find_equal_tolerance(tolerance: float, nodes: int) -> tuple[float, float, float]:
    """Return the loosest of TOLERANCES where scipy's error of a slip on a path is at most ours at our tolerance.

    Returns it, our error and scipy's.
    """
    slip = oscillator.choose_slips(nodes)[1]
    exact = oscillator.exact_place(slip)
    error = abs(oscillator.slip_by_roughslip(slip, "fehlberg45", tolerance)[0] / exact - 1.0)
    for one in oscillator.TOLERANCES:
        plain = abs(oscillator.slip_by_scipy(slip, METHOD, one)[0] / exact - 1.0)
        if plain <= error:
            break
    return one, error, plain


def oscillator_cost(scene: Scene, summary: Path, paths: int, plain_periods: float) -> dict[str, Any]:
    """Compare compiled motions of the ensemble with scipy's on the same paths, at the error of a slip.

    scipy's error control steps over the nodes of a path, where its error far exceeds its tolerance. One ratio is at the
    tolerance where a slip has our error, the other at the tolerance that the scene sets.
    """
    friction, _ = budget.read_friction(summary)
    ensemble, nodes = scene.ensemble, scene.ensemble.nodes_per_correlation_length
    drawn, options = friction.paths(nodes), mass_on_belt.motion_options(scene)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, friction.mean)
    periods = float(ensemble.duration_periods)

    def run(number: int, duration: float = periods) -> None:
        path = KeptPath(drawn.realisation([scene.seed, STREAM, number]))
        ensemble_counts(belt, law, path, drawn.spacing, duration, budget.DAMPING, options)

    run(0, 1.0)  # compiles
    ours_each = mean_cpu_seconds(run, range(paths)) / (len(budget.DAMPING) * periods)
    tolerance, our_error, plain_error = find_equal_tolerance(options.tolerance, nodes)
    length = int(np.ceil(mass_on_belt.path_length(belt, plain_periods) / drawn.spacing)) + 2
    whole = next(iter(drawn.realisation([scene.seed, STREAM, 0], length)))

    def plain_each(asked: float) -> float:
        """Return seconds of a natural period, from where a mass departs."""

        def run_plainly(damping: float) -> None:
            one = replace(belt, damping_ratio=damping)
            departs = one.F * law.static - 2 * one.damping_ratio * one.V
            simulate_plainly(one, law, whole, drawn.spacing, plain_periods, asked, departs)

        return mean_cpu_seconds(run_plainly, budget.DAMPING) / plain_periods

    units = ensemble.realisations * len(ensemble.damping_ratios) * periods
    how = (
        f"Both: realisations x damping ratios x duration. Measured at D in {budget.DAMPING}: ours over {paths} paths, "
        f"scipy's {METHOD} over {plain_periods:g} natural periods of one. At scipy's tolerance {tolerance:g} the error "
        f"of a slip on a path is {plain_error:.1e}, ours {our_error:.1e} at our tolerance {options.tolerance:g}."
    )
    plain, as_asked = work(units, plain_each(tolerance)), work(units, plain_each(options.tolerance))
    return stage_cost("oscillator", "natural periods", work(units, ours_each), plain, how, as_asked)


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary, the cost and the rows."""
    sizes = QUICK if quick else Sizes()
    rows: list[Row] = []
    cost: dict[str, list[dict[str, Any]]] = {"stages": [], "chain": []}
    for name in sizes.scenes:
        square, reference = Square(name), read_references(name)[MEDIAN]
        scene, kept = square.scene, KEPT_RESULTS / name
        of_expansion = list(budget.expansion_budget(square, reference))
        rows += budget.square_budget(square, sizes.surfaces)
        rows += of_expansion
        rows += budget.strip_budget(name, scene, sizes.strips)
        rows += budget.strip_sampling(name, kept / "summary.csv")
        rows += budget.oscillator_budget(name, scene, sizes.paths, kept / "summary.csv")
        stages = [square_cost(square, of_expansion, reference, sizes.cost_surfaces)]
        stages.append(strip_cost(scene, kept, sizes.cost_strips))
        stages.append(oscillator_cost(scene, kept / "summary.csv", sizes.cost_paths, sizes.plain_periods))
        cost["stages"] += [{"scene": name, **stage} for stage in stages]
        cost["chain"].append(sum_stages(name, stages))
        report_progress(f"{name}: cost {cost['chain'][-1]}")
    return {"summary": summarise(rows), "cost": cost, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure)
