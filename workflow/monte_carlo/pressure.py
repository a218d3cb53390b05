"""The Monte Carlo reference of the pressure at the centre of a scene's square, at three penetrations.

A sample is one surface, its Karhunen-Loeve variables from default_rng([seed, STREAM, number]), solved at every
penetration. Its four central nodes have one distribution but are not independent. So every standard error takes the sum
over a surface as one observation (clusters). A share given contact is the ratio of two such sums (W. G. Cochran,
Sampling Techniques, 1977, section 2.11).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import ndtri

from roughslip import store
from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.chaos.sampling import sobol_places
from roughslip.contact.solve import sweep
from roughslip.errors import InputError
from roughslip.grid import Grid
from roughslip.scene.mistakes import Values
from roughslip.scene.types import Scene, scene_of
from roughslip.stages.from_scene import elastic, expansion, geometry, surface_model
from roughslip.stages.from_scene.geometry import Nodes, central_nodes
from roughslip.surface.model import GaussianModel
from roughslip.surface.modes import heights, karhunen_loeve
from workflow.monte_carlo.command import run_command

PERCENTILES = (20.0, 50.0, 80.0)
STREAM = 20  # the second entry of every seed; streams of the study are below 20
TOLERANCE = 1e-6  # far below the sampling error of any number of samples
KEPT = np.float32  # seven digits, and half the size
PROBABILITIES = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 0.999)  # of the quantiles given contact
STEPS = 380  # of the table of the distribution, equal in the probability given contact
TAIL = 10  # steps into which the first and the last are divided in geometric progression
LEAST = 1e-5  # probability where that progression starts

VARIABLES, DEGREE, TARGET = 8, 3, "squared_pressure"  # of the expansion that controls the mean
FITTED = 10_000  # surfaces to which it is fitted, which take no part in the mean
CONTROL_STREAM = 24  # the second entry of the seeds of E c
SCRAMBLES, POINTS = 32, 2**16  # independent Sobol sequences for E c, and the length of each
BLOCK = 50_000  # surfaces evaluated at a time


def square_of(scene: Scene) -> tuple[GaussianModel, Grid, np.ndarray, Nodes]:
    """Return the surface model, the mesh, the modes (M, nx, ny) [m], and the central nodes of a scene's square."""
    model, grid = surface_model.gaussian_model(scene), geometry.square_grid(scene)
    modes = karhunen_loeve(model.covariance, grid, scene.square.modes, share=scene.square.variance_share).modes
    return model, grid, modes, central_nodes(model.lengths_m, grid)


def draw_variables(seed: int, number: int, modes: int) -> np.ndarray:
    """Return the standard normal xi (modes,) of one sample."""
    return np.random.default_rng([seed, STREAM, number]).standard_normal(modes)


def solve_surfaces(configuration: Values, first: int, last: int) -> dict[str, store.Variable]:
    """Return pressure and gap (samples, penetrations, central nodes) of samples first ... last - 1.

    The nodes are in the order of `geometry.central_nodes`.
    """
    scene = scene_of(configuration)
    model, grid, modes, nodes = square_of(scene)
    planes = np.array([float(model.plane_height(percentile)) for percentile in PERCENTILES])
    hardness, influence = elastic.hardness_pa(scene), elastic.influence(scene, grid)
    pressure, gap = np.empty((2, last - first, len(planes), len(nodes.x)), dtype=KEPT)
    for row, number in enumerate(range(first, last)):
        z = model.heights(heights(modes, draw_variables(scene.seed, number, len(modes))))
        for level, solution in enumerate(sweep(influence, z, planes, TOLERANCE, hardness_pa=hardness)):
            pressure[row, level] = solution.pressure[nodes.x, nodes.y]
            gap[row, level] = solution.signed_gap[nodes.x, nodes.y]
    dimensions = ("sample", "penetration", "node")
    return {
        "pressure": store.Variable(dimensions, pressure, "Pa", "contact pressure at the central nodes"),
        "gap": store.Variable(dimensions, gap, "m", "gap at the central nodes"),
        "percentile": store.Variable(("penetration",), np.array(PERCENTILES), "percent", "penetration"),
    }


# The distribution.


