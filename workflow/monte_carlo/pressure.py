"""The Monte Carlo reference of the pressure at the centre of a scene's square, at three penetrations.

A sample is one surface, its Karhunen-Loeve variables from default_rng([seed, STREAM, number]), solved at every
penetration. Batches hold pressure and gap of the four central nodes, in the order of `geometry.central_nodes`: falling
number along x, and for each of these falling number along y.

The four central nodes of a surface have one distribution but are not independent. So every standard error takes the sum
over a surface as one observation (clusters). A share given contact is the ratio of two such sums (W. G. Cochran,
Sampling Techniques, 1977, section 2.11). The error of a quantile is half the difference of the quantiles at its
probability plus and minus the standard error there (R. S. Woodruff, J. Am. Stat. Assoc. 47 (1952) 635).

The mean pressure is kept twice: the mean of the solves, and with an expansion as control variate. Where one surface in
twenty is in contact at its centre, the mean of 400 000 surfaces is known to 0.75 %. An expansion c, fitted to the first
surfaces, follows the pressure p of all others, and its own mean E c is an integral over a few normal variables. Over
the others

    mean = <p> - b (<c> - E c),   b = cov(p, c) / var(c),

which is unbiased for any expansion, and whose error is the part of p that c does not follow (P. Glasserman, Monte Carlo
Methods in Financial Engineering, 2004, section 4.1; b is fitted to the same surfaces, a bias of order 1/K).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import ndtri

from roughslip import store
from roughslip.chaos.designs import sobol_places
from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.contact.solve import sweep
from roughslip.errors import InputError
from roughslip.scene.mistakes import Values
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene import elastic, expansion, geometry, surface_model
from roughslip.stages.from_scene.geometry import central_nodes
from roughslip.surface.karhunen_loeve import heights, karhunen_loeve
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


# Solves.


def draw_variables(seed: int, number: int, modes: int) -> np.ndarray:
    """Return the standard normal xi (modes,) of one sample."""
    return np.random.default_rng([seed, STREAM, number]).standard_normal(modes)


def solve_centre(configuration: Values, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Return pressure [Pa] and gap [m] (samples, penetrations, central nodes) of samples first ... last - 1."""
    scene = scene_of(configuration)
    model, grid = surface_model.gaussian_model(scene), geometry.square_grid(scene)
    modes = karhunen_loeve(model.covariance, grid, scene.square.modes, share=scene.square.variance_share).modes
    planes = np.array([float(model.plane_height(percentile)) for percentile in PERCENTILES])
    hardness = elastic.hardness_pa(scene)
    influence, nodes = elastic.influence(scene, grid), central_nodes(model.lengths_m, grid)
    shape = (last - first, len(planes), len(nodes.x))
    pressure, gap = np.empty(shape, dtype=KEPT), np.empty(shape, dtype=KEPT)
    for row, number in enumerate(range(first, last)):
        z = model.heights(heights(modes, draw_variables(scene.seed, number, len(modes))))
        for level, solution in enumerate(sweep(influence, z, planes, TOLERANCE, hardness_pa=hardness)):
            pressure[row, level] = solution.pressure[nodes.x, nodes.y]
            gap[row, level] = solution.signed_gap[nodes.x, nodes.y]
    return pressure, gap


def solve_surfaces(configuration: Values, first: int, last: int) -> dict[str, store.Variable]:
    """Solve surfaces first ... last - 1."""
    pressure, gap = solve_centre(configuration, first, last)
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
    """Return quantiles [Pa] of the positive ones among pressures (surfaces, nodes), and their standard errors."""
    positive = np.sort(pressure[pressure > 0].astype(np.float64))
    found = np.quantile(positive, probabilities)
    contacts = np.count_nonzero(pressure > 0, axis=1)
    halves = np.empty(len(found))
    for place, (level, probability) in enumerate(zip(found, probabilities, strict=True)):
        below = np.count_nonzero((pressure > 0) & (pressure <= level), axis=1)
        error = np.sqrt(np.sum((below - probability * contacts) ** 2.0)) / contacts.sum()
        ends = np.quantile(positive, np.clip([probability - error, probability + error], 0.0, 1.0))
        halves[place] = 0.5 * (ends[1] - ends[0])
    return found, halves


