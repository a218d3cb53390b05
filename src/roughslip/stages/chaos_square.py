"""Stage chaos_square: distribution of the pressure at the centre, sampled and expanded (Figure 2)."""

from typing import NamedTuple

import numpy as np

from roughslip import store
from roughslip.chaos.centre_distribution import (
    EXPANDED,
    METHODS,
    REPLICATES,
    ROWS,
    EdgeCorrection,
    Expansion,
    Reference,
    Row,
    apart,
    design_pressures,
    designed_rows,
    draw,
    expanded_rows,
    mean_over_designs,
    moved_local,
    refits,
    refused_rows,
    sampled_rows,
)
from roughslip.chaos.hermite import hermite_basis, multi_indices, sobol_indices
from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.chaos.regression import Fit
from roughslip.chaos.sampling import kolmogorov_distance, monte_carlo, quantile_levels
from roughslip.errors import IllPosedError
from roughslip.limits import designs_of
from roughslip.probability.estimate import NORMAL_95
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import elastic, expansion, geometry, surface_model
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.result_tables.given_contact import KNOWN, Members, Sampled, given_contact, members
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="chaos_square",
    reads="seed material roughness square.edge_m square.nodes square.penetration_percentile "
    "numerics.contact_area expansion",
    inputs={"surface": "karhunen_loeve", "designs": "design"},
    optional={"scan": "scan"},
    many={"contact": "contact_square"},
    result="chaos/square.nc",
    memory_mb=620,
)

PAPER = 8  # variables, at most, of eqs. (8) and (9)
FITS = {
    "condition_number": "condition number of the basis",
    "samples": "samples that entered the fit",
    "effective_samples": "effective samples",
    "leave_one_out": "share of the variance of the target that leave-one-out residuals keep",
    "positive_share": "share of new draws at which the expansion is positive",
    "distance_at_contact": "Kolmogorov distance to Monte Carlo given contact, at Monte Carlo samples that are known to "
    "be in contact",
}


def local_expansion(
    batches: list[store.Result], surface: store.Result, job: Job
) -> tuple[LocalExpansion, Samples, np.ndarray]:
    """Ours, and what it is fitted to: the training nodes of its design.

    Returns them, and the variables at the centre in terms of the modes : (variables, modes).
    """
    scene = job.scene
    model, grid = surface_model.gaussian_model(scene, job.arguments.scan), geometry.square_grid(scene)
    nodes = geometry.training_nodes(model.lengths_m, grid)
    variables = expansion.variables_of(scene, model, grid, surface["modes"], nodes)
    xi = store.read(job.arguments.designs)["expansion"]
    pressure, gap = (samples_of(batches, "expansion", quantity) for quantity in ("pressure", "gap"))
    samples = variables.samples(xi, pressure, gap)
    local = fit_local(samples, scene.expansion.degree, expansion.target(scene, model, grid))
    return local, samples, variables.directions[0]


def edges_of(batches: list[store.Result], group: np.ndarray, job: Job) -> tuple[EdgeCorrection, EdgeCorrection]:
    """The error of the mesh at edges of contacts, from the training samples, and what the scene takes off of it."""
    cells, points = (samples_of(batches, "expansion", name) for name in ("pressure", "point_pressure"))
    corrected = elastic.counts_shares(job.scene)
    return EdgeCorrection(cells, points, group), EdgeCorrection(cells, points if corrected else cells, group)


def drawn_locally(
    local: LocalExpansion, edges: EdgeCorrection, reference: Reference, solved: Reference, job: Job
) -> tuple[np.ndarray, dict[str, Row]]:
    """Pressures of our expansion, and its rows; its contact probability is its own.

    edges : what is taken off; reference, solved : of the levels, and of the distances
    """
    drawing = [job.scene.seed, Stream.DRAWS]
    pressure = edges.apply(local.draw(np.random.default_rng(drawing), job.scene.expansion.draws))
    moved, error = moved_local(local, reference.levels, drawing, edges)
    share = float(np.mean(pressure > 0))
    probability = (share, share - NORMAL_95 * error, share + NORMAL_95 * error)
    return pressure, expanded_rows(pressure, moved, probability, solved)


