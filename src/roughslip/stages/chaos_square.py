"""Stage chaos_square: distribution of the pressure at the centre, sampled and expanded (Figure 2)."""

from __future__ import annotations

import sys

import numpy as np

from roughslip import store
from roughslip.chaos.designs import monte_carlo
from roughslip.chaos.distribution import kolmogorov_distance, quantile_levels
from roughslip.chaos.functionals import local_functionals, orthonormal_directions
from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.indices import multi_indices
from roughslip.chaos.pressure import PressureTarget, fit_all_samples
from roughslip.chaos.regression import Fit
from roughslip.errors import IllPosedError
from roughslip.stages import expansion, geometry, surfaces
from roughslip.stages.centre_distribution import (
    EXPANDED,
    METHODS,
    REPLICATES,
    ROWS,
    Expansion,
    Reference,
    Row,
    apart,
    draw,
    expanded_rows,
    refits,
    refused_rows,
    sampled_rows,
)
from roughslip.stages.command import Job, execute

DESIGN = {"equation_8": "latin_hypercube", "equation_9": "latin_hypercube", "roughslip": "expansion"}
KNOWN = 20_000  # Monte Carlo samples drawn again for the expansions at samples known to be in contact
FITS = {
    "condition_number": "condition number of the basis",
    "samples": "samples that entered the fit",
    "effective_samples": "effective samples",
    "leave_one_out": "share of the variance of the target that leave-one-out residuals keep",
}


def variables_at_centre(
    modes: np.ndarray, xi: np.ndarray, target_values: np.ndarray, target: PressureTarget, job: Job
) -> np.ndarray:
    """directions : (variables, modes) the regression direction of the target, then local functionals at the centre."""
    grid = geometry.square_grid(job.configuration)
    linear = fit_all_samples(np.column_stack([np.ones(len(xi)), xi]), target_values, target).coefficients[1:]
    stencil = expansion.stencil(surfaces.gaussian_model(job.configuration, job.arguments.scan), grid)
    functionals = local_functionals(modes, stencil)[:, :, grid.centre[0], grid.centre[1]]
    return orthonormal_directions(np.vstack([linear, functionals]), job.configuration["expansion"]["variables"])


def expansions(batches: list[store.Result], modes: np.ndarray, job: Job) -> tuple[dict[str, Expansion], np.ndarray]:
    """The three expansions before their fit, and the directions of their variables."""
    design = store.read(job.arguments.design)
    model = surfaces.gaussian_model(job.configuration, job.arguments.scan)
    target = expansion.target(job.configuration, model, geometry.square_grid(job.configuration))
    pressure, gap = (
        {name: samples_of(batches, name, quantity)[:, 0] for name in set(DESIGN.values())}
        for quantity in ("pressure", "gap")
    )
    values = target.values(pressure["expansion"], gap["expansion"])
    directions = variables_at_centre(modes, design["expansion"], values, target, job)
    indices = multi_indices(len(directions), job.configuration["expansion"]["degree"])
    basis = {name: hermite_basis(design[name] @ directions.T, indices) for name in pressure}
    found = {
        method: Expansion(method, basis[name], pressure[name], gap[name], target, indices)
        for method, name in DESIGN.items()
    }
    return found, directions


def samples_of(batches: list[store.Result], design: str, name: str) -> np.ndarray:
    """One array of the batches of a design."""
    return store.join([batch for batch in batches if batch.attributes["design"] == design], name)


def fits_of(found: dict[str, Expansion]) -> dict[str, Fit]:
    """Fits by method. The paper's may be ill-posed (K <= P): they are then left out, and the log says why."""
    fits = {"roughslip": found["roughslip"].fit()}
    for method in EXPANDED[:2]:
        try:
            fits[method] = found[method].fit()
        except IllPosedError as error:
            print(f"chaos_square: {method}: {error}; its distribution is stored as NaN", file=sys.stderr)
    return fits


def contacts_of_monte_carlo(pressure: np.ndarray, directions: np.ndarray, job: Job) -> np.ndarray:
    """xi : (contacts, variables) of the Monte Carlo samples, no part of any fit, that their solves found in contact.

    pressure : (samples,) [Pa] at the centre of the first samples
    """
    seed = [job.configuration["seed"], geometry.STREAM_MONTE_CARLO]
    modes = directions.shape[1]
    return np.array([directions @ monte_carlo([*seed, int(n)], modes) for n in np.flatnonzero(pressure > 0)])