def describe_pressure(pressure: np.ndarray, percentiles: np.ndarray) -> dict[str, store.Variable]:
    """Return distribution, means and quantiles of pressures (surfaces, penetrations, nodes) [Pa].

    Raises InputError for a penetration without contact or with fewer than two surfaces.
    """
    if len(pressure) < 2 or not (pressure > 0).any(axis=(0, 2)).all():
        raise InputError(["a reference needs two surfaces and contact at every penetration: gather more surfaces"])
    probabilities, rows = np.array(PROBABILITIES), []
    for number in range(len(percentiles)):
        nodes = np.ascontiguousarray(pressure[:, number])
        levels = choose_levels(nodes.astype(np.float64))
        shares = cumulative_shares(nodes, levels)
        contact = 1.0 - shares[0][0], shares[1][0]
        rows.append((levels, *shares, *contact, *clustered_mean(nodes), *quantiles_given_contact(nodes, probabilities)))
    table, one, given = ("penetration", "level"), ("penetration",), ("penetration", "probability")
    of = "standard error of the "
    described = (
        ("level", table, "Pa", "levels of the distribution, from zero to the largest pressure"),
        ("cumulative", table, "1", "share of the pressures that are at most the level, zeros included"),
        ("cumulative_standard_error", table, "1", of + "share, by surfaces"),
        ("contact_probability", one, "1", "share of the pressures above zero"),
        ("contact_probability_standard_error", one, "1", of + "contact probability, by surfaces"),
        ("mean_pressure", one, "Pa", "mean pressure, zeros included"),
        ("mean_pressure_standard_error", one, "Pa", of + "mean pressure, by surfaces"),
        ("quantile", given, "Pa", "quantiles of the pressure given contact"),
        ("quantile_standard_error", given, "Pa", of + "quantiles, by surfaces"),
    )
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    found = {
        name: store.Variable(dimensions, column, units, title)
        for (name, dimensions, units, title), column in zip(described, columns, strict=True)
    }
    found["probability"] = store.Variable(("probability",), probabilities, "1", "probabilities of the quantiles")
    found["percentile"] = store.Variable(one, percentiles, "percent", "penetration")
    found["surfaces"] = store.Variable((), len(pressure), "1", "surfaces that were solved")
    found["nodes"] = store.Variable((), pressure.shape[2], "1", "nodes of a surface whose pressure counts")
    return found


# The mean with a control variate.


def controlled_mean(pressure: np.ndarray, control: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Return the mean of pressure (K,) and its standard error.

    control : (K,) the control variate
    expected : independent estimates of its mean
    """
    covariance = np.cov(pressure, control)
    slope = covariance[0, 1] / covariance[1, 1]
    mean = pressure.mean() - slope * (control.mean() - expected.mean())
    left = covariance[0, 0] - slope * covariance[0, 1]
    variance = left / len(pressure) + slope**2 * expected.var(ddof=1) / len(expected)
    return float(mean), float(np.sqrt(variance))


def controlled_means(configuration: Values, pressure: np.ndarray, gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean pressure and its standard error (penetrations,) [Pa], with an expansion as control variate.

    configuration : of the solves
    pressure, gap : (surfaces, penetrations, central nodes) [Pa], [m] of their first samples

    Raises InputError for fewer than twice FITTED surfaces.
    """
    if len(pressure) < 2 * FITTED:
        raise InputError([f"the expansion that controls a mean takes {FITTED} surfaces: gather {2 * FITTED} at least"])
    scene = scene_of(configuration)
    model, grid = surface_model.gaussian_model(scene), geometry.square_grid(scene)
    order, share = (configuration["square"].get(name) for name in ("modes", "variance_share"))
    modes = karhunen_loeve(model.covariance, grid, order, share=share).modes
    nodes = central_nodes(model.lengths_m, grid)
    directions, odd = expansion.directions(model, grid, modes, nodes, VARIABLES)
    (target,) = expansion.targets(scene_of({**configuration, "expansion": {"target": TARGET}}), model, grid)
    seed = scene.seed

    def local(first: int, last: int) -> np.ndarray:
        xi = np.array([draw_variables(seed, number, len(modes)) for number in range(first, last)])
        return np.einsum("km,nvm->knv", xi, directions)

    levels, fitted = range(pressure.shape[1]), local(0, FITTED)
    found = []
    for level in levels:
        solved = pressure[:FITTED, level].astype(np.float64)
        open_gap = np.where(solved > 0, 0.0, gap[:FITTED, level])
        found.append(fit_local(Samples(fitted, nodes.distance2, solved, open_gap, odd), DEGREE, target))
    controls = [[] for _ in levels]
    for first in range(FITTED, len(pressure), BLOCK):
        part = local(first, min(first + BLOCK, len(pressure)))
        for level in levels:
            values = found[level].mean_pressure_at(part.reshape(-1, part.shape[2]))
            controls[level].append(values.reshape(part.shape[:2]).mean(axis=1))
    means = []
    for level in levels:
        observed = pressure[FITTED:, level].mean(axis=1, dtype=np.float64)
        expected = _expected_pressures(found[level], seed)
        means.append(controlled_mean(observed, np.concatenate(controls[level]), expected))
    mean, error = np.array(means).T
    return mean, error


def _expected_pressures(one: LocalExpansion, seed: int) -> np.ndarray:
    """Return independent estimates (SCRAMBLES,) [Pa] of the mean of an expansion."""
    generators = (np.random.default_rng([seed, CONTROL_STREAM, number]) for number in range(SCRAMBLES))
    points = (ndtri(sobol_places(generator, POINTS, VARIABLES)) for generator in generators)
    return np.array([one.mean_pressure_at(normal).mean() for normal in points])


def gather_surfaces(configuration: Values, batches: Sequence[Mapping[str, np.ndarray]]) -> dict[str, store.Variable]:
    """Return the reference of all surfaces."""
    pressure, gap = (np.concatenate([batch[name] for batch in batches]) for name in ("pressure", "gap"))
    found = describe_pressure(pressure, batches[0]["percentile"])
    mean, error = controlled_means(configuration, pressure, gap)
    title = "mean pressure, zeros included, with an expansion of it as control variate"
    found["controlled_mean_pressure"] = store.Variable(("penetration",), mean, "Pa", title)
    title = "standard error of the " + title
    found["controlled_mean_pressure_standard_error"] = store.Variable(("penetration",), error, "Pa", title)
    return found


if __name__ == "__main__":
    run_command(__doc__, solve_surfaces, gather_surfaces)