def choose_levels(pressure: np.ndarray) -> np.ndarray:
    """Return levels [Pa] of the kept distribution, ascending, from zero to the largest pressure."""
    even = np.linspace(0.0, 1.0, STEPS + 1)
    tail = np.geomspace(LEAST, even[1], TAIL, endpoint=False)
    probabilities = np.sort(np.concatenate([even, tail, 1.0 - tail]))
    return np.concatenate([[0.0], np.quantile(pressure[pressure > 0], probabilities)])


def cumulative_shares(pressure: np.ndarray, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shares of pressures (surfaces, nodes) at or below levels (n,), and their clustered standard errors.

    A surface with m of its n nodes below a level adds (m / n)^2 to the sum of squares. Sorted along the nodes, its r-th
    smallest pressure raises m from r - 1 to r. So sums of squares are sums of (2 r - 1) / n^2 over the ranks.
    """
    surfaces, nodes = pressure.shape
    ranked = np.sort(pressure, axis=1)
    counts = np.stack([np.searchsorted(np.sort(ranked[:, rank]), levels, side="right") for rank in range(nodes)])
    share = counts.sum(axis=0) / (nodes * surfaces)
    squares = (2 * np.arange(nodes) + 1) @ counts / nodes**2
    return share, np.sqrt(np.maximum(squares / surfaces - share**2, 0.0) / (surfaces - 1))


def clustered_mean(values: np.ndarray) -> tuple[float, float]:
    """Return the mean over values (surfaces, nodes) and its clustered standard error."""
    of_surface = values.mean(axis=1, dtype=np.float64)
    return float(of_surface.mean()), float(of_surface.std(ddof=1) / np.sqrt(len(of_surface)))


def quantiles_given_contact(pressure: np.ndarray, probabilities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return quantiles [Pa] of the positive ones among pressures (surfaces, nodes), and their standard errors.

    The error of a quantile is half the difference of the quantiles at its probability plus and minus the standard error
    there (R. S. Woodruff, J. Am. Stat. Assoc. 47 (1952) 635).
    """
    positive = np.sort(pressure[pressure > 0].astype(np.float64))
    found, contacts = np.quantile(positive, probabilities), np.count_nonzero(pressure > 0, axis=1)
    halves = np.empty(len(found))
    for place, (level, probability) in enumerate(zip(found, probabilities, strict=True)):
        below = np.count_nonzero((pressure > 0) & (pressure <= level), axis=1)
        error = np.sqrt(np.sum((below - probability * contacts) ** 2.0)) / contacts.sum()
        ends = np.quantile(positive, np.clip([probability - error, probability + error], 0.0, 1.0))
        halves[place] = 0.5 * (ends[1] - ends[0])
    return found, halves


# The mean with a control variate.


def controlled_mean(pressure: np.ndarray, control: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Return the mean of pressure (K,) and its standard error.

    control : (K,) the control variate c
    expected : independent estimates of its mean E c

    Method: <p> - b (<c> - E c) with b = cov(p, c) / var(c). It is unbiased for any c, but for 1/K from the fit of b (P.
    Glasserman, Monte Carlo Methods in Financial Engineering, 2004, section 4.1).
    """
    covariance = np.cov(pressure, control)
    slope = covariance[0, 1] / covariance[1, 1]
    mean = pressure.mean() - slope * (control.mean() - expected.mean())
    left = covariance[0, 0] - slope * covariance[0, 1]
    variance = left / len(pressure) + slope**2 * expected.var(ddof=1) / len(expected)
    return float(mean), float(np.sqrt(variance))


def controlled_means(configuration: Values, pressure: np.ndarray, gap: np.ndarray) -> list[tuple[float, float]]:
    """Return the mean pressure [Pa] and its standard error at each penetration, with an expansion as control variate.

    configuration : of the solves
    pressure, gap : (surfaces, penetrations, central nodes) [Pa], [m] of their first samples

    Raises InputError for fewer than twice FITTED surfaces. Where one surface in twenty is in contact at its centre, the
    plain mean of 400 000 surfaces is known to 0.75 % only.
    """
    if len(pressure) < 2 * FITTED:
        raise InputError([f"the expansion that controls a mean takes {FITTED} surfaces: gather {2 * FITTED} at least"])
    scene = scene_of({**configuration, "expansion": {"target": TARGET}})
    model, grid, modes, nodes = square_of(scene)
    directions, odd = expansion.directions(model, grid, modes, nodes, VARIABLES)
    target = expansion.target(scene, model, grid)

    def local(first: int, last: int) -> np.ndarray:
        xi = np.array([draw_variables(scene.seed, number, len(modes)) for number in range(first, last)])
        return np.einsum("km,nvm->knv", xi, directions)

    def evaluate(one: LocalExpansion, part: np.ndarray) -> np.ndarray:
        return one.mean_pressure_at(part.reshape(-1, part.shape[2])).reshape(part.shape[:2]).mean(axis=1)

    variables, fits = local(0, FITTED), []
    for level in range(pressure.shape[1]):
        solved = pressure[:FITTED, level].astype(np.float64)
        open_gap = np.where(solved > 0, 0.0, gap[:FITTED, level])
        fits.append(fit_local(Samples(variables, nodes.distance2, solved, open_gap, odd), DEGREE, target))
    blocks = (local(first, min(first + BLOCK, len(pressure))) for first in range(FITTED, len(pressure), BLOCK))
    controls = np.concatenate([np.stack([evaluate(one, part) for one in fits]) for part in blocks], axis=1)
    generators = (np.random.default_rng([scene.seed, CONTROL_STREAM, number]) for number in range(SCRAMBLES))
    points = (ndtri(sobol_places(generator, POINTS, VARIABLES)) for generator in generators)
    expected = np.array([[one.mean_pressure_at(normal).mean() for one in fits] for normal in points])
    observed = pressure[FITTED:].mean(axis=2, dtype=np.float64)
    return [controlled_mean(observed[:, at], controls[at], expected[:, at]) for at in range(len(fits))]


# What is kept.


def describe_pressure(
    pressure: np.ndarray, percentiles: np.ndarray, means: Sequence[tuple[float, float]]
) -> dict[str, store.Variable]:
    """Return distribution, means and quantiles of pressures (surfaces, penetrations, nodes) [Pa].

    means : controlled mean pressure and its standard error at each penetration

    Raises InputError for a penetration without contact or with fewer than two surfaces.
    """
    if len(pressure) < 2 or not (pressure > 0).any(axis=(0, 2)).all():
        raise InputError(["a reference needs two surfaces and contact at every penetration: gather more surfaces"])
    table, one, given = ("penetration", "level"), ("penetration",), ("penetration", "probability")
    numbers = (
        ("cumulative", table, "1", "share of the pressures that are at most the level, zeros included"),
        ("contact_probability", one, "1", "share of the pressures above zero"),
        ("mean_pressure", one, "Pa", "mean pressure, zeros included"),
        ("quantile", given, "Pa", "quantiles of the pressure given contact"),
        ("controlled_mean_pressure", one, "Pa", "mean pressure, with an expansion of it as control variate"),
    )
    levels, rows = [], []
    for number, mean in enumerate(means):
        nodes = np.ascontiguousarray(pressure[:, number])
        levels.append(choose_levels(nodes.astype(np.float64)))
        share, error = cumulative_shares(nodes, levels[-1])
        quantiles = quantiles_given_contact(nodes, np.array(PROBABILITIES))
        rows.append(((share, error), (1.0 - share[0], error[0]), clustered_mean(nodes), quantiles, mean))
    found = {
        "level": store.Variable(table, np.array(levels), "Pa", "levels from zero to the largest pressure"),
        "probability": store.Variable(("probability",), np.array(PROBABILITIES), "1", "probabilities of the quantiles"),
        "percentile": store.Variable(one, percentiles, "percent", "penetration"),
        "surfaces": store.Variable((), len(pressure), "1", "surfaces that were solved"),
        "nodes": store.Variable((), pressure.shape[2], "1", "nodes of a surface whose pressure counts"),
    }
    for (name, dimensions, units, title), column in zip(numbers, zip(*rows, strict=True), strict=True):
        values, errors = (np.array(part) for part in zip(*column, strict=True))
        found[name] = store.Variable(dimensions, values, units, title)
        found[f"{name}_standard_error"] = store.Variable(dimensions, errors, units, f"standard error of {name}")
    return found


def gather_surfaces(configuration: Values, batches: Sequence[Mapping[str, np.ndarray]]) -> dict[str, store.Variable]:
    """Return the reference of all surfaces."""
    pressure, gap = (np.concatenate([batch[name] for batch in batches]) for name in ("pressure", "gap"))
    return describe_pressure(pressure, batches[0]["percentile"], controlled_means(configuration, pressure, gap))


if __name__ == "__main__":
    run_command(__doc__, solve_surfaces, gather_surfaces)
