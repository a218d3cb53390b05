"""Distributions of the pressure at the centre from samples and from expansions, each with its interval.

The distance of a sampled distribution F_n from a reference G has a 95 % interval from sampling alone. Its lower end
follows from Kolmogorov's bound on sup |F_n - F|. Its upper end is the normal error at the pressure where |F - G| is
largest, because the estimated distance is at least the one there. The interval of an expansion comes from its refits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.local import LocalExpansion, jackknife_deviations
from roughslip.chaos.pressure import fit_in_contact
from roughslip.chaos.regression import Fit, wild_coefficients
from roughslip.chaos.sampling import cumulative_given_contact, kolmogorov_distance
from roughslip.errors import IllPosedError
from roughslip.probability.estimate import NORMAL_95, TAILS, student_95, wilson_interval

SAMPLED = ("monte_carlo", "latin_hypercube")
EXPANDED = ("equation_8", "equation_9", "roughslip")
METHODS = (*SAMPLED, *EXPANDED)
BLOCK = 20_000  # draws evaluated at a time
REFIT_BLOCKS = 5  # on which refits are held against the fit: 16 draws in contact below a probability of 0.001
REPLICATES = 200
KOLMOGOROV_975 = 1.480  # 97.5 % quantile of the Kolmogorov distribution: sqrt(n) sup |F_n - F|
LARGEST_LOGARITHM = 300.0  # of p / Pa: the cubic of eq. (9) has no mean, and its exponential would overflow
TAIL = (1e-3, 1e-1)  # what counts as low probabilities
SETTLED = 200  # surfaces in contact below a pressure, whose probability is then known to 14 %
ROWS = {
    "cumulative": "distribution given contact",
    "contact_probability": "probability of contact at the centre; that of an expansion has the scatter of its fit, not "
    "the truncation of its series, for interval",
    "distance_in_contact": "Kolmogorov distance given contact, of Latin hypercube from Monte Carlo and of an expansion "
    "from both",
    "tail_error": "largest |log10| of the ratio to these samples where they lie between tail_from and 0.1",
}
Row = tuple[Any, Any, Any]  # value, low, high


@dataclass(frozen=True)
class Expansion:
    """Eq. (8) or (9) of the pressure at the centre, and the samples behind it.

    method : "equation_8" or "equation_9"
    basis : (K, P) terms at its samples
    pressure : (K,) [Pa] at the centre
    indices : (P, variables) exponents
    """

    method: str
    basis: np.ndarray
    pressure: np.ndarray
    indices: np.ndarray

    def fit(self) -> Fit:
        """Coefficients. Raises IllPosedError as the regression does."""
        return fit_in_contact(self.basis, self.pressure, logarithm=self.method == "equation_9")

    def regression(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """basis, target and weights of the samples that enter the fit."""
        contact = self.pressure > 0
        values = self.pressure[contact]
        return self.basis[contact], np.log(values) if self.method == "equation_9" else values, np.ones(len(values))

    def at(self, basis: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """p : (draws, ...) [Pa] from basis : (draws, P) and coefficients : (P, ...)."""
        values = basis @ coefficients
        if self.method == "equation_9":
            return np.exp(np.clip(values, -LARGEST_LOGARITHM, LARGEST_LOGARITHM))
        return np.maximum(values, 0.0)


def draw(expansion: Expansion, coefficients: np.ndarray, count: int, seed: list[int]) -> np.ndarray:
    """p : (count,) [Pa] at independent draws of the variables, block by block; the same draws for every expansion."""
    return np.concatenate(
        [
            expansion.at(_block(expansion.indices, seed, number)[: count - first], coefficients)
            for number, first in enumerate(range(0, count, BLOCK))
        ]
    )


def _block(indices: np.ndarray, seed: list[int], number: int) -> np.ndarray:
    draws = np.random.default_rng([*seed, number]).standard_normal((BLOCK, indices.shape[1]))
    return hermite_basis(draws, indices)


def refits(expansion: Expansion, fit: Fit, levels: np.ndarray, seed: list[int], signs_seed: list[int]) -> np.ndarray:
    """What the scatter of its samples does to an expansion: refits less the fit, on the same draws.

    Returns the distribution given contact (R, levels). Expansions with the same samples and signs_seed have the same
    signs. Raises IllPosedError where a refit is never in contact.
    """
    basis, values, weights = expansion.regression()
    signs = np.random.default_rng(signs_seed).choice([-1.0, 1.0], (len(values), REPLICATES))
    coefficients = np.column_stack([fit.coefficients, wild_coefficients(basis, values, weights, signs)])
    below, contacts = np.zeros((1 + REPLICATES, len(levels))), np.zeros(1 + REPLICATES)
    for number in range(REFIT_BLOCKS):
        pressures = np.sort(expansion.at(_block(expansion.indices, seed, number), coefficients), axis=0)
        out_of_contact = BLOCK - np.count_nonzero(pressures, axis=0)
        contacts += BLOCK - out_of_contact
        for row, pressure in enumerate(pressures.T):
            below[row] += np.searchsorted(pressure, levels, side="right") - out_of_contact[row]
    if not contacts.all():
        raise IllPosedError(
            f"{expansion.method}: a refit to {len(values)} samples is never in contact: take more samples or a deeper "
            "penetration; scene keys: square.latin_hypercube_samples, square.penetration_percentile"
        )
    curves = below / contacts[:, None]
    return curves[1:] - curves[0]


@dataclass(frozen=True)
class EdgeCorrection:
    """What the mesh error at edges of contacts does to the pressure at nodes, from solves of both.

    cells, points : (K, nodes) [Pa] mean pressures of cells, and pressures without that error
    group : (K,) of each surface, as of the expansion that is trained on these solves
    """

    cells: np.ndarray
    points: np.ndarray
    group: np.ndarray

    def without(self, group: int) -> EdgeCorrection:
        """The same from the other groups of surfaces."""
        others = self.group != group
        return EdgeCorrection(self.cells[others], self.points[others], self.group[others])

    def apply(self, pressure: np.ndarray) -> np.ndarray:
        """Pressures : (...) [Pa] of the distribution of points, from draws of that of cells : (...) [Pa].

        Quantiles of one go to those of the other, linearly between them; a monotone map keeps the order of draws.
        """
        count = np.count_nonzero(self.cells)
        cells, points = (np.sort(pressures, axis=None)[-count:] for pressures in (self.cells, self.points))
        moved = pressure + np.interp(pressure, cells, points - cells)
        return np.where(pressure > 0, np.maximum(moved, 0.0), 0.0)

    def contact(self) -> Row:
        """Contact probability of points over that of cells, with its 95 % interval from the scatter over surfaces."""
        cells, points = (np.count_nonzero(pressures, axis=1) for pressures in (self.cells, self.points))
        ratio = float(points.sum() / cells.sum())
        half = NORMAL_95 * float(np.sqrt(np.sum((points - ratio * cells) ** 2.0)) / cells.sum())
        return ratio, ratio - half, ratio + half

    def distance(self) -> float:
        """Kolmogorov distance given contact of points from cells."""
        return kolmogorov_distance(self.points[self.points > 0], self.cells[self.cells > 0])


def moved_local(
    expansion: LocalExpansion, levels: np.ndarray, seed: list[int], edges: EdgeCorrection
) -> tuple[np.ndarray, float]:
    """Changes of the local expansion, with the mesh error at edges taken off, by the scatter of its samples.

    Returns the distribution given contact of REPLICATES simulated refits minus that of the fit (R, levels), and the
    standard error of its contact probability. Both are from the jackknife, with groups multiplied by normal numbers.
    Raises IllPosedError where the expansion without one of the groups is never in contact.
    Method: Kline and Santos, J. Econom. Methods 1 (2012) 23.
    """
    drawn = expansion.draw(np.random.default_rng(seed), REFIT_BLOCKS * BLOCK, left_out=True)
    pressures = np.stack([edges.without(group).apply(row) for group, row in enumerate(drawn[1:])])
    curves = np.stack([cumulative_given_contact(pressure, levels) for pressure in pressures])
    multipliers = np.random.default_rng([*seed, REFIT_BLOCKS]).standard_normal((REPLICATES, len(pressures)))
    shares = jackknife_deviations(np.mean(pressures > 0, axis=1))
    return multipliers @ jackknife_deviations(curves), float(np.sqrt(np.sum(shares**2)))


@dataclass(frozen=True)
class Reference:
    """Solved samples, with which distributions are compared.

    pressure : (n,) [Pa]
    surfaces : number of surfaces; central nodes of one are not independent
    levels : (levels,) [Pa] at which distributions are drawn
    """

    pressure: np.ndarray
    surfaces: int
    levels: np.ndarray

    @cached_property
    def contacts(self) -> float:
        """Number of surfaces in contact at their centre."""
        return float(np.mean(self.pressure > 0)) * self.surfaces

    @cached_property
    def cumulative(self) -> np.ndarray:
        """Distribution given contact at the levels."""
        return cumulative_given_contact(self.pressure, self.levels)

    @property
    def tail_from(self) -> float:
        """The least of the low probabilities that the samples of the reference resolve."""
        return max(TAIL[0], SETTLED / self.contacts)

    def distance(self, pressure: np.ndarray) -> float:
        """Kolmogorov distance given contact of p : (n,) [Pa]."""
        return kolmogorov_distance(pressure[pressure > 0], self.pressure[self.pressure > 0])

    def tail_error(self, first: np.ndarray, second: np.ndarray) -> float:
        """Largest |log10 F_1 / F_2| where the reference lies between tail_from and 0.1; NaN where it resolves none.

        No probability counts as smaller than one in a block of draws, below which it is not known.
        """
        tail = (self.cumulative >= self.tail_from) & (self.cumulative <= TAIL[1])
        first_tail, second_tail = (np.maximum(curve[tail], 1 / BLOCK) for curve in (first, second))
        return float(np.max(np.abs(np.log10(first_tail / second_tail)))) if tail.any() else float("nan")


def sampled_rows(pressure: np.ndarray, independent: int, reference: Reference) -> dict[str, Row]:
    """The rows of a sampled method with so many independent samples."""
    share = float(np.mean(pressure > 0))
    contacts = share * independent
    curve = cumulative_given_contact(pressure, reference.levels)
    band = wilson_interval(curve * contacts, contacts)
    probability = wilson_interval(contacts, independent)
    distance = reference.distance(pressure)
    root = np.sqrt(1 / contacts + 1 / reference.contacts)
    low, high = distance - KOLMOGOROV_975 * root, distance + NORMAL_95 / 2 * root
    tail = reference.tail_error(curve, reference.cumulative)
    moved = max(reference.tail_error(end, curve) for end in band)
    return {
        "cumulative": (curve, *band),
        "contact_probability": (share, float(probability[0]), float(probability[1])),
        "distance_in_contact": (distance, max(low, 0.0), min(high, 1.0)),
        "tail_error": (tail, max(tail - moved, 0.0), tail + moved),
    }


def expanded_rows(pressure: np.ndarray, moved: np.ndarray, probability: Row, reference: Reference) -> dict[str, Row]:
    """The rows of an expansion.

    moved : (R, levels) changes of its distribution by refits

    By the triangle inequality, a refit changes a distance by at most its own distance from the fit (Bickel and Krieger
    1989). The interval extends to either side by the 95 % quantile of that, and by the error of the reference.
    """
    curve = cumulative_given_contact(pressure, reference.levels)
    curves = np.clip(curve + moved, 0.0, 1.0)
    distance, tail = reference.distance(pressure), reference.tail_error(curve, reference.cumulative)
    error = NORMAL_95 / np.sqrt(reference.contacts)
    far = np.quantile(np.max(np.abs(moved), axis=1), 0.95) + error / 2
    far_tail = np.quantile([reference.tail_error(replicate, curve) for replicate in curves], 0.95)
    far_tail += error / np.log(10) / np.sqrt(reference.tail_from)
    return {
        "cumulative": (curve, *np.quantile(curves, TAILS, axis=0)),
        "contact_probability": probability,
        "distance_in_contact": (distance, max(distance - far, 0.0), min(distance + far, 1.0)),
        "tail_error": (tail, max(tail - far_tail, 0.0), tail + far_tail),
    }


def design_pressures(designs: list[Expansion], fits: list[Fit], seed: list[int]) -> np.ndarray:
    """p : (designs, REFIT_BLOCKS BLOCK) [Pa] of the fit to each design, at the same draws of the variables."""
    coefficients = np.column_stack([fit.coefficients for fit in fits])
    blocks = [designs[0].at(_block(designs[0].indices, seed, number), coefficients).T for number in range(REFIT_BLOCKS)]
    return np.concatenate(blocks, axis=1)


def designed_rows(pressures: np.ndarray, probability: Row, reference: Reference) -> dict[str, Row]:
    """The rows of an expansion that was fitted to several independent designs.

    pressures : (designs, draws) [Pa]

    Distances are means over the designs, with Student's interval of their scatter and the error of the reference. The
    distribution is that of the first design, its band reaches over all.
    """
    curves = np.array([cumulative_given_contact(pressure, reference.levels) for pressure in pressures])
    error = NORMAL_95 / np.sqrt(reference.contacts)
    tails = np.array([reference.tail_error(curve, reference.cumulative) for curve in curves])
    distances = np.array([reference.distance(pressure) for pressure in pressures])
    return {
        "cumulative": (curves[0], curves.min(axis=0), curves.max(axis=0)),
        "contact_probability": probability,
        "distance_in_contact": mean_over_designs(distances, error / 2),
        "tail_error": mean_over_designs(tails, error / np.log(10) / np.sqrt(reference.tail_from)),
    }


def mean_over_designs(values: np.ndarray, error: float = 0.0) -> Row:
    """Mean of a number over independent designs with its 95 % interval, which an independent error widens."""
    mean = float(values.mean())
    half = float(student_95(len(values))) * float(values.std(ddof=1)) / np.sqrt(len(values))
    half = float(np.hypot(half, error))
    return mean, max(mean - half, 0.0), mean + half


def refused_rows(levels: np.ndarray, probability: Row) -> dict[str, Row]:
    """The rows of an expansion whose fit is ill-posed: NaN, as it has no distribution."""
    nothing = np.full(len(levels), np.nan)
    rows = {"cumulative": (nothing, nothing, nothing), "contact_probability": probability}
    return rows | dict.fromkeys(("distance_in_contact", "tail_error"), (np.nan, np.nan, np.nan))


def apart(first: np.ndarray, second: np.ndarray, moved: dict[str, np.ndarray]) -> Row:
    """Kolmogorov distance of eqs. (8) and (9) given contact, from their pressures and refits to the same samples."""
    distance = kolmogorov_distance(first[first > 0], second[second > 0])
    far = float(np.quantile(np.max(np.abs(moved["equation_8"] - moved["equation_9"]), axis=1), 0.95))
    return distance, max(distance - far, 0.0), min(distance + far, 1.0)
