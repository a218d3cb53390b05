"""Stage chaos_square: distribution of the pressure at the centre, sampled and expanded (Figure 2)."""

import math
from collections.abc import Mapping

import numpy as np
from scipy.stats import ks_2samp

from roughslip import store
from roughslip.chaos.centre_distribution import (
    NOTHING,
    EdgeCorrection,
    Equation,
    Reference,
    Row,
    between,
    cumulative_given_contact,
    drawn_rows,
    expanded_rows,
    fit_equation,
    given_rows,
    quantile_levels,
    resolved_by_designs,
    sampled_rows,
)
from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.chaos.regression import Fit
from roughslip.errors import IllPosedError
from roughslip.limits import designs_of
from roughslip.probability.estimate import NORMAL_95, wilson_interval
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import elastic, expansion, geometry, surface_model
from roughslip.stages.from_scene.square import latin_hypercubes, training_design, variables_of
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="chaos_square",
    reads="seed material roughness square.edge_m square.nodes square.penetration_percentile "
    "square.latin_hypercube_samples numerics.contact_area expansion",
    inputs={"surface": "karhunen_loeve"},
    optional={"scan": "scan"},
    many={"contact": "contact_square"},
    result="chaos/square.nc",
    memory_mb=620,
)

EQUATIONS = ("equation_8", "equation_9")
METHODS = ("monte_carlo", "latin_hypercube", *EQUATIONS, "roughslip")
KNOWN = 20_000  # surfaces in contact at most, at which equations are evaluated
BINS = np.linspace(-4.0, 6.0, 51)  # of the first variable, which is the height of the centre where variables are local
ROWS = {
    "cumulative": "distribution given contact",
    "contact_probability": "probability of contact at the centre; that of an expansion has the scatter of its fit, not "
    "the truncation of its series, for interval",
    "distance_in_contact": "Kolmogorov distance given contact, of Latin hypercube from Monte Carlo and of an expansion "
    "from both",
    "tail_error": "largest |log10| of the ratio to these samples where they lie between tail_from and 0.1",
}
GIVEN = {
    "cumulative": "distribution at solved surfaces in contact, of the first design",
    "distance": "Kolmogorov distance to the solved samples in contact",
    "tail_error_of_design": "largest |log10| of the ratio to the Latin hypercube samples of the design that was "
    "fitted, from given_tail_from to 0.1",
}
FITS = {
    "condition_number": "condition number of the basis",
    "samples": "samples that entered the fit",
    "leave_one_out": "share of the variance of the target that predictions of left-out samples miss",
    "positive_share": "share of new draws at which the expansion is positive",
}


def work(job: Job) -> None:
    """Fit eqs. (8) and (9) and our expansion, sample them, and compare them with the solved samples."""
    batches, scene = store.read_all(job.arguments.contact), job.scene
    surface = store.read(job.arguments.surface)
    nodes, sampled = (samples_of(batches, design, "pressure") for design in ("monte_carlo", "latin_hypercube"))
    sampled, drawing = sampled[:, 0], [scene.seed, Stream.DRAWS]
    with job.usage.core():
        local, edges, directions = local_expansion(batches, surface["modes"], job)
        designs = [sampled[part] for part in designs_of(len(sampled))]
        variables = [xi @ directions.T for xi in latin_hypercubes(scene, directions.shape[1])]
        equations = fitted_equations(variables, designs, job)
        reference = Reference(nodes.ravel(), len(nodes), quantile_levels(nodes.ravel()))
        pooled = np.concatenate((nodes.ravel(), sampled))
        solved = Reference(pooled, len(nodes) + len(sampled), reference.levels)
        pressure = {"monte_carlo": nodes.ravel(), "latin_hypercube": sampled}
        rows = {
            "monte_carlo": sampled_rows(nodes.ravel(), len(nodes), reference),
            "latin_hypercube": sampled_rows(sampled, len(sampled), reference),
        }
        drawn = {name: equation.draw(drawing) for name, equation in equations.items()}
        for name in EQUATIONS:
            rows[name] = {"contact_probability": rows["latin_hypercube"]["contact_probability"]}
            if name in drawn:
                rows[name] |= drawn_rows(drawn[name], solved)
                pressure[name] = drawn[name][0]
        pressure["roughslip"] = edges.apply(local.draw(np.random.default_rng(drawing), scene.expansion.draws))
        rows["roughslip"] = expanded_rows(local, pressure["roughslip"], edges, drawing, solved)
        given = given_contact(equations, nodes, directions, designs, solved, scene.seed)
    fits = {name: equation.fits[0] for name, equation in equations.items()} | {"roughslip": local.fit}
    draws = scene.expansion.draws + sum(one.size for one in drawn.values())
    job.usage.count(fits=1 + len(local.without) + len(equations) * len(designs), draws=draws)
    job.usage.skip({skip_reasons.SYMMETRIC: skip_reasons.forbidden_terms(local.indices, scene.expansion.degree)})
    results = table(rows, pressure, solved) | quality(fits, pressure) | given
    title = "Kolmogorov distance of eqs. (8) and (9)"
    results |= store.with_interval("distance_between_variants", (), between(drawn), "1", title)
    results["captured_variance"] = surface.variable("captured_variance")
    store.write(job.arguments.output, results, job.key, {"target": local.target.kind, "variables": len(directions)})


