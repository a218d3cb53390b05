"""Stage strip_allocation: as many strips as accuracy and verdicts on friction take, from the pilot strips.

Where the accuracy leaves verdicts undecided, strips are added as far as `accuracy.verdict_limit_cpu_s` allows.

Costs are counted by a model, work times cells, and not by a clock, so that any machine finds the same numbers.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.allocation import (
    Allocation,
    ErrorSources,
    Option,
    SampleLimits,
    cheapest,
    error_sources,
    mesh_alone,
    nearest,
)
from roughslip.friction.level import Level, levels_of_sums
from roughslip.friction.over_penetration import judged_estimates
from roughslip.limits import MOST_WINDOWS, SHARES
from roughslip.scene.declarations import Stage
from roughslip.scene.expansion import AUTO
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.strip_contact import COARSE
from roughslip.stages.from_scene.strip_expansion import expand_strips
from roughslip.stages.runtime.command import Job, execute
from roughslip.verdicts.bounds import Bound
from roughslip.verdicts.strips import ODDS, strips_from_pilot

STAGE = Stage(
    name="strip_allocation",
    reads="seed material roughness strip expansion.degree expansion.target "
    "accuracy.friction_mean accuracy.friction_std accuracy.cost_limit_cpu_s accuracy.verdict_limit_cpu_s",
    reads_if_given="friction.least_contact_fraction",
    inputs={"pilot": "strip_pilot", "expansion": "chaos_strip"},
    optional={"scan": "scan"},
    result="friction/allocation.nc",
    runs_if="accuracy.friction_mean",
    memory_mb=520,
    memory_doubles={"cells": 150, "windows": 8000, "levels cells": 8},
)

REPLICATES = 200  # of the pilot, for verdicts
MORE = 200  # strips of the expansion that are not of the pilot: its variance is then known to a tenth
OTHERS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32)  # strips on cells 2h alone, for each solved strip
COARSE_SHARE = 0.25  # of the CPU time of a solved strip, which has both meshes
# CPU time by work, measured on resolved at eleven penetrations and on strips of a twentieth of its cells; another
# machine is faster or slower at all
CONVOLUTION_S, STEP_S = 2.2e-8, 1.2e-4  # of a unit of work of the solver, by cell, and on any mesh
EXPANSION_S = 4.5e-7  # of a strip of the expansion, by node of its lattice


def work(job: Job) -> None:
    """Write the numbers of strips, what they are expected to reach, and why. Raises IllPosedError if out of reach."""
    scene = job.scene
    percentiles = np.array(scene.strip.penetration_percentiles, dtype=float)
    pilot = store.read(job.arguments.pilot)
    strips = len(pilot["area"])
    is_extrapolated = f"{COARSE}area" in pilot
    expanded = expand_strips(job, range(strips + MORE), strips)
    sums = [(pilot["area"], pilot["force"]), expanded]
    if is_extrapolated:
        sums.append((pilot[f"{COARSE}area"], pilot[f"{COARSE}force"]))
    by_level = ((area.transpose(1, 0, 2), force.transpose(1, 0, 2)) for area, force in sums)
    levels = levels_of_sums(geometry.least_contact_area(scene), *by_level)
    with job.usage.core():
        options = [
            Option(others, error_sources(percentiles, levels, others), _limits(job, pilot, others))
            for others in (OTHERS if is_extrapolated else OTHERS[:1])
        ]
        accuracy = scene.accuracy
        asked = {"friction_mean": accuracy.friction_mean, "friction_std": accuracy.friction_std}
        found = cheapest(options, asked)
        if found is None:
            raise IllPosedError(_refusal(options, asked, scene.strip.cell_m))
        limit = accuracy.verdict_limit_cpu_s if scene.strip.samples == AUTO else 0.0
        needed = _for_verdicts(job, levels) if limit else {}
        option, chosen = _with_verdicts(options, asked, found, needed, limit, 1 + MORE / strips)
    errors = option.errors
    coarse_strips = (1 + option.others) * chosen.strips if is_extrapolated else 0
    shown = {f"{name}_asked": value for name, value in asked.items()}
    for name in asked:
        of_it = [one for one in errors if one.statistic == name]
        widths = [one.half_width(chosen.strips, chosen.many, safe=False) for one in of_it]
        shown |= {f"{name}_expected": round(max(widths, default=0.0), 5)}
        shown |= {f"{name}_from_cells": round(max(map(mesh_alone, of_it), default=0.0), 5)}
    numbers = {"strips_chosen": chosen.strips, "coarse_strips_chosen": coarse_strips}
    job.usage.count(**numbers, expansion_strips_chosen=chosen.many, **shown)
    of_accuracy = found[1].strips
    if needed:
        job.usage.count(strips_for_accuracy=of_accuracy)
    for name, number in needed.items():
        if number > of_accuracy:
            place = "to_decide" if number <= chosen.strips else "beyond_limit_for"
            job.usage.count(**{f"strips_{place}_{name}": number})
    variables = _variables(errors, asked, chosen, coarse_strips) | _of_verdicts(of_accuracy, needed)
    store.write(job.arguments.output, variables, job.key)


def _for_verdicts(job: Job, levels: Sequence[Level]) -> dict[str, int]:
    """By statement the strips that settle it, as the rules judge what the pilot leaves possible."""
    strip = job.scene.strip
    percentiles = np.array(strip.penetration_percentiles, dtype=float)
    rng = np.random.default_rng([job.scene.seed, geometry.STREAM_BOOTSTRAP, 1])
    lags = strip.window_spacing_m * np.arange(levels[0].mu.shape[2])
    try:
        estimates = judged_estimates(percentiles, levels, lags, strip.window_m, REPLICATES, rng)
    except IllPosedError as error:
        job.usage.warn(f"no strips are added for verdicts, raise strip.training_samples: {error}")
        return {}
    rules = {name: [Bound(*bound) for bound in bounds] for name, bounds in job.key.given["bounds"].items()}
    return strips_from_pilot(estimates, percentiles, levels[0].strips, rules)


def _with_verdicts(
    options: list[Option],
    asked: dict[str, float],
    found: tuple[Option, Allocation],
    needed: dict[str, int],
    limit: float,
    ratio: float,
) -> tuple[Option, Allocation]:
    """Strips for what is asked and for as many verdicts as cost at most `limit` [s] in all; else as found without them.

    needed : by statement; ratio : strips of the control for each of these
    """
    for number in sorted({one for one in needed.values() if one > found[1].strips}, reverse=True):
        more = []
        for option in options:
            (low, high), (least, most) = option.limits.strips, option.limits.many
            many = max(least, min(math.ceil(ratio * number), most)), most
            strips = max(low, number), high
            limits = replace(option.limits, strips=strips, many=many, limit=min(limit, option.limits.limit))
            more.append(replace(option, limits=limits))
        enough = cheapest(more, asked)
        if enough is not None:
            return enough
    return found


def _limits(job: Job, pilot: store.Result, others: int) -> SampleLimits:
    """Numbers of strips that may be chosen, with their costs; those given by hand are obeyed."""
    scene = job.scene
    grid, lattice, windows = geometry.strip_grid(scene), geometry.lattice(scene), geometry.windows(scene)
    most = MOST_WINDOWS // (windows.count * len(scene.strip.penetration_percentiles))
    strips, many = (
        (low, high) if number == AUTO else (int(number), int(number))
        for number, low, high in (
            (scene.strip.samples, len(pilot["area"]) + SHARES, most // (2 + 2 * others)),
            (scene.strip.expansion_samples, 1, most),
        )
    )
    cells = grid.nx * grid.ny * (5 / 8 if f"{COARSE}area" in pilot else 1)  # in the mean of both meshes
    units = float(pilot["work"].sum(axis=1).mean())
    solve = (CONVOLUTION_S * cells + STEP_S) * units * (1 + COARSE_SHARE * others)
    expand = EXPANSION_S * lattice.grid.nx * lattice.grid.ny
    return SampleLimits(strips, many, (solve, expand), scene.accuracy.cost_limit_cpu_s, 2 + 2 * others)


def _refusal(options: list[Option], asked: dict[str, float], cell_m: float) -> str:
    """What cannot be reached, what is nearest, and what to do."""
    wanted, reached = (
        ", ".join(f"{name} {value:g}" for name, value in each.items()) for each in (asked, nearest(options, asked))
    )
    at_any_cost = cheapest([replace(each, limits=replace(each.limits, limit=math.inf)) for each in options], asked)
    advice = "ask for that, widen strip.window_spacing_m, or leave the number of strips that you gave to auto"
    if at_any_cost is not None:
        advice = f"ask for that, or raise accuracy.cost_limit_cpu_s to {math.ceil(at_any_cost[1].cost)}"
    worst = max(options[0].errors, key=lambda one: mesh_alone(one) / asked[one.statistic])
    if mesh_alone(worst) >= asked[worst.statistic]:
        which = f"{worst.statistic} at {worst.percentile:g} %"
        advice = f"the mesh alone leaves {mesh_alone(worst):.2g} of {which}: take strip.cell_m = {cell_m / 2:g} or less"
    return f"an accuracy of {wanted} is not reached; nearest are {reached}; {advice}"


def _variables(
    errors: Sequence[ErrorSources], asked: dict[str, float], chosen: Allocation, coarse: int
) -> dict[str, store.Variable]:
    """The allocation, and a row for each number that it holds for; the last column says which of them decides."""
    limits = np.array([asked[one.statistic] for one in errors])
    bounds, expected = (
        np.array([one.half_width(chosen.strips, chosen.many, safe=safe) for one in errors]) for safe in (True, False)
    )
    columns = {
        "percentile": (np.array([one.percentile for one in errors]), "percent", "penetration"),
        "statistic": (np.array([one.statistic for one in errors]), "1", "number that the accuracy is asked of"),
        "asked": (limits, "1", "largest half width of the 95 % interval, relative to the number"),
        "bound": (bounds, "1", "half width, with a margin for what the pilot does not show"),
        "expected": (expected, "1", "half width without that margin"),
        "mesh": (np.array([mesh_alone(one) for one in errors]), "1", "part that no number of strips reduces"),
        "decides": ((bounds / limits == (bounds / limits).max()).astype(np.int8), "1", "whether it sets the numbers"),
    }
    variables = {name: store.Variable(("number",), *column) for name, column in columns.items()}
    scalars = {
        "strips": (chosen.strips, "1", "strips that are solved, the pilot among them"),
        "coarse_strips": (coarse, "1", "strips that are solved on cells of twice the edge, those above among them"),
        "expansion_strips": (chosen.many, "1", "strips of the expansion, the solved ones among them"),
        "cost": (round(chosen.cost, 3), "s", "CPU time of both, by the model of cost"),
    }
    return variables | {name: store.Variable((), *scalar) for name, scalar in scalars.items()}


def _of_verdicts(of_accuracy: int, needed: dict[str, int]) -> dict[str, store.Variable]:
    """Strips for the accuracy alone, and for each statement."""
    names, numbers = np.array(list(needed), dtype=str), np.array(list(needed.values()), dtype=np.int64)
    found = {"strips_for_accuracy": store.Variable((), of_accuracy, "1", "strips that the accuracy alone takes")}
    if not needed:
        return found
    return found | {
        "statement": store.Variable(("statement",), names, "1", "statement on friction"),
        "strips_needed": store.Variable(("statement",), numbers, "1", f"strips that settle it with odds {ODDS:.2f}"),
    }


if __name__ == "__main__":
    execute(STAGE, work)