def samples_of(batches: list[store.Result], design: str, name: str) -> np.ndarray:
    """One array of the batches of a design."""
    return store.join([batch for batch in batches if batch.attributes["design"] == design], name)


class Variants(NamedTuple):
    """Eqs. (8) and (9) by design: their samples, and their fits by method where these are well-posed."""

    designs: list[dict[str, Expansion]]
    fitted: list[dict[str, Fit]]

    @property
    def methods(self) -> list[str]:
        """Those that were fitted to all designs."""
        return [method for method in self.fitted[0] if all(method in fits for fits in self.fitted)]

    def of(self, method: str) -> tuple[list[Expansion], list[Fit]]:
        """Samples and fits of a method by design."""
        return [design[method] for design in self.designs], [fits[method] for fits in self.fitted]

    def at(self, variables: np.ndarray, signs: list[int]) -> dict[str, Members]:
        """By method the fits at variables : (surfaces, v). signs : seed of the refits of a single design"""
        return {method: members(*self.of(method), variables[:, :PAPER], signs) for method in self.methods}


def variants_of(sampled: np.ndarray, directions: np.ndarray, job: Job) -> Variants:
    """Fits of both to each design. They may be ill-posed (K <= P), and are then left out with a warning."""
    indices = multi_indices(len(directions[:PAPER]), job.scene.expansion.degree)
    basis = hermite_basis(store.read(job.arguments.designs)["latin_hypercube"] @ directions[:PAPER].T, indices)
    designs = [
        {method: Expansion(method, basis[part], sampled[part], indices) for method in EXPANDED[:2]}
        for part in designs_of(len(sampled))
    ]
    refused: dict[str, list[str]] = {}
    fitted: list[dict[str, Fit]] = [{} for _ in designs]
    for design, fits in zip(designs, fitted, strict=True):
        for method, samples in design.items():
            try:
                fits[method] = samples.fit()
            except IllPosedError as error:
                refused.setdefault(method, []).append(str(error))
    for method, reasons in refused.items():
        where = f"{method.replace('_', ' ')}, {len(reasons)} of {len(designs)} designs"
        job.usage.warn(f"{where}: {reasons[0]}; its distribution is stored as NaN")
    return Variants(designs, fitted)


def drawn_variants(
    variants: Variants, solved: Reference, probability: Row, job: Job
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, Row]], Row]:
    """Pressures and rows of eqs. (8) and (9) by method, and their distance from each other."""
    drawing, signs = ([job.scene.seed, stream] for stream in (Stream.DRAWS, Stream.BOOTSTRAP))
    pressure: dict[str, np.ndarray] = {}
    moved: dict[str, np.ndarray] = {}
    repeated: dict[str, np.ndarray] = {}
    rows = {method: refused_rows(solved.levels, probability) for method in EXPANDED[:2]}
    for method in variants.methods:
        designs, fits = variants.of(method)
        pressure[method] = draw(designs[0], fits[0].coefficients, job.scene.expansion.draws, drawing)
        if len(designs) == 1:
            moved[method] = refits(designs[0], fits[0], solved.levels, drawing, signs)
            rows[method] = expanded_rows(pressure[method], moved[method], probability, solved)
        else:
            repeated[method] = design_pressures(designs, fits, drawing)
            rows[method] = designed_rows(repeated[method], probability, solved)
    between: Row = (np.nan, np.nan, np.nan)
    if len(repeated) == 2:
        pairs = zip(*repeated.values(), strict=True)
        between = mean_over_designs(np.array([kolmogorov_distance(a[a > 0], b[b > 0]) for a, b in pairs]))
    elif len(pressure) == 2:
        between = apart(pressure["equation_8"], pressure["equation_9"], moved)
    return pressure, rows, between