def samples_of(batches: list[store.Result], design: str, name: str) -> np.ndarray:
    """One array of the batches of a design."""
    return store.join([batch for batch in batches if batch.attributes["design"] == design], name)


def local_expansion(
    batches: list[store.Result], modes: np.ndarray, job: Job
) -> tuple[LocalExpansion, EdgeCorrection, np.ndarray]:
    """Ours, fitted to the training nodes of its design, and the mesh error at edges, as the scene takes it off.

    Returns them, and the variables at the centre in terms of the modes : (variables, modes).
    """
    scene = job.scene
    model, grid = surface_model.gaussian_model(scene, job.arguments.scan), geometry.square_grid(scene)
    nodes = geometry.training_nodes(model.lengths_m, grid)
    directions, odd = expansion.directions(model, grid, modes, nodes, scene.expansion.variables)
    variables = np.einsum("km,nvm->knv", training_design(scene, len(modes)), directions)
    pressure, gap = (samples_of(batches, "expansion", quantity) for quantity in ("pressure", "gap"))
    samples = Samples(variables, nodes.distance2, pressure, gap, odd)
    local = fit_local(samples, scene.expansion.degree, expansion.target(scene, model, grid))
    points = samples_of(batches, "expansion", "point_pressure") if elastic.counts_shares(scene) else pressure
    return local, EdgeCorrection(pressure, points, samples.group), directions[0]


def fitted_equations(variables: list[np.ndarray], designs: list[np.ndarray], job: Job) -> dict[str, Equation]:
    """Eqs. (8) and (9) by name, fitted to each design. One that is ill-posed (K <= P) is left out with a warning."""
    equations, degree = {}, job.scene.expansion.degree
    for name in EQUATIONS:
        try:
            equations[name] = fit_equation(variables, designs, degree, logarithm=name == "equation_9")
        except IllPosedError as error:
            job.usage.warn(f"{name.replace('_', ' ')}, {error}; its distribution is stored as NaN")
    return equations


