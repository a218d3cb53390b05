"""The mean pressure at the centre from the same solves, better known: with an expansion as its control variate.

Where one surface in twenty is in contact at its centre, the mean pressure of 400 000 surfaces is known to 0.75 %. An
expansion c, fitted to a few surfaces, follows the pressure p of all others, and its own mean E c is an integral over a
few normal variables. So over the others

    mean = <p> - b (<c> - E c),   b = cov(p, c) / var(c),

which is right whatever the expansion is worth, and errs by the share of p that c does not follow (P. Glasserman, Monte
Carlo Methods in Financial Engineering, 2004, section 4.1; b is fitted to the same surfaces, a bias of order 1/K).
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.chaos.designs import sobol_places
from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.errors import InputError
from roughslip.stages.from_scene import expansion, geometry, surface_model
from roughslip.stages.from_scene.nodes import central_nodes
from roughslip.surface.karhunen_loeve import karhunen_loeve
from workflow.references.pressure_solves import variables

VARIABLES, DEGREE, TARGET = 8, 3, "squared_pressure"
FITTED = 10_000  # surfaces that the expansion is fitted to, which take no part in the mean
STREAM = 24  # the second entry of the seeds of E c, as in `pressure_solves`
SCRAMBLES, POINTS = 32, 2**16  # independent Sobol sequences for E c, and the length of each
BLOCK = 50_000  # surfaces evaluated at a time


def controlled_mean(pressure: np.ndarray, control: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Mean of pressure : (K,) and its standard error, by control : (K,) with independent estimates of its mean."""
    covariance = np.cov(pressure, control)
    slope = covariance[0, 1] / covariance[1, 1]
    mean = pressure.mean() - slope * (control.mean() - expected.mean())
    left = covariance[0, 0] - slope * covariance[0, 1]
    variance = left / len(pressure) + slope**2 * expected.var(ddof=1) / len(expected)
    return float(mean), float(np.sqrt(variance))


def controlled_means(
    configuration: geometry.Configuration, pressure: np.ndarray, gap: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean pressure and its standard error : (penetrations,) [Pa].

    configuration : of the solves
    pressure, gap : (surfaces, penetrations, central nodes) [Pa], [m] of their first samples

    Raises InputError for fewer than twice FITTED surfaces.
    """
    if len(pressure) < 2 * FITTED:
        raise InputError([f"the expansion that controls a mean takes {FITTED} surfaces: gather {2 * FITTED} at least"])
    model, grid = surface_model.gaussian_model(configuration), geometry.square_grid(configuration)
    order, share = (configuration["square"].get(name) for name in ("modes", "variance_share"))
    modes, nodes = karhunen_loeve(model.covariance, grid, order, share=share).modes, central_nodes(model, grid)
    directions, odd = expansion.directions(model, grid, modes, nodes, VARIABLES)
    (target,) = expansion.targets({**configuration, "expansion": {"target": TARGET}}, model, grid)
    seed = configuration["seed"]

    def local(first: int, last: int) -> np.ndarray:
        xi = np.array([variables(seed, number, len(modes)) for number in range(first, last)])
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
            controls[level].append(_mean_over_nodes(found[level], part))
    means = []
    for level in levels:
        observed = pressure[FITTED:, level].mean(axis=1, dtype=np.float64)
        means.append(controlled_mean(observed, np.concatenate(controls[level]), _expected(found[level], seed)))
    mean, error = np.array(means).T
    return mean, error


def _mean_over_nodes(one: LocalExpansion, values: np.ndarray) -> np.ndarray:
    """(K,) [Pa] at variables : (K, nodes, v)."""
    return one.mean_pressure_at(values.reshape(-1, values.shape[2])).reshape(values.shape[:2]).mean(axis=1)


def _expected(one: LocalExpansion, seed: int) -> np.ndarray:
    """(SCRAMBLES,) [Pa] independent estimates of the mean of an expansion."""
    generators = (np.random.default_rng([seed, STREAM, number]) for number in range(SCRAMBLES))
    points = (ndtri(sobol_places(generator, POINTS, VARIABLES)) for generator in generators)
    return np.array([one.mean_pressure_at(normal).mean() for normal in points])