def work(job: Job) -> None:
    """Fit eqs. (8) and (9) and our expansion, sample them, and compare them with Monte Carlo."""
    batches = store.read_all(job.arguments.contact)
    draws, seed = job.configuration["expansion"]["draws"], job.configuration["seed"]
    nodes = samples_of(batches, "monte_carlo", "pressure")
    surface = store.read(job.arguments.surface)
    with job.usage.core():
        found, directions = expansions(batches, surface["modes"], job)
        fits = fits_of(found)
        pressure = {"monte_carlo": nodes.ravel(), "latin_hypercube": found["equation_8"].pressure}
        reference = Reference(pressure["monte_carlo"], len(nodes), quantile_levels(pressure["monte_carlo"]))
        rows = {
            "monte_carlo": sampled_rows(pressure["monte_carlo"], len(nodes), reference),
            "latin_hypercube": sampled_rows(pressure["latin_hypercube"], len(pressure["latin_hypercube"]), reference),
        }
        moved: dict[str, np.ndarray] = {}
        known = contacts_of_monte_carlo(nodes[:KNOWN, 0], directions, job)
        at_contact: dict[str, float] = {}
        for method, fit in fits.items():
            one, drawing = found[method], [seed, geometry.STREAM_DRAWS]
            at_contact[method] = reference.distance(one.at(hermite_basis(known, one.indices), fit.coefficients))
            pressure[method] = draw(one, fit.coefficients, draws, drawing)
            signs = [seed, geometry.STREAM_BOOTSTRAP, sorted(set(DESIGN.values())).index(DESIGN[method])]
            moved[method], shares = refits(one, fit, reference.levels, drawing, signs)
            probability: Row = rows["latin_hypercube"]["contact_probability"]
            if method == "roughslip":
                share = np.mean(pressure[method] > 0)
                probability = (share, *(share + np.quantile(shares, [0.025, 0.975])))
            rows[method] = expanded_rows(pressure[method], moved[method], probability, reference)
        between: Row = (np.nan, np.nan, np.nan)
        if "equation_8" in fits and "equation_9" in fits:
            between = apart(pressure["equation_8"], pressure["equation_9"], moved)
    for method in EXPANDED:
        rows.setdefault(method, refused_rows(reference.levels, rows["latin_hypercube"]["contact_probability"]))
    job.usage.count(fits=len(fits) * (1 + REPLICATES), draws=draws * len(fits))
    variables = table(rows, pressure, reference) | quality(fits, at_contact, pressure)
    title = "Kolmogorov distance of eqs. (8) and (9)"
    variables |= store.with_interval("distance_between_variants", (), between, "1", title)
    variables["captured_variance"] = surface.variable("captured_variance")
    variables["direction"] = store.Variable(("variable", "mode"), directions, "1", "variables in terms of the modes")
    store.write(job.arguments.output, variables, job.key)


def table(
    rows: dict[str, dict[str, Row]], pressure: dict[str, np.ndarray], reference: Reference
) -> dict[str, store.Variable]:
    """A row a method: distribution, contact probability and distances, each with its interval; means and numbers."""
    one = ("method",)
    distance = [kolmogorov_distance(pressure[m], pressure["monte_carlo"]) if m in pressure else np.nan for m in METHODS]
    means = np.array([pressure[method].mean() if method in pressure else np.nan for method in METHODS])
    variables = {
        "method": store.Variable(one, np.array(METHODS), "1", "how the distribution was found"),
        "pressure": store.Variable(("pressure",), reference.levels, "Pa", "contact pressure at the centre"),
        "distance": store.Variable(one, distance, "1", "Kolmogorov distance to Monte Carlo, all samples"),
        "samples": store.Variable(one, [len(pressure.get(m, ())) for m in METHODS], "1", "pressures drawn"),
        "mean_pressure": store.Variable(one, means, "Pa", "mean pressure, contact or not; NaN without a fit"),
        "tail_from": store.Variable(
            (), reference.tail_from, "1", "least of the low probabilities that Monte Carlo settles"
        ),
    }
    for name, title in ROWS.items():
        dimensions = ("method", "pressure") if name == "cumulative" else one
        columns = [np.array(part) for part in zip(*(rows[method][name] for method in METHODS), strict=True)]
        variables |= store.with_interval(name, dimensions, columns, "1", title)
    return variables


def quality(
    fits: dict[str, Fit], at_contact: dict[str, float], pressure: dict[str, np.ndarray]
) -> dict[str, store.Variable]:
    """A row an expansion: what tells how far to trust its fit; NaN where it was refused."""
    one = ("fit",)
    variables = {"fit": store.Variable(one, np.array(EXPANDED), "1", "expansion")}
    for name, title in FITS.items():
        values = [float(getattr(fits[method], name)) if method in fits else np.nan for method in EXPANDED]
        variables[f"fit_{name}"] = store.Variable(one, values, "1", title)
    positive = [float(np.mean(pressure[method] > 0)) if method in fits else np.nan for method in EXPANDED]
    title = "share of new draws at which the expansion is positive"
    variables["fit_positive_share"] = store.Variable(one, positive, "1", title)
    values = [at_contact.get(method, np.nan) for method in EXPANDED]
    title = "Kolmogorov distance to Monte Carlo given contact, at Monte Carlo samples that are known to be in contact"
    variables["fit_distance_at_contact"] = store.Variable(one, values, "1", title)
    return variables


if __name__ == "__main__":
    execute("chaos_square", work, files=("surface", "design"), batches=("contact",), optional=("scan",))