def known_in_contact(nodes: np.ndarray, directions: np.ndarray, seed: int) -> np.ndarray:
    """Variables : (surfaces, v) of Monte Carlo samples, no part of any fit, that their solves found in contact."""
    streams = ([seed, Stream.MONTE_CARLO, int(n)] for n in np.flatnonzero(nodes[:, 0] > 0)[:KNOWN])
    return np.array([directions @ monte_carlo(stream, directions.shape[1]) for stream in streams])


def work(job: Job) -> None:
    """Fit eqs. (8) and (9) and our expansion, sample them, and compare them with the solved samples."""
    batches, seed, asked = store.read_all(job.arguments.contact), job.scene.seed, job.scene.expansion
    nodes, sampled = (samples_of(batches, design, "pressure") for design in ("monte_carlo", "latin_hypercube"))
    sampled, surface = sampled[:, 0], store.read(job.arguments.surface)
    with job.usage.core():
        local, samples, directions = local_expansion(batches, surface, job)
        variants = variants_of(sampled, directions, job)
        reference = Reference(nodes.ravel(), len(nodes), quantile_levels(nodes.ravel()))
        pooled = np.concatenate((nodes.ravel(), sampled))
        solved = Reference(pooled, len(nodes) + len(sampled), reference.levels)
        rows = {
            "monte_carlo": sampled_rows(nodes.ravel(), len(nodes), reference),
            "latin_hypercube": sampled_rows(sampled, len(sampled), reference),
        }
        error, edges = edges_of(batches, samples.group, job)
        known = known_in_contact(nodes, directions, seed)
        drawn, borne = local.draw_with_variables(np.random.default_rng([seed, Stream.DRAWS]), asked.draws)
        judged = drawn[edges.apply(borne) > 0][:KNOWN]
        at_known, at_judged = (variants.at(each, [seed, Stream.BOOTSTRAP]) for each in (known, judged))
        parts = Sampled(solved, [sampled[part] for part in designs_of(len(sampled))])
        given = given_contact(at_known, at_judged, parts, known[:, 0])
        at_contact = {method: reference.distance(fits.pressures[0]) for method, fits in at_known.items()}
        at_contact["roughslip"] = reference.distance(edges.apply(local.mean_pressure_at(known)))
        probability = rows["latin_hypercube"]["contact_probability"]
        pressure, of_variants, between = drawn_variants(variants, solved, probability, job)
        pressure |= {"monte_carlo": nodes.ravel(), "latin_hypercube": sampled}
        pressure["roughslip"], rows["roughslip"] = drawn_locally(local, edges, reference, solved, job)
    fits = {method: variants.fitted[0][method] for method in variants.methods}
    count_work(job, local, len(fits))
    results = table(rows | of_variants, pressure, solved)
    results |= quality({**fits, "roughslip": local.fit}, at_contact, pressure)
    title = "Kolmogorov distance of eqs. (8) and (9)"
    results |= store.with_interval("distance_between_variants", (), between, "1", title)
    results |= explained(local, directions) | corrections(error) | given
    results["captured_variance"] = surface.variable("captured_variance")
    store.write(job.arguments.output, results, job.key, {"target": local.target.kind, "variables": len(directions)})


def count_work(job: Job, local: LocalExpansion, variants: int) -> None:
    """What was fitted and drawn."""
    asked = job.scene.expansion
    job.usage.count(fits=variants * (1 + REPLICATES) + 1 + len(local.without), draws=asked.draws * (1 + variants))
    job.usage.skip({skip_reasons.SYMMETRIC: skip_reasons.forbidden_terms(local.indices, asked.degree)})


