"""Stage strip_allocation: as many strips as the accuracy asked of friction takes, from the pilot strips.

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
    Choice,
    Option,
    Sources,
    cheapest,
    mesh_alone,
    nearest,
    sources,
)
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.limits import MOST_WINDOWS, SHARES
from roughslip.scene.declarations import Stage
from roughslip.scene.expansion import AUTO
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.strip_contact import COARSE
from roughslip.stages.from_scene.strip_expansion import expand_strips
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="strip_allocation",
    reads="seed material roughness strip expansion.degree expansion.target "
    "accuracy.friction_mean accuracy.friction_std accuracy.cost_limit_cpu_s",
    reads_if_given="friction.least_contact_fraction",
    inputs={"pilot": "strip_pilot", "expansion": "chaos_strip"},
    optional={"scan": "scan"},
    result="friction/allocation.nc",
    runs_if="accuracy.friction_mean",
    memory_mb=520,
    memory_doubles={"cells": 150, "windows": 8000, "levels cells": 8},
)

MORE = 200  # strips of the expansion that are not of the pilot: its variance is then known to a tenth
OTHERS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32)  # strips on cells 2h alone, for each solved strip
COARSE_SHARE = 0.25  # of the CPU time of a solved strip, which has both meshes
# CPU time by work, measured on resolved at eleven penetrations; another machine is faster or slower at both
CONVOLUTION_S = 2.6e-8  # of a unit of work of the solver, by cell
EXPANSION_S = 4.5e-7  # of a strip of the expansion, by node of its lattice


def work(job: Job) -> None:
    """Write the numbers of strips, what they are expected to reach, and why. Raises IllPosedError if out of reach."""
    scene = job.scene
    percentiles = np.array(scene.strip.penetration_percentiles, dtype=float)
    pilot = store.read(job.arguments.pilot)
    strips = len(pilot["area"])
    least = scene.friction.least_contact_fraction * scene.strip.window_m * scene.strip.width_m

    def by_level(area: np.ndarray, force: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        ratio = friction_coefficient(area.transpose(1, 0, 2), force.transpose(1, 0, 2), 1.0, least)
        return list(zip(*ratio, strict=True))

    control = by_level(*expand_strips(job, range(strips + MORE), strips))
    is_extrapolated = f"{COARSE}area" in pilot
    coarse = by_level(pilot[f"{COARSE}area"], pilot[f"{COARSE}force"]) if is_extrapolated else None
    solved = by_level(pilot["area"], pilot["force"])
    with job.usage.core():
        options = [
            Option(others, sources(percentiles, solved, control, coarse, others), _choice(job, pilot, others))
            for others in (OTHERS if is_extrapolated else OTHERS[:1])
        ]
        accuracy = scene.accuracy
        asked = {"friction_mean": accuracy.friction_mean, "friction_std": accuracy.friction_std}
        found = cheapest(options, asked)
        if found is None:
            raise IllPosedError(_refusal(options, asked, scene.strip.cell_m))
    (option, chosen), errors = found, found[0].errors
    coarse_strips = (1 + option.others) * chosen.strips if is_extrapolated else 0
    shown = {f"{name}_asked": value for name, value in asked.items()}
    for name in asked:
        of_it = [one for one in errors if one.statistic == name]
        widths = [one.half_width(chosen.strips, chosen.many, safe=False) for one in of_it]
        shown |= {f"{name}_expected": round(max(widths, default=0.0), 5)}
        shown |= {f"{name}_from_cells": round(max(map(mesh_alone, of_it), default=0.0), 5)}
    numbers = {"strips_chosen": chosen.strips, "coarse_strips_chosen": coarse_strips}
    job.usage.count(**numbers, expansion_strips_chosen=chosen.many, **shown)
    store.write(job.arguments.output, _variables(errors, asked, chosen, coarse_strips), job.key)


def _choice(job: Job, pilot: store.Result, others: int) -> Choice:
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
    solve = CONVOLUTION_S * cells * float(pilot["work"].sum(axis=1).mean()) * (1 + COARSE_SHARE * others)
    expand = EXPANSION_S * lattice.grid.nx * lattice.grid.ny
    return Choice(strips, many, (solve, expand), scene.accuracy.cost_limit_cpu_s, 2 + 2 * others)


def _refusal(options: list[Option], asked: dict[str, float], cell_m: float) -> str:
    """What cannot be reached, what is nearest, and what to do."""
    wanted, reached = (
        ", ".join(f"{name} {value:g}" for name, value in each.items()) for each in (asked, nearest(options, asked))
    )
    at_any_cost = cheapest([replace(one, choice=replace(one.choice, limit=math.inf)) for one in options], asked)
    advice = "ask for that, widen strip.window_spacing_m, or leave the number of strips that you gave to auto"
    if at_any_cost is not None:
        advice = f"ask for that, or raise accuracy.cost_limit_cpu_s to {math.ceil(at_any_cost[1].cost)}"
    worst = max(options[0].errors, key=lambda one: mesh_alone(one) / asked[one.statistic])
    if mesh_alone(worst) >= asked[worst.statistic]:
        which = f"{worst.statistic} at {worst.percentile:g} %"
        advice = f"the mesh alone leaves {mesh_alone(worst):.2g} of {which}: take strip.cell_m = {cell_m / 2:g} or less"
    return f"an accuracy of {wanted} is not reached; nearest are {reached}; {advice}"


def _variables(
    errors: Sequence[Sources], asked: dict[str, float], chosen: Allocation, coarse: int
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


if __name__ == "__main__":
    execute(STAGE, work)