def given_contact(
    equations: Mapping[str, Equation],
    nodes: np.ndarray,
    directions: np.ndarray,
    designs: list[np.ndarray],
    solved: Reference,
    seed: int,
) -> dict[str, store.Variable]:
    """The equations at Monte Carlo surfaces, no part of any fit, that their solves found in contact.

    nodes : (surfaces, nodes) [Pa] pressure of the Monte Carlo samples; directions : (variables, modes)
    """
    in_contact = np.flatnonzero(nodes[:, 0] > 0)[:KNOWN]
    known = np.array([directions @ variables_of(seed, int(n), directions.shape[1]) for n in in_contact])
    pressures = {name: equation.pressure(known) for name, equation in equations.items()}
    tail_from = resolved_by_designs(designs)
    rows = {name: given_rows(each, designs, solved, tail_from) for name, each in pressures.items()}
    variables = {"variant": store.Variable(("variant",), np.array(EQUATIONS), "1", "expansion at surfaces in contact")}
    for name, title in GIVEN.items():
        variables |= columns_of(rows, EQUATIONS, name, f"given_{name}", "variant", title, len(solved.levels))
    positive = [np.mean(pressures[name] > 0) if name in pressures else np.nan for name in EQUATIONS]
    title = "share of the surfaces in contact at which the expansion is positive"
    variables["given_positive_share"] = store.Variable(("variant",), positive, "1", title)
    apart = between(pressures, NORMAL_95 / 2 / math.sqrt(len(known)))
    text = "Kolmogorov distance of eqs. (8) and (9) at solved surfaces in contact"
    variables |= store.with_interval("given_between", (), apart, "1", text)
    contacts, curve = int(np.count_nonzero(designs[0])), cumulative_given_contact(designs[0], solved.levels)
    band = wilson_interval(curve * contacts, contacts)
    title = "distribution of the Latin hypercube samples of the first design"
    variables |= store.with_interval("design_cumulative", ("pressure",), (curve, *band), "1", title)
    density = np.histogram(known[:, 0], BINS)[0] / len(known) / np.diff(BINS)
    title = "density of the first variable of solved surfaces in contact"
    variables["first_variable"] = store.Variable(("variable_bin",), density, "1", title)
    variables["first_variable_edge"] = store.Variable(("variable_edge",), BINS, "1", "edges of its bins")
    title = "solved surfaces in contact that no fit has seen"
    variables["given_surfaces"] = store.Variable((), len(known), "1", title)
    title = "least of the low probabilities that are compared"
    variables["given_tail_from"] = store.Variable((), tail_from, "1", title)
    return variables


def table(
    rows: Mapping[str, Mapping[str, Row]], pressure: Mapping[str, np.ndarray], reference: Reference
) -> dict[str, store.Variable]:
    """A row a method: distribution, contact probability and distances, each with its interval."""
    each, truth = ("method",), pressure["monte_carlo"]
    distance = [ks_2samp(pressure[m], truth, method="asymp").statistic if m in pressure else np.nan for m in METHODS]
    minimum = "least of the low probabilities that the solved samples determine"
    variables = {
        "method": store.Variable(each, np.array(METHODS), "1", "how the distribution was found"),
        "pressure": store.Variable(("pressure",), reference.levels, "Pa", "contact pressure at the centre"),
        "distance": store.Variable(each, distance, "1", "Kolmogorov distance to Monte Carlo, all samples"),
        "tail_from": store.Variable((), reference.tail_from, "1", minimum),
    }
    for name, title in ROWS.items():
        variables |= columns_of(rows, METHODS, name, name, "method", title, len(reference.levels))
    return variables


def columns_of(
    rows: Mapping[str, Mapping[str, Row]],
    order: tuple[str, ...],
    row: str,
    name: str,
    along: str,
    title: str,
    levels: int,
) -> dict[str, store.Variable]:
    """A number of several methods or equations with its interval, in this order; NaN where a fit was refused."""
    is_curve = row == "cumulative"
    nothing = (np.full(levels, np.nan),) * 3 if is_curve else NOTHING
    columns = [np.array(part) for part in zip(*(rows.get(each, {}).get(row, nothing) for each in order), strict=True)]
    return store.with_interval(name, (along, "pressure") if is_curve else (along,), columns, "1", title)


def quality(fits: Mapping[str, Fit], pressure: Mapping[str, np.ndarray]) -> dict[str, store.Variable]:
    """Quality of the fit, a row for each expansion, of the first design; NaN where the fit was refused."""
    columns = {name: {method: getattr(fit, name, np.nan) for method, fit in fits.items()} for name in FITS}
    columns["positive_share"] = {method: np.mean(pressure[method] > 0) for method in fits}
    expanded = METHODS[2:]
    variables = {"fit": store.Variable(("fit",), np.array(expanded), "1", "expansion")}
    for name, column in columns.items():
        values = [float(column.get(method, np.nan)) for method in expanded]
        variables[f"fit_{name}"] = store.Variable(("fit",), values, "1", FITS[name])
    return variables