def explained(local: LocalExpansion, directions: np.ndarray) -> dict[str, store.Variable]:
    """How well our expansion predicts left-out surfaces, and what the modes behind its variables explain.

    directions : (variables, modes) the variables at the centre in terms of the modes
    """
    first, total = sobol_indices(local.indices, local.whole.coefficients, directions)
    unit = "Pa m-1" if local.target.kind == "trial_pressure" else "Pa2 m-1"
    score = "continuous ranked probability score of our expansion at left-out surfaces over the mean pressure"
    missed = "share of the variance of its target that our expansion misses at left-out surfaces"
    share = "share of the variance of the expanded target that a mode explains {} (Sobol' index)"
    variables = "variables at the centre in terms of the modes"
    return {
        "cross_validated": store.Variable((), local.cross_validated, "1", missed),
        "gap_stiffness": store.Variable(
            (), local.target.gap_stiffness, unit, "stiffness of the gap in the target of our expansion"
        ),
        "score": store.Variable((), local.score, "1", score),
        "sobol_first": store.Variable(("mode",), first, "1", share.format("alone")),
        "sobol_total": store.Variable(("mode",), total, "1", share.format("alone and with others")),
        "direction": store.Variable(("variable", "mode"), directions, "1", variables),
    }


def corrections(error: EdgeCorrection) -> dict[str, store.Variable]:
    """What the mesh error at edges is, whether the scene takes it off or not."""
    title = "contact probability at the training nodes without the mesh error at edges, over that with it"
    distance = "Kolmogorov distance given contact between these distributions"
    return store.with_interval("contact_correction", (), error.contact(), "1", title) | {
        "distance_of_correction": store.Variable((), error.distance(), "1", distance)
    }


def table(
    rows: dict[str, dict[str, Row]], pressure: dict[str, np.ndarray], reference: Reference
) -> dict[str, store.Variable]:
    """A row a method: distribution, contact probability and distances, each with its interval; means and numbers."""
    each, truth = ("method",), pressure["monte_carlo"]
    distance = [kolmogorov_distance(pressure[m], truth) if m in pressure else np.nan for m in METHODS]
    means = np.array([pressure[method].mean() if method in pressure else np.nan for method in METHODS])
    minimum = "least of the low probabilities that the solved samples determine"
    variables = {
        "method": store.Variable(each, np.array(METHODS), "1", "how the distribution was found"),
        "pressure": store.Variable(("pressure",), reference.levels, "Pa", "contact pressure at the centre"),
        "distance": store.Variable(each, distance, "1", "Kolmogorov distance to Monte Carlo, all samples"),
        "samples": store.Variable(each, [len(pressure.get(m, ())) for m in METHODS], "1", "pressures drawn"),
        "mean_pressure": store.Variable(each, means, "Pa", "mean pressure, contact or not; NaN without a fit"),
        "tail_from": store.Variable((), reference.tail_from, "1", minimum),
    }
    for name, title in ROWS.items():
        dimensions = ("method", "pressure") if name == "cumulative" else each
        columns = [np.array(part) for part in zip(*(rows[method][name] for method in METHODS), strict=True)]
        variables |= store.with_interval(name, dimensions, columns, "1", title)
    return variables


def quality(
    fits: dict[str, Fit], at_contact: dict[str, float], pressure: dict[str, np.ndarray]
) -> dict[str, store.Variable]:
    """Quality of the fit, a row for each expansion; NaN where the fit was refused."""
    columns = {name: {method: getattr(fit, name, np.nan) for method, fit in fits.items()} for name in FITS}
    columns["positive_share"] = {method: np.mean(pressure[method] > 0) for method in fits}
    columns["distance_at_contact"] = at_contact
    variables = {"fit": store.Variable(("fit",), np.array(EXPANDED), "1", "expansion")}
    for name, column in columns.items():
        values = [float(column.get(method, np.nan)) for method in EXPANDED]
        variables[f"fit_{name}"] = store.Variable(("fit",), values, "1", FITS[name])
    return variables
