"""Stage field_square: the pressure at every node of the square, expanded in all modes from surfaces of its own."""

import math

import numpy as np

from roughslip import store
from roughslip.chaos.field import FieldExpansion, draw_pressure, fit_field, mode_shares
from roughslip.chaos.sampling import monte_carlo
from roughslip.contact.edge import contact_shares
from roughslip.errors import InputError
from roughslip.grid import Grid
from roughslip.limits import FIELD_GROUPS, FIELD_NUMBERS, FIELD_SAMPLES
from roughslip.scene.declarations import Stage
from roughslip.scene.fields import unless_auto
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic, geometry
from roughslip.stages.from_scene.square import Square, solutions, square
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="field_square",
    reads="seed material roughness square.edge_m square.nodes square.penetration_percentile numerics.contact_tolerance "
    "numerics.contact_area expansion.samples expansion.variables",
    inputs={"surface": "karhunen_loeve"},
    optional={"scan": "scan"},
    result="chaos/field.nc",
    memory_mb=820,
)

SURFACES = 2048  # surfaces where the scene leaves their number open, and no fewer than SURPLUS a mode
SURPLUS = 4
DRAWN = 3  # fields at the variables of solved ones

STATISTICS = {
    "contact": ("1", "probability of contact"),
    "mean": ("Pa", "mean of the pressure"),
    "deviation": ("Pa", "standard deviation of the pressure"),
}


def surfaces_of(scene: Scene, modes: int) -> int:
    """Surfaces to solve. Raises InputError where they are too few for so many modes, or tables exceed the memory."""
    nodes = scene.square.nodes**2
    count = unless_auto(scene.expansion.samples) or max(SURFACES, SURPLUS * modes)
    if count - math.ceil(count / FIELD_GROUPS) <= modes + 1 or count < FIELD_SAMPLES:
        raise InputError(
            f"expansion.samples: {count} surfaces are too few for {modes} modes, a {FIELD_GROUPS}th of them left out: "
            f"take more, at least {FIELD_SAMPLES}"
        )
    if max(count, FIELD_GROUPS * modes) * nodes > FIELD_NUMBERS:
        raise InputError(
            f"expansion.samples: {count} surfaces, or {FIELD_GROUPS} times {modes} modes, times {nodes} nodes of the "
            f"square are more than {FIELD_NUMBERS} numbers (two tables, 1.5 GB of memory): fewer samples or nodes"
        )
    return count


def solved_fields(problem: Square, count: int, job: Job) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """xi : (K, M) of independent surfaces, and their state and contact : (K, nodes), as in `fit_field`."""
    seed = [job.scene.seed, geometry.STREAM_FIELD]
    xi = np.stack([monte_carlo([*seed, number], len(problem.modes)) for number in range(count)])
    state = np.empty((count, problem.grid.size))
    contact = np.empty(state.shape, np.float32) if elastic.counts_shares(job.scene) else None
    for row, solution in enumerate(solutions(problem, xi, count, job)):
        state[row] = np.where(solution.pressure > 0, solution.pressure, -solution.gap).ravel()
        if contact is not None:
            contact[row] = contact_shares(solution.pressure, problem.hardness_pa).ravel()
    return xi, state, contact


def work(job: Job) -> None:
    """Solve, expand, and write coefficients, maps with their errors, shares of the modes and some fields."""
    problem = square(job)
    count = surfaces_of(job.scene, len(problem.modes))
    with job.usage.core():
        xi, state, contact = solved_fields(problem, count, job)
        expansion = fit_field(xi, state, contact)
        asked = job.scene.expansion.variables
        shares = mode_shares(expansion, min(asked, len(problem.modes)))
        generator = np.random.default_rng([job.scene.seed, geometry.STREAM_FIELD_DRAWS])
        index = expansion.index[:DRAWN]
        drawn = draw_pressure(expansion, state, index, generator, np.arange(DRAWN))
        fields = {
            "solved": (np.maximum(state[:DRAWN], 0.0), "of the contact solve"),
            "expected": (expansion.expected_pressure(index), "expected of the same variables"),
            "drawn": (drawn, "drawn given the same variables"),
        }
    job.usage.count(nodes=problem.grid.size)
    results = maps(expansion, problem.grid) | coefficients(expansion, problem.grid)
    for name, (field, title) in fields.items():
        values = field.reshape(-1, *problem.grid.shape)
        results[f"{name}_pressure"] = store.Variable(("field", "x", "y"), values, "Pa", f"field of pressure {title}")
    for name, title in (("first", "alone"), ("total", "alone and with others")):
        title = f"share of the variance of the expected pressure, all nodes together, that a mode explains {title}"
        results[f"sobol_{name}"] = store.Variable(("mode",), getattr(shares, name), "1", title)
        error = getattr(shares, f"{name}_error")
        results[f"sobol_{name}_error"] = store.Variable(("mode",), error, "1", f"standard error of the {title}")
    title = "share of the variance of the expected pressure that as many leading modes explain as expansion.variables"
    leading = shares.leading.reshape(problem.grid.shape)
    results["leading_share"] = store.Variable(("x", "y"), leading, "1", title)
    store.write(job.arguments.output, results, job.key, {"surfaces": count})


def maps(expansion: FieldExpansion, grid: Grid) -> dict[str, store.Variable]:
    """Statistics at every node with their standard errors and gains."""
    variables = {name: store.Variable((name,), getattr(grid, name)(), "m", f"node along {name}") for name in "xy"}
    for name, (units, title) in STATISTICS.items():
        estimate = getattr(expansion, name)
        parts = {
            "": (estimate.value, units, title),
            "_error": (estimate.error, units, f"standard error of the {title}"),
            "_gain": (
                estimate.gain,
                "1",
                f"variance of the {title} from the solves alone, over that with the expansion",
            ),
        }
        for end, (values, unit, text) in parts.items():
            variables[name + end] = store.Variable(("x", "y"), values.reshape(grid.shape), unit, text)
    title = "share of the variance of the pressure that predictions of left-out surfaces miss"
    variables["missed"] = store.Variable(("x", "y"), expansion.missed.reshape(grid.shape), "1", title)
    return variables


def coefficients(expansion: FieldExpansion, grid: Grid) -> dict[str, store.Variable]:
    """What the expansion at every node is made of: its direction, and the link at the knots of the index."""
    direction = expansion.direction.reshape(-1, *grid.shape)
    contact, pressure = (values.reshape(-1, *grid.shape) for values in expansion.link.values[:2])
    knots, title, along = (
        ("knot", "x", "y"),
        "at the knots of the index",
        "direction in the modes that a node depends on",
    )
    return {
        "direction": store.Variable(("mode", "x", "y"), direction, "1", along),
        "knot": store.Variable(("knot",), expansion.link.knots, "1", "knots of the index, direction times variables"),
        "link_contact": store.Variable(knots, contact, "1", f"probability of contact {title}"),
        "link_pressure": store.Variable(knots, pressure, "Pa", f"expected pressure {title}"),
    }
