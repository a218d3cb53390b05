"""Stage strip_allocation: as many strips as an accuracy of friction takes, from the pilot strips.

Costs are counted by a model, work times cells, and not by a clock, so that any machine finds the same numbers.
"""

from collections.abc import Sequence

import numpy as np

from roughslip import store
from roughslip.friction.allocation import (
    STATISTICS,
    Allocation,
    ErrorSources,
    Option,
    SampleLimits,
    error_sources,
    mesh_alone,
    strip_pilot,
)
from roughslip.friction.level import Level, levels_of_sums
from roughslip.limits import MOST_WINDOWS, SHARES
from roughslip.probability.pilot import Accuracy
from roughslip.scene.declarations import Stage
from roughslip.scene.fields import unless_auto
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.strip_contact import COARSE
from roughslip.stages.from_scene.strip_expansion import expand_strips
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="strip_allocation",
    reads="seed material roughness strip expansion.degree expansion.target "
    "accuracy.friction_mean accuracy.friction_std accuracy.cost_limit_cpu_s",
    reads_if_given="friction.least_contact_fraction",
    inputs={"pilot": "strip_pilot", "expansion": "chaos_strip"},
    optional={"scan": "scan"},
    result="friction/allocation.nc",
    runs_if="accuracy.friction_mean",
    memory_mb=620,
)

MORE = 200  # strips of the expansion that are not of the pilot: its variance is then known to a tenth
OTHERS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32)  # strips on cells 2h alone, for each solved strip
COARSE_SHARE = 0.25  # of the CPU time of a solved strip, which has both meshes
# CPU time by work, measured on resolved at eleven penetrations and on strips of a twentieth of its cells; another
# machine is faster or slower at all
CONVOLUTION_S, STEP_S = 2.2e-8, 1.2e-4  # of a unit of work of the solver, by cell, and on any mesh
EXPANSION_S = 4.5e-7  # of a strip of the expansion, by node of its lattice


def work(job: Job) -> None:
    """Write the numbers of strips, what they are expected to reach, and why. Raises IllPosedError if out of reach."""
    scene, pilot = job.scene, store.read(job.arguments.pilot)
    asked = {name: getattr(scene.accuracy, name) for name in STATISTICS}
    levels = _levels(job, pilot)
    with job.usage.core():
        options = _options(job, pilot, levels)
        option, chosen = strip_pilot(options, asked, scene.strip.cell_m).numbers()
    coarse_strips = (1 + option.others) * chosen.strips if len(levels) > 2 else 0
    numbers = {"strips_chosen": chosen.strips, "coarse_strips_chosen": coarse_strips}
    job.usage.count(**numbers, expansion_strips_chosen=chosen.many, **_half_widths(option.errors, asked, chosen))
    variables = _variables(option.errors, asked, chosen, coarse_strips)
    store.write(job.arguments.output, variables, job.key)


def _levels(job: Job, pilot: store.Result) -> tuple[Level, ...]:
    """The pilot on its meshes, and the expansion on MORE strips than that."""
    strips = len(pilot["area"])
    sums = [(pilot["area"], pilot["force"]), expand_strips(job, range(strips + MORE), strips)]
    if f"{COARSE}area" in pilot:
        sums.append((pilot[f"{COARSE}area"], pilot[f"{COARSE}force"]))
    by_level = ((area.transpose(1, 0, 2), force.transpose(1, 0, 2)) for area, force in sums)
    return levels_of_sums(geometry.least_contact_area(job.scene), *by_level)


def _options(job: Job, pilot: store.Result, levels: Sequence[Level]) -> list[Option]:
    """Errors and limits with each of OTHERS; none are solved on cells 2h alone where these are not solved at all."""
    percentiles = np.array(job.scene.strip.penetration_percentiles, dtype=float)
    return [
        Option(others, error_sources(percentiles, levels, others), _limits(job, pilot, others))
        for others in (OTHERS if len(levels) > 2 else OTHERS[:1])
    ]


def _half_widths(errors: Sequence[ErrorSources], asked: Accuracy, chosen: Allocation) -> dict[str, float]:
    """By statistic the half width that is asked, the largest that is expected, and the largest of the mesh alone."""
    shown = {f"{name}_asked": width for name, width in asked.items()}
    for name in asked:
        sources = [source for source in errors if source.statistic == name]
        widths = [source.half_width(chosen.strips, chosen.many, safe=False) for source in sources]
        shown[f"{name}_expected"] = round(max(widths, default=0.0), 5)
        shown[f"{name}_from_cells"] = round(max(map(mesh_alone, sources), default=0.0), 5)
    return shown


def _limits(job: Job, pilot: store.Result, others: int) -> SampleLimits:
    """Numbers of strips that may be chosen, with their costs; those given by hand are obeyed."""
    scene = job.scene
    grid, lattice, windows = geometry.strip_grid(scene), geometry.lattice(scene), geometry.windows(scene)
    maximum = MOST_WINDOWS // (windows.count * len(scene.strip.penetration_percentiles))
    strips, many = (
        (lowest, highest) if number is None else (int(number), int(number))
        for number, lowest, highest in (
            (unless_auto(scene.strip.samples), len(pilot["area"]) + SHARES, maximum // (2 + 2 * others)),
            (unless_auto(scene.strip.expansion_samples), 1, maximum),
        )
    )
    cells = grid.nx * grid.ny * (5 / 8 if f"{COARSE}area" in pilot else 1)  # in the mean of both meshes
    units = float(pilot["work"].sum(axis=1).mean())
    solve = (CONVOLUTION_S * cells + STEP_S) * units * (1 + COARSE_SHARE * others)
    expand = EXPANSION_S * lattice.grid.nx * lattice.grid.ny
    return SampleLimits(strips, many, (solve, expand), scene.accuracy.cost_limit_cpu_s, 2 + 2 * others)


def _variables(
    errors: Sequence[ErrorSources], asked: Accuracy, chosen: Allocation, coarse: int
) -> dict[str, store.Variable]:
    """The allocation, and a row for each number that it holds for; the last column says which of them decides."""
    limits = np.array([asked[source.statistic] for source in errors])
    bounds, expected = (
        np.array([source.half_width(chosen.strips, chosen.many, safe=safe) for source in errors])
        for safe in (True, False)
    )
    columns = {
        "percentile": (np.array([source.percentile for source in errors]), "percent", "penetration"),
        "statistic": (np.array([source.statistic for source in errors]), "1", "number that the accuracy is asked of"),
        "asked": (limits, "1", "largest half width of the 95 % interval, relative to the number"),
        "bound": (bounds, "1", "half width, with a margin for what the pilot does not show"),
        "expected": (expected, "1", "half width without that margin"),
        "mesh": (np.array([mesh_alone(source) for source in errors]), "1", "part that no number of strips reduces"),
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
