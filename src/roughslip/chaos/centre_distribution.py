"""Distributions of the pressure at the centre from samples and from expansions, each with its interval.

The paper calls p_x "the pressure when contact occurs". It fits eqs. (8) and (9) to the samples in contact, and takes
the probability of contact from K/K_t. So the variables of these expansions are those of surfaces in contact, and they
are not Gaussian. Drawn over all surfaces, which are Gaussian, they fail.

The distance of a sampled distribution F_n from a reference G has a 95 % interval from sampling alone. Its lower end
follows from Kolmogorov's bound on sup |F_n - F|. Its upper end is the normal error at the pressure where |F - G| is
largest, because the estimated distance is at least the one there. Intervals of eqs. (8) and (9) are Student's, of
independent designs; those of our expansion come from the jackknife over groups of its surfaces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import special

from roughslip.chaos.hermite import multi_indices, terms_at
from roughslip.chaos.local import LocalExpansion, jackknife_deviations
from roughslip.chaos.pressure import fit_in_contact
from roughslip.chaos.regression import Fit
from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability.estimate import NORMAL_95, TAILS, student_95, wilson_interval

BLOCK = 20_000  # draws evaluated at a time
BLOCKS = 5  # of draws of each design and of each left-out fit: 16 draws in contact below a probability of 0.001
REPLICATES = 200
KOLMOGOROV_975 = 1.480  # 97.5 % quantile of the Kolmogorov distribution: sqrt(n) sup |F_n - F|
LARGEST_LOGARITHM = 300.0  # of p / Pa: the cubic of eq. (9) has no mean, and its exponential would overflow
TAIL = (1e-3, 1e-1)  # what counts as low probabilities
SETTLED = 200  # surfaces in contact below a pressure, whose probability is then known to 14 %
FEWEST_BELOW = 5  # samples in contact of one design below the least probability that is compared with it
NOTHING = (np.nan, np.nan, np.nan)
Row = tuple[Any, Any, Any]  # value, low, high


def share_up_to(contact: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """F : (n,) [-] share of pressures : (K,) [Pa], ascending, up to each level : (n,) [Pa]."""
    return np.searchsorted(contact, levels, side="right") / len(contact)


def quantile_levels(pressure: np.ndarray) -> np.ndarray:
    """Levels for the plot of a distribution, dense in both tails.

    pressure : (...) [Pa] samples, finite, zero out of contact

    Returns levels : [Pa] ascending quantiles of the positive pressures, from 1e-4 to 1 - 1e-4. Raises as `in_contact`.
    """
    tail = np.geomspace(1e-4, 0.5, 120)
    probabilities = np.concatenate([tail, 1.0 - tail[::-1]])
    return np.unique(np.quantile(in_contact(pressure), probabilities))


def in_contact(pressure: np.ndarray) -> np.ndarray:
    """Positive pressures : (K,) [Pa] ascending; an infinite one, of a poor fit of eq. (9), exceeds every level.

    Raises ParameterError for NaN, IllPosedError where no sample is in contact.
    """
    if np.isnan(pressure).any():
        raise ParameterError("pressures must not be NaN")
    positive = pressure[pressure > 0]
    if positive.size == 0:
        raise IllPosedError(
            "no sample is in contact: take more samples or a deeper penetration",
            scene_keys="square.monte_carlo_samples",
        )
    return np.sort(positive, axis=None)


@dataclass(frozen=True)
class Equation:
    """Eq. (8), or eq. (9) with a logarithm, fitted to the samples in contact of each design.

    logarithm : whether log p is expanded
    indices : (P, variables) exponents
    fits : of the designs
    """

    logarithm: bool
    indices: np.ndarray
    fits: tuple[Fit, ...]

    def pressure(self, variables: np.ndarray) -> np.ndarray:
        """p : (designs, n) [Pa] at variables : (n, v)."""
        values = np.stack([fit.coefficients for fit in self.fits]) @ terms_at(variables, self.indices).T
        if self.logarithm:
            return np.asarray(np.exp(np.clip(values, -LARGEST_LOGARITHM, LARGEST_LOGARITHM)))
        return np.maximum(values, 0.0)

    def draw(self, seed: list[int]) -> np.ndarray:
        """p : (designs, BLOCKS BLOCK) [Pa] at independent draws of the variables, the same for every equation."""
        shape = BLOCK, self.indices.shape[1]
        draws = (np.random.default_rng([*seed, number]).standard_normal(shape) for number in range(BLOCKS))
        return np.concatenate([self.pressure(block) for block in draws], axis=1)


def fit_equation(
    variables: Sequence[np.ndarray], pressures: Sequence[np.ndarray], degree: int, *, logarithm: bool
) -> Equation:
    """Fit eq. (8), or eq. (9) with `logarithm`, to each design.

    variables, pressures : of each design (K, v) [-] and (K,) [Pa] at the centre
    degree : total degree of the expansion

    Raises IllPosedError as `fit_in_contact`, with the number of the design.
    """
    indices, fits = multi_indices(variables[0].shape[1], degree), []
    for number, (xi, pressure) in enumerate(zip(variables, pressures, strict=True), start=1):
        try:
            fits.append(fit_in_contact(terms_at(xi, indices), pressure, logarithm=logarithm))
        except IllPosedError as error:
            raise IllPosedError(f"design {number} of {len(variables)}: {error}", error.scene_keys) from error
    return Equation(logarithm, indices, tuple(fits))


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
        return share_up_to(self.in_contact, self.levels)

    @cached_property
    def in_contact(self) -> np.ndarray:
        """Positive pressures : (K,) [Pa], ascending."""
        return in_contact(self.pressure)

    @property
    def tail_from(self) -> float:
        """The least of the low probabilities that the samples of the reference resolve."""
        return max(TAIL[0], SETTLED / self.contacts)

    def tail_error(self, first: np.ndarray, second: np.ndarray) -> float:
        """Largest |log10 F_1 / F_2| where the reference lies between tail_from and 0.1; NaN where it resolves none.

        No probability counts as smaller than one in a block of draws, below which it is not known.
        """
        tail = (self.cumulative >= self.tail_from) & (self.cumulative <= TAIL[1])
        first_tail, second_tail = (np.maximum(curve[tail], 1 / BLOCK) for curve in (first, second))
        return float(np.max(np.abs(np.log10(first_tail / second_tail)))) if tail.any() else float("nan")


def distance(first: np.ndarray, second: np.ndarray) -> float:
    """Kolmogorov distance of two samples in ascending order.

    It is the largest share of the shorter one up to a value, less that of the longer one, or the reverse below it.
    """
    short, long = sorted((first, second), key=len)
    ranks = np.arange(len(short) + 1) / len(short)
    above = ranks[1:] - np.searchsorted(long, short, side="right") / len(long)
    below = np.searchsorted(long, short, side="left") / len(long) - ranks[:-1]
    return float(max(above.max(), below.max()))


def from_equal_moments(contact: np.ndarray) -> dict[str, float]:
    """By name the distances of pressures : (K,), ascending, from a normal and a uniform of equal mean and deviation."""
    z, ranks = (contact - contact.mean()) / (contact.std() or 1.0), np.arange(len(contact) + 1) / len(contact)
    models = {"normal": special.ndtr(z), "uniform": np.clip(0.5 + z / np.sqrt(12.0), 0.0, 1.0)}
    far = {name: max(np.max(ranks[1:] - one), np.max(one - ranks[:-1])) for name, one in models.items()}
    return {f"distance_to_{name}": float(one) for name, one in far.items()}


def sampled_rows(pressure: np.ndarray, independent: int, reference: Reference) -> dict[str, Row]:
    """The rows of a sampled method with so many independent samples."""
    share = float(np.mean(pressure > 0))
    contacts = share * independent
    contact = in_contact(pressure)
    curve = share_up_to(contact, reference.levels)
    band = wilson_interval(curve * contacts, contacts)
    probability = wilson_interval(contacts, independent)
    apart = distance(contact, reference.in_contact)
    root = np.sqrt(1 / contacts + 1 / reference.contacts)
    low, high = apart - KOLMOGOROV_975 * root, apart + NORMAL_95 / 2 * root
    return {
        "cumulative": (curve, *band),
        "contact_probability": (share, float(probability[0]), float(probability[1])),
        "distance_in_contact": (apart, max(low, 0.0), min(high, 1.0)),
    }


def expanded_rows(
    expansion: LocalExpansion, pressure: np.ndarray, edges: EdgeCorrection, seed: list[int], reference: Reference
) -> dict[str, Row]:
    """The rows of our expansion.

    pressure : (n,) [Pa] drawn from it, with the mesh error at edges taken off
    edges : of that error

    By the triangle inequality, a refit changes a distance by at most its own distance from the fit (Bickel and Krieger
    1989). The interval extends to either side by the 95 % quantile of that, and by the error of the reference.
    """
    moved, share_error = changes_by_refits(expansion, edges, seed, reference.levels)
    contact, share = in_contact(pressure), float(np.mean(pressure > 0))
    curve = share_up_to(contact, reference.levels)
    curves = np.clip(curve + moved, 0.0, 1.0)
    apart, tail = distance(contact, reference.in_contact), reference.tail_error(curve, reference.cumulative)
    error = NORMAL_95 / np.sqrt(reference.contacts)
    far = np.quantile(np.max(np.abs(moved), axis=1), 0.95) + error / 2
    far_tail = np.quantile([reference.tail_error(replicate, curve) for replicate in curves], 0.95)
    far_tail += error / np.log(10) / np.sqrt(reference.tail_from)
    return {
        "cumulative": (curve, *np.quantile(curves, TAILS, axis=0)),
        "contact_probability": (share, share - NORMAL_95 * share_error, share + NORMAL_95 * share_error),
        "distance_in_contact": (apart, max(apart - far, 0.0), min(apart + far, 1.0)),
        "tail_error": (tail, max(tail - far_tail, 0.0), tail + far_tail),
    }


def changes_by_refits(
    expansion: LocalExpansion, edges: EdgeCorrection, seed: list[int], levels: np.ndarray
) -> tuple[np.ndarray, float]:
    """Changes of our expansion, with the mesh error at edges taken off, by the scatter of its samples.

    Returns the distribution given contact of REPLICATES simulated refits minus that of the fit (R, levels), and the
    standard error of its contact probability. Both are from the jackknife, with groups multiplied by normal numbers.
    Raises IllPosedError where the expansion without one of the groups is never in contact.
    Method: Kline and Santos, J. Econom. Methods 1 (2012) 23.
    """
    drawn = expansion.draw(np.random.default_rng(seed), BLOCKS * BLOCK, left_out=True)
    pressures = np.stack([edges.without(group).apply(row) for group, row in enumerate(drawn[1:])])
    curves = np.stack([share_up_to(in_contact(pressure), levels) for pressure in pressures])
    multipliers = np.random.default_rng([*seed, BLOCKS]).standard_normal((REPLICATES, len(pressures)))
    shares = jackknife_deviations(np.mean(pressures > 0, axis=1))
    return multipliers @ jackknife_deviations(curves), float(np.sqrt(np.sum(shares**2)))


def drawn_rows(contacts: Sequence[np.ndarray], reference: Reference) -> dict[str, Row]:
    """The rows of an equation that was drawn over all surfaces; they lack the probability of contact, which is K/K_t.

    contacts : of each design (K,) [Pa] ascending, of the draws in contact

    Distances are means over the designs, with Student's interval of their scatter and the error of the reference. The
    distribution is that of the first design, its band reaches over all.
    """
    curves = np.array([share_up_to(contact, reference.levels) for contact in contacts])
    error = NORMAL_95 / np.sqrt(reference.contacts)
    tails = np.array([reference.tail_error(curve, reference.cumulative) for curve in curves])
    distances = np.array([distance(contact, reference.in_contact) for contact in contacts])
    return {
        "cumulative": (curves[0], curves.min(axis=0), curves.max(axis=0)),
        "distance_in_contact": mean_over_designs(distances, error / 2),
        "tail_error": mean_over_designs(tails, error / np.log(10) / np.sqrt(reference.tail_from)),
    }


def given_rows(
    contacts: Sequence[np.ndarray], surfaces: int, designs: Sequence[np.ndarray], solved: Reference, tail_from: float
) -> dict[str, Row]:
    """The rows of an equation at solved surfaces in contact that no fit has seen.

    contacts : of each design (K,) [Pa] ascending, of its fit at those of so many surfaces where it is positive
    designs : (samples,) [Pa] that were fitted, of each design
    tail_from : least of the low probabilities, from `resolved_by_designs`
    """
    curves = np.array([share_up_to(contact, solved.levels) for contact in contacts])
    ratios = []
    for curve, design in zip(curves, designs, strict=True):
        sampled = share_up_to(in_contact(design), solved.levels)
        low = (sampled >= tail_from) & (sampled <= TAIL[1])
        ratio = np.log10(np.maximum(curve[low], 0.5 / surfaces) / sampled[low])
        ratios.append(np.max(np.abs(ratio), initial=0.0) if low.any() else np.nan)
    distances = np.array([distance(contact, solved.in_contact) for contact in contacts])
    error = NORMAL_95 / 2 * np.sqrt(1 / solved.contacts + 1 / surfaces)
    error_in_tail = NORMAL_95 / np.log(10) / np.sqrt(tail_from * surfaces)
    return {
        "cumulative": (curves[0], curves.min(axis=0), curves.max(axis=0)),
        "distance": mean_over_designs(distances, float(error)),
        "tail_error_of_design": mean_over_designs(np.array(ratios), float(error_in_tail)),
    }


def resolved_by_designs(designs: Sequence[np.ndarray]) -> float:
    """The least of the low probabilities that are compared: that which FEWEST_BELOW samples of one design give."""
    return max(TAIL[0], FEWEST_BELOW / min(np.count_nonzero(pressure) for pressure in designs))


def between(contacts: Mapping[str, Sequence[np.ndarray]], error: float = 0.0) -> Row:
    """Kolmogorov distance given contact of two equations at the same variables; NaN where one of them was refused.

    contacts : by name of each design (K,) [Pa] ascending
    """
    if len(contacts) != 2:
        return NOTHING
    return mean_over_designs(np.array([distance(*pair) for pair in zip(*contacts.values(), strict=True)]), error)


def mean_over_designs(values: np.ndarray, error: float = 0.0) -> Row:
    """Mean of a number over two or more designs with its 95 % interval, which an independent error widens."""
    mean = float(values.mean())
    half = float(student_95(len(values))) * float(values.std(ddof=1)) / np.sqrt(len(values))
    half = float(np.hypot(half, error))
    return mean, max(mean - half, 0.0), mean + half
