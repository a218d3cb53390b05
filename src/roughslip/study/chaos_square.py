"""Stage chaos_square: distribution of the pressure at the centre, sampled and expanded (Figure 2)."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from roughslip import store
from roughslip.chaos.centre_distribution import (
    NOTHING,
    EdgeCorrection,
    Equation,
    Reference,
    Row,
    between,
    distance,
    drawn_rows,
    expanded_rows,
    fit_equation,
    from_equal_moments,
    given_rows,
    in_contact,
    quantile_levels,
    resolved_by_designs,
    sampled_rows,
    share_up_to,
)
from roughslip.chaos.local import LocalExpansion, SolvedSurfaces, fit_local
from roughslip.errors import IllPosedError
from roughslip.limits import FUNCTIONALS, designs_of
from roughslip.probability.estimate import NORMAL_95, wilson_interval
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream, elastic, expansion, geometry, surface_model
from roughslip.study.from_scene.geometry import latin_hypercubes, training_design, variables_of
from roughslip.study.job import Job

EQUATIONS = ("equation_8", "equation_9")
METHODS = ("monte_carlo", "latin_hypercube", *EQUATIONS, "roughslip")
EXPANDED = METHODS[2:]
OF_ROWS = ("cumulative", "contact_probability", "distance_in_contact", "tail_error")
KNOWN = 20_000  # surfaces in contact at most, at which equations are evaluated
DRAWS = 400_000  # from a fitted expansion; its distribution then errs by less than that of the samples
BY_METHOD, BY_VARIANT, BY_FIT = ("method",), ("variant",), ("fit",)
VARIABLES = {
    "method": (BY_METHOD, "how the distribution was found"),
    "distance": (BY_METHOD, "Kolmogorov distance to Monte Carlo, all samples"),
    "cumulative": ((*BY_METHOD, "pressure"), "distribution given contact"),
    "contact_probability": (
        BY_METHOD,
        "probability of contact at the centre; that of an expansion has the scatter of its fit, not the truncation of "
        "its series, for interval",
    ),
    "distance_in_contact": (
        BY_METHOD,
        "Kolmogorov distance given contact: hypercubes from Monte Carlo, others from both",
    ),
    "tail_error": (BY_METHOD, "largest |log10| of the ratio to these samples at low probabilities, up to 0.1"),
    "distance_to_normal": ((), "Kolmogorov distance of all samples in contact to the normal of equal moments"),
    "distance_to_uniform": ((), "Kolmogorov distance of all samples in contact to the uniform of equal moments"),
    "distance_between_variants": ((), "Kolmogorov distance of eqs. (8) and (9)"),
    "fit": (BY_FIT, "expansion"),
    "fit_condition_number": (BY_FIT, "condition number of the basis"),
    "fit_samples": (BY_FIT, "samples that entered the fit"),
    "fit_leave_one_out": (BY_FIT, "share of the variance of the target that predictions of left-out samples miss"),
    "fit_positive_share": (BY_FIT, "share of new draws at which the expansion is positive"),
    "variant": (BY_VARIANT, "expansion at surfaces in contact"),
    "given_cumulative": ((*BY_VARIANT, "pressure"), "distribution at solved surfaces in contact, of the first design"),
    "given_distance": (BY_VARIANT, "Kolmogorov distance to the solved samples in contact"),
    "given_tail_error_of_design": (
        BY_VARIANT,
        "largest |log10| of the ratio to the samples of the design that was fitted, from given_tail_from to 0.1",
    ),
    "given_positive_share": (BY_VARIANT, "share of the surfaces in contact at which the expansion is positive"),
    "given_between": ((), "Kolmogorov distance of eqs. (8) and (9) at solved surfaces in contact"),
    "given_surfaces": ((), "solved surfaces in contact that no fit has seen"),
    "given_tail_from": ((), "least of the low probabilities that are compared"),
    "design_cumulative": (("pressure",), "distribution of the Latin hypercube samples of the first design"),
}


def work(scene: Scene, job: Job) -> None:
    """Fit eqs. (8) and (9) and our expansion, sample them, and compare them with the solved samples."""
    batches = store.read_all(job.paths("contact"))
    surface = store.read(job.path("surface"))
    nodes, sampled = (samples_of(batches, design, "pressure") for design in ("monte_carlo", "latin_hypercube"))
    sampled, drawing = sampled[:, 0], [scene.seed, Stream.DRAWS]
    reference = Reference(nodes.ravel(), len(nodes), quantile_levels(nodes.ravel()))
    pooled = np.concatenate((nodes.ravel(), sampled))
    solved = Reference(pooled, len(nodes) + len(sampled), reference.levels)
    directions, local, *ours = local_expansion(batches, surface["modes"], solved, drawing, job)
    designs = [sampled[part] for part in designs_of(len(sampled))]
    variables = [xi @ directions.T for xi in latin_hypercubes(scene, directions.shape[1])]
    equations = fitted_equations(variables, designs, job) if len(directions) else {}
    pressure = {"monte_carlo": nodes.ravel(), "latin_hypercube": sampled}
    rows = {
        "monte_carlo": sampled_rows(nodes.ravel(), len(nodes), reference),
        "latin_hypercube": sampled_rows(sampled, len(sampled), reference),
    }
    drawn = {name: equation.draw(drawing) for name, equation in equations.items()}
    contacts = {name: [*map(in_contact, pressures)] for name, pressures in drawn.items()}
    for name in EQUATIONS:
        rows[name] = {"contact_probability": rows["latin_hypercube"]["contact_probability"]}
    for name, pressures in drawn.items():
        rows[name] |= drawn_rows(contacts[name], solved)
        pressure[name] = pressures[0]
    fits = {name: equation.fits[0] for name, equation in equations.items()}
    if local is not None:
        pressure["roughslip"], rows["roughslip"] = ours
        fits["roughslip"] = local.fit
    given = given_contact(equations, nodes, directions, designs, solved, scene.seed)
    draws = DRAWS + sum(one.size for one in drawn.values())
    job.count(fits=(1 + len(local.without) if local else 0) + len(equations) * len(designs), draws=draws)
    ascending = {name: np.sort(own) for name, own in pressure.items()}
    apart = {name: distance(own, ascending["monte_carlo"]) for name, own in ascending.items()}
    columns = {name: in_order(rows, METHODS, name, len(solved.levels)) for name in OF_ROWS}
    values: dict[str, Any] = columns | given | from_equal_moments(solved.in_contact)
    values |= {
        "method": np.array(METHODS),
        "distance": [apart.get(name, np.nan) for name in METHODS],
        "distance_between_variants": between(contacts),
        "fit": np.array(EXPANDED),
        "fit_positive_share": [np.mean(pressure[name] > 0) if name in pressure else np.nan for name in EXPANDED],
    }
    for name in ("condition_number", "samples", "leave_one_out"):
        values[f"fit_{name}"] = [float(getattr(fits.get(method), name, np.nan)) for method in EXPANDED]
    results = {"pressure": store.Variable(("pressure",), solved.levels, "Pa", "contact pressure at the centre")}
    for name, (dimensions, title) in VARIABLES.items():
        if isinstance(values[name], tuple):
            results |= store.with_interval(name, dimensions, values[name], "1", title)
        else:
            results[name] = store.Variable(dimensions, values[name], "1", title)
    results["captured_variance"] = surface.variable("captured_variance")
    store.write(job.output, results, job.key, {"target": scene.expansion.target, "variables": len(directions)})


def samples_of(batches: list[store.Result], design: str, name: str) -> np.ndarray:
    """One array of the batches of a design."""
    return store.join([batch for batch in batches if batch.attributes["design"] == design], name)


def local_expansion(
    batches: list[store.Result], modes: np.ndarray, solved: Reference, drawing: list[int], job: Job
) -> tuple[np.ndarray, LocalExpansion | None, Any, Any]:
    """Ours, fitted to the training nodes of its design, less the mesh error at edges, as the scene takes it off.

    Returns the variables at the centre in terms of the modes : (variables, modes), the expansion, pressures drawn from
    it, and its rows. What the samples do not determine is left out with a warning.
    """
    scene, centre = job.scene, np.empty((0, len(modes)))
    model, grid = surface_model.gaussian_model(scene, job.optional("scan")), geometry.square_grid(scene)
    nodes = geometry.training_nodes(model.lengths_m, grid)
    pressure, gap = (samples_of(batches, "expansion", quantity) for quantity in ("pressure", "gap"))
    points = samples_of(batches, "expansion", "point_pressure") if elastic.counts_shares(scene) else pressure
    try:
        directions, odd = expansion.directions(model, grid, modes, nodes, FUNCTIONALS)
        centre = directions[0]
        variables = np.einsum("km,nvm->knv", training_design(scene, len(modes)), directions)
        samples = SolvedSurfaces(variables, nodes.distance2, pressure, gap, odd)
        local = fit_local(samples, scene.expansion.degree, expansion.target(scene, model, grid))
        edges = EdgeCorrection(pressure, points, samples.group)
        drawn = edges.apply(local.draw(np.random.default_rng(drawing), DRAWS))
        return centre, local, drawn, expanded_rows(local, drawn, edges, drawing, solved)
    except IllPosedError as error:
        job.warn(f"the expansion of all samples, {error.in_scene}; its distribution is stored as NaN")
        return centre, None, None, None


def fitted_equations(variables: list[np.ndarray], designs: list[np.ndarray], job: Job) -> dict[str, Equation]:
    """Eqs. (8) and (9) by name, fitted to each design. One that is ill-posed (K <= P) is left out with a warning."""
    equations, degree = {}, job.scene.expansion.degree
    for name in EQUATIONS:
        try:
            equations[name] = fit_equation(variables, designs, degree, logarithm=name == "equation_9")
        except IllPosedError as error:
            job.warn(f"{name.replace('_', ' ')}, {error.in_scene}; its distribution is stored as NaN")
    return equations


def given_contact(
    equations: Mapping[str, Equation],
    nodes: np.ndarray,
    directions: np.ndarray,
    designs: list[np.ndarray],
    solved: Reference,
    seed: int,
) -> dict[str, Any]:
    """The equations at Monte Carlo surfaces, no part of any fit, that their solves found in contact.

    nodes : (surfaces, nodes) [Pa] pressure of the Monte Carlo samples; directions : (variables, modes)
    """
    numbers = np.flatnonzero(nodes[:, 0] > 0)[:KNOWN]
    known = variables_of(seed, numbers, directions.shape[1]) @ directions.T
    pressures = {name: equation.pressure(known) for name, equation in equations.items()}
    in_contacts = {name: [*map(in_contact, each)] for name, each in pressures.items()}
    tail_from = resolved_by_designs(designs)
    rows = {name: given_rows(each, len(known), designs, solved, tail_from) for name, each in in_contacts.items()}
    contacts, curve = int(np.count_nonzero(designs[0])), share_up_to(in_contact(designs[0]), solved.levels)
    values = {
        f"given_{name}": in_order(rows, EQUATIONS, name, len(solved.levels))
        for name in ("cumulative", "distance", "tail_error_of_design")
    }
    return values | {
        "variant": np.array(EQUATIONS),
        "given_positive_share": [np.mean(pressures[n] > 0) if n in pressures else np.nan for n in EQUATIONS],
        "given_between": between(in_contacts, NORMAL_95 / 2 / math.sqrt(len(known))),
        "given_surfaces": len(known),
        "given_tail_from": tail_from,
        "design_cumulative": (curve, *wilson_interval(curve * contacts, contacts)),
    }


def in_order(
    rows: Mapping[str, Mapping[str, Row]], order: tuple[str, ...], name: str, levels: int
) -> tuple[np.ndarray, ...]:
    """A number of several methods or equations, with the ends of its interval; NaN where a fit was refused."""
    nothing = (np.full(levels, np.nan),) * 3 if name == "cumulative" else NOTHING
    return tuple(
        np.array(part) for part in zip(*(rows.get(each, {}).get(name, nothing) for each in order), strict=True)
    )
