"""Stage chaos_square: distribution of the pressure at the centre, sampled and expanded (Figure 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from roughslip import store
from roughslip.chaos.distribution import (
    cumulative_given_contact,
    kolmogorov_distance,
    quantile_levels,
    wilson_interval,
)
from roughslip.chaos.functionals import local_functionals, orthonormal_directions
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.pressure import PressureTarget, fit_all_samples, fit_in_contact
from roughslip.chaos.regression import Fit
from roughslip.errors import IllPosedError
from roughslip.stages import expansion, geometry
from roughslip.stages.command import Job, execute

METHODS = ("monte_carlo", "latin_hypercube", "equation_8", "equation_9", "roughslip")
BLOCK = 20_000  # draws evaluated at a time; the first block also serves the bootstrap
REPLICATES = 100
KOLMOGOROV_95 = 1.358  # 95 % quantile of the Kolmogorov distribution: sqrt(n) sup |F_n - F|
ROWS = {
    "contact_probability": "probability of contact at the centre",
    "distance_in_contact": "Kolmogorov distance to Monte Carlo, given contact",
    "tail_error": "largest |log10| of the ratio to Monte Carlo where that lies between 0.001 and 0.1",
}
FITS = {
    "condition_number": "condition number of the basis",
    "samples": "samples that entered the fit",
    "effective_samples": "effective samples",
    "leave_one_out": "share of the variance of the target that leave-one-out residuals keep",
}


@dataclass(frozen=True)
class Expansions:
    """The three expansions and what evaluates them.

    directions : (variables, modes) orthonormal
    indices : (P, variables)
    fits : of equation_8, equation_9 and roughslip
    """

    directions: np.ndarray
    indices: np.ndarray
    target: PressureTarget
    fits: dict[str, Fit]

    def pressure(self, basis: np.ndarray, method: str, coefficients: np.ndarray) -> np.ndarray:
        """p : (K, ...) [Pa] from basis : (K, P) and coefficients : (P, ...)."""
        values = basis @ coefficients
        if method == "equation_9":
            return np.exp(values)
        return np.maximum(values, 0.0) if method == "equation_8" else self.target.pressure(values)


def fit(method: str, basis: np.ndarray, centre: tuple[np.ndarray, np.ndarray], target: PressureTarget) -> Fit:
    """One of the three expansions from pressure and gap : (K,) at the centre."""
    pressure, gap = centre
    if method == "roughslip":
        return fit_all_samples(basis, target.values(pressure, gap), target)
    return fit_in_contact(basis, pressure, logarithm=method == "equation_9")


def variables_at_centre(
    modes: np.ndarray, xi: np.ndarray, target_values: np.ndarray, target: PressureTarget, job: Job
) -> np.ndarray:
    """directions : (variables, modes) the regression direction of the target, then local functionals at the centre."""
    grid = geometry.square_grid(job.configuration)
    linear = fit_all_samples(np.column_stack([np.ones(len(xi)), xi]), target_values, target).coefficients[1:]
    stencil = expansion.stencil(geometry.covariance(job.configuration), grid)
    functionals = local_functionals(modes, stencil)[:, :, grid.centre[0], grid.centre[1]]
    return orthonormal_directions(np.vstack([linear, functionals]), job.configuration["expansion"]["variables"])


def bootstrap(
    expansions: Expansions, bases: dict[str, np.ndarray], centres: dict[str, Any], levels: np.ndarray, seed: list[int]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], dict[str, int]]:
    """Distributions and contact probabilities of refits to resampled samples, and how many of them were ill-posed."""
    draws = np.random.default_rng([*seed, geometry.STREAM_DRAWS, 0]).standard_normal(
        (BLOCK, expansions.indices.shape[1])
    )
    basis = hermite_basis(draws, expansions.indices)
    cumulative: dict[str, np.ndarray] = {}
    probability: dict[str, np.ndarray] = {}
    failed: dict[str, int] = {}
    for method in METHODS[2:]:
        generator = np.random.default_rng([*seed, geometry.STREAM_BOOTSTRAP, METHODS.index(method)])
        pressure, gap = centres[method]
        curves, shares = [], []
        for _ in range(REPLICATES):
            chosen = generator.integers(0, len(pressure), len(pressure))
            try:
                refit = fit(method, bases[method][chosen], (pressure[chosen], gap[chosen]), expansions.target)
            except IllPosedError:
                continue
            values = expansions.pressure(basis, method, refit.coefficients)
            curves.append(cumulative_given_contact(values, levels))
            shares.append(np.mean(values > 0) if method == "roughslip" else np.mean(pressure[chosen] > 0))
        cumulative[method], probability[method] = np.array(curves), np.array(shares)
        failed[method] = REPLICATES - len(curves)
    return cumulative, probability, failed


def draw(expansions: Expansions, count: int, seed: list[int]) -> dict[str, np.ndarray]:
    """Pressures [Pa] of each expansion at `count` independent draws of its variables, block by block."""
    pressures: dict[str, list[np.ndarray]] = {method: [] for method in METHODS[2:]}
    for block, first in enumerate(range(0, count, BLOCK)):
        generator = np.random.default_rng([*seed, geometry.STREAM_DRAWS, block])
        draws = generator.standard_normal((BLOCK, expansions.indices.shape[1]))[: count - first]
        basis = hermite_basis(draws, expansions.indices)
        for method, parts in pressures.items():
            parts.append(expansions.pressure(basis, method, expansions.fits[method].coefficients))
    return {method: np.concatenate(parts) for method, parts in pressures.items()}


def samples_of(batches: list[store.Result], design: str, name: str) -> np.ndarray:
    """One array of the batches of a design."""
    return store.join([batch for batch in batches if batch.attributes["design"] == design], name)


def work(job: Job) -> None:
    """Fit eqs. (8) and (9) and our expansion, sample them, and compare them with Monte Carlo."""
    configuration = job.configuration
    batches = store.read_all(job.arguments.contact)
    design = store.read(job.arguments.design)
    modes = store.read(job.arguments.surface)["modes"]
    target = expansion.target(configuration, geometry.square_grid(configuration))
    centre = {
        name: (samples_of(batches, name, "pressure")[:, 0], samples_of(batches, name, "gap")[:, 0])
        for name in ("latin_hypercube", "expansion")
    }
    reference = samples_of(batches, "monte_carlo", "pressure")
    with job.usage.core():
        ours = target.values(*centre["expansion"])
        directions = variables_at_centre(modes, design["expansion"], ours, target, job)
        indices = multi_indices(len(directions), configuration["expansion"]["degree"])
        basis = {name: hermite_basis(design[name] @ directions.T, indices) for name in centre}
        source = {"equation_8": "latin_hypercube", "equation_9": "latin_hypercube", "roughslip": "expansion"}
        fits = {method: fit(method, basis[name], centre[name], target) for method, name in source.items()}
        expansions = Expansions(directions, indices, target, fits)
        seed = [configuration["seed"]]
        pressure = draw(expansions, configuration["expansion"]["draws"], seed)
        pressure["monte_carlo"], pressure["latin_hypercube"] = reference.ravel(), centre["latin_hypercube"][0]
        levels = quantile_levels(pressure["monte_carlo"])
        bands = bootstrap(
            expansions,
            {method: basis[name] for method, name in source.items()},
            {method: centre[name] for method, name in source.items()},
            levels,
            seed,
        )
    job.usage.count(fits=len(fits) + REPLICATES * len(fits))
    variables = describe(pressure, levels, bands, fits, {"monte_carlo": len(reference)})
    variables["direction"] = store.Variable(("variable", "mode"), directions, "1", "variables in terms of the modes")
    store.write(job.arguments.output, variables, job.key)


def describe(
    pressure: dict[str, np.ndarray],
    levels: np.ndarray,
    bands: tuple[dict[str, np.ndarray], dict[str, np.ndarray], dict[str, int]],
    fits: dict[str, Fit],
    independent: dict[str, int],
) -> dict[str, store.Variable]:
    """The variables of the result: a row a method. Central nodes of one surface are not counted as independent."""
    replicates, shares, failed = bands
    cumulative = {method: cumulative_given_contact(pressure[method], levels) for method in METHODS}
    rows: dict[str, list[tuple[Any, Any, Any]]] = {name: [] for name in ("cumulative", *ROWS)}
    for method in METHODS:
        contact = pressure[method][pressure[method] > 0]
        reference = pressure["monte_carlo"]
        distance = kolmogorov_distance(contact, reference[reference > 0])
        tail = tail_error(cumulative[method], cumulative["monte_carlo"])
        if method in replicates:
            sampled = pressure[method if method == "roughslip" else "latin_hypercube"]
            curves = replicates[method]
            rows["cumulative"].append((cumulative[method], *ends(curves)))
            rows["contact_probability"].append((np.mean(sampled > 0), *ends(shares[method])))
            far = np.max(np.abs(curves - cumulative["monte_carlo"]), axis=1)
            rows["distance_in_contact"].append((distance, *holding(distance, far)))
            tails = np.array([tail_error(curve, cumulative["monte_carlo"]) for curve in curves])
            rows["tail_error"].append((tail, *holding(tail, tails)))
        else:
            count = independent.get(method, len(pressure[method]))
            share = float(np.mean(pressure[method] > 0))
            band = wilson_interval(cumulative[method] * share * count, share * count)
            rows["cumulative"].append((cumulative[method], *band))
            interval = wilson_interval(share * count, count)
            rows["contact_probability"].append((share, float(interval[0]), float(interval[1])))
            error = KOLMOGOROV_95 / np.sqrt(share * count)
            rows["distance_in_contact"].append((distance, max(distance - error, 0.0), distance + error))
            tails = np.array([tail_error(end, cumulative["monte_carlo"]) for end in band])
            rows["tail_error"].append((tail, *holding(tail, tails)))
    between = kolmogorov_distance(pressure["equation_8"][pressure["equation_8"] > 0], pressure["equation_9"])
    pairs = min(len(replicates["equation_8"]), len(replicates["equation_9"]))
    apart = np.max(np.abs(replicates["equation_8"][:pairs] - replicates["equation_9"][:pairs]), axis=1)
    one = ("method",)
    variables = {
        "method": store.Variable(one, np.array(METHODS), "1", "how the distribution was found"),
        "pressure": store.Variable(("pressure",), levels, "Pa", "contact pressure at the centre"),
        "distance": store.Variable(
            one,
            [kolmogorov_distance(pressure[method], pressure["monte_carlo"]) for method in METHODS],
            "1",
            "Kolmogorov distance to Monte Carlo, all samples",
        ),
        "samples": store.Variable(one, [len(pressure[method]) for method in METHODS], "1", "pressures drawn"),
        "mean_pressure": store.Variable(
            one, [pressure[method].mean() for method in METHODS], "Pa", "mean pressure, contact or not"
        ),
        "fit": store.Variable(("fit",), np.array(list(fits)), "1", "expansion"),
        "refits_refused": store.Variable(("fit",), [failed[method] for method in fits], "1", "ill-posed refits"),
    }
    for name, values in rows.items():
        dimensions = ("method", "pressure") if name == "cumulative" else one
        variables |= with_interval(name, dimensions, values, ROWS.get(name, "distribution given contact"))
    variables |= with_interval(
        "distance_between_variants",
        (),
        [(between, *holding(between, apart))],
        "Kolmogorov distance of eqs. (8) and (9)",
    )
    for name, title in FITS.items():
        values = [getattr(fit, name) for fit in fits.values()]
        variables[f"fit_{name}"] = store.Variable(("fit",), values, "1", title)
    return variables


def tail_error(cumulative: np.ndarray, reference: np.ndarray) -> float:
    """Largest |log10 F / F_reference| where the reference lies between 0.001 and 0.1: the low probabilities."""
    tail = (reference >= 1e-3) & (reference <= 1e-1)
    return float(np.max(np.abs(np.log10(np.maximum(cumulative[tail], 1 / BLOCK) / reference[tail]))))


def ends(replicates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 95 % percentile interval of replicates along their first axis."""
    low, high = np.quantile(replicates, [0.025, 0.975], axis=0)
    return low, high


def holding(value: float, replicates: np.ndarray) -> tuple[float, float]:
    """Ends of a percentile interval, widened to hold the value: refits scatter to one side of a distance."""
    low, high = ends(replicates)
    return min(float(low), value), max(float(high), value)


def with_interval(
    name: str, dimensions: tuple[str, ...], values: list[tuple[Any, Any, Any]], title: str
) -> dict[str, store.Variable]:
    """Variables for value, low and high of one quantity."""
    suffixes = {"": title, "_low": f"{title}, lower end of its 95 % interval"}
    suffixes["_high"] = f"{title}, upper end of its 95 % interval"
    return {
        name + suffix: store.Variable(
            dimensions, np.array([row[part] for row in values]) if dimensions else values[0][part], "1", label
        )
        for part, (suffix, label) in enumerate(suffixes.items())
    }


if __name__ == "__main__":
    execute("chaos_square", work, files=("surface", "design"), batches=("contact",))
