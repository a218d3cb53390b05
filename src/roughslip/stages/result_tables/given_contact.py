"""Eqs. (8) and (9) at surfaces whose centre is in contact, with K/K_t as the probability of contact.

The paper calls p_x "the pressure when contact occurs". It fits the samples in contact, and takes the probability of
contact from K/K_t. So the variables of the expansions are those of surfaces in contact, and they are not Gaussian. Two
sources give them: solved Monte Carlo surfaces that no fit has seen, and draws that our expansion finds in contact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roughslip import store
from roughslip.chaos.centre_distribution import (
    EXPANDED,
    REPLICATES,
    TAIL,
    Expansion,
    Reference,
    Row,
    mean_over_designs,
)
from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.regression import Fit, wild_coefficients
from roughslip.chaos.sampling import cumulative_given_contact, kolmogorov_distance
from roughslip.probability.estimate import NORMAL_95, TAILS, wilson_interval

VARIANTS = EXPANDED[:2]
KNOWN = 20_000  # surfaces in contact at most, at which expansions are evaluated
FEWEST_BELOW = 5  # samples in contact of one design below the least probability that is compared with it
BINS = np.linspace(-4.0, 6.0, 51)  # of the first variable, which is the height of the centre where variables are local
KOLMOGOROV_95 = 1.358  # 95 % quantile of the Kolmogorov distribution
STORED: dict[str, tuple[tuple[str, ...], bool, str]] = {  # further dimensions, whether with an interval, title
    "given_distance": ((), True, "Kolmogorov distance to the solved samples in contact"),
    "given_tail_error": ((), True, "largest |log10| of the ratio to the solved samples, from given_tail_from to 0.1"),
    "given_tail_error_of_design": ((), True, "the same to the Latin hypercube samples of the design that was fitted"),
    "given_cumulative": (("pressure",), True, "distribution at solved surfaces in contact, of the first design"),
    "given_positive_share": ((), False, "share of the surfaces in contact at which the expansion is positive"),
    "judged_cumulative": (("pressure",), False, "distribution at draws that our expansion finds in contact"),
    "judged_distance": ((), False, "Kolmogorov distance between these two distributions, mean over designs"),
    "judged_chance": ((), False, "95 % quantile of that distance by chance alone"),
}
NOTHING: Row = (np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class Members:
    """One variant at surfaces in contact, by fit.

    pressures : (members, surfaces) [Pa] a row a design; of one design the fit, then its refits
    designs : number of designs
    """

    pressures: np.ndarray
    designs: int

    def row(self, values: np.ndarray, moved: np.ndarray, error: float) -> Row:
        """A number with its 95 % interval, which an independent error widens.

        values : (members,) the number of each; moved : (members,) how far each may have moved that of the first
        """
        if self.designs > 1:
            return mean_over_designs(values, error)
        value, far = float(values[0]), float(np.quantile(moved[1:], 0.95)) + error
        return value, max(value - far, 0.0), value + far


def members(designs: Sequence[Expansion], fits: Sequence[Fit], variables: np.ndarray, signs_seed: list[int]) -> Members:
    """Pressures of the fit to each design at variables : (surfaces, v); of one design those of its refits too."""
    basis = hermite_basis(variables, designs[0].indices)
    coefficients = np.column_stack([fit.coefficients for fit in fits])
    if len(designs) == 1:
        values = designs[0].regression()
        signs = np.random.default_rng(signs_seed).choice([-1.0, 1.0], (len(values[1]), REPLICATES))
        coefficients = np.column_stack([coefficients, wild_coefficients(*values, signs)])
    return Members(np.ascontiguousarray(designs[0].at(basis, coefficients).T), len(designs))


@dataclass(frozen=True)
class Sampled:
    """What the expansions are compared with.

    solved : all solved samples; latin_hypercube : (designs, samples) [Pa] of each design
    """

    solved: Reference
    latin_hypercube: Sequence[np.ndarray]

    @property
    def tail_from(self) -> float:
        """The least of the low probabilities: that which FEWEST_BELOW samples of one design give."""
        contacts = min(np.count_nonzero(pressure) for pressure in self.latin_hypercube)
        return max(TAIL[0], FEWEST_BELOW / contacts)

    def ratio(self, curve: np.ndarray, other: np.ndarray, surfaces: int) -> float:
        """Largest |log10| of the ratio of curve to other : (levels,) where other is a low probability; NaN without."""
        low = (other >= self.tail_from) & (other <= TAIL[1])
        minimum = 0.5 / surfaces
        return float(np.max(np.abs(np.log10(np.maximum(curve[low], minimum) / other[low])))) if low.any() else np.nan


def variant_rows(variant: Members, sampled: Sampled) -> tuple[np.ndarray, dict[str, Row]]:
    """Curves (members, levels) given contact of one variant, and its numbers."""
    solved, levels = sampled.solved, sampled.solved.levels
    surfaces = variant.pressures.shape[1]
    curves = np.array([cumulative_given_contact(pressure, levels) for pressure in variant.pressures])
    moved = np.max(np.abs(curves - curves[0]), axis=1)
    tails_moved = np.array([sampled.ratio(curve, curves[0], surfaces) for curve in curves])
    minimum = np.sqrt(sampled.tail_from)
    chance = {
        "distance": NORMAL_95 / 2 * np.sqrt(1 / solved.contacts + 1 / surfaces),
        "tail": NORMAL_95 / np.log(10) / minimum * np.sqrt(1 / solved.contacts + 1 / surfaces),
    }
    own = [cumulative_given_contact(pressure, levels) for pressure in sampled.latin_hypercube]
    own_curves = own if variant.designs > 1 else own * len(curves)
    alone = 0.0 if variant.designs > 1 else 1 / np.count_nonzero(sampled.latin_hypercube[0])
    of_design = NORMAL_95 / np.log(10) / minimum * np.sqrt(alone + 1 / surfaces)
    ratios = np.array([sampled.ratio(curve, solved.cumulative, surfaces) for curve in curves])
    to_design = np.array([sampled.ratio(*pair, surfaces) for pair in zip(curves, own_curves, strict=True)])
    distances = np.array([solved.distance(pressure) for pressure in variant.pressures])
    return curves, {
        "distance": variant.row(distances, moved, float(chance["distance"])),
        "tail_error": variant.row(ratios, tails_moved, float(chance["tail"])),
        "tail_error_of_design": variant.row(to_design, tails_moved, float(of_design)),
    }


def between(solved: Mapping[str, Members]) -> Row:
    """Kolmogorov distance of the variants at the same surfaces and designs."""
    if len(solved) < len(VARIANTS):
        return NOTHING
    first, second = (solved[name] for name in VARIANTS)
    pairs = list(zip(first.pressures, second.pressures, strict=True))
    distances = np.array([kolmogorov_distance(a[a > 0], b[b > 0]) for a, b in pairs])
    return first.row(distances, np.abs(distances - distances[0]), NORMAL_95 / 2 / np.sqrt(first.pressures.shape[1]))


def _of_variant(known: Members, judged: Members, sampled: Sampled) -> dict[str, np.ndarray]:
    """What is stored of one variant, each with its interval in the last axis where it has one."""
    levels, designs = sampled.solved.levels, known.designs
    curves, numbers = variant_rows(known, sampled)
    ends = (curves.min(axis=0), curves.max(axis=0)) if designs > 1 else np.quantile(curves, TAILS, axis=0)
    pairs = list(zip(known.pressures[:designs], judged.pressures[:designs], strict=True))
    sizes = (known.pressures.shape[1], judged.pressures.shape[1])
    return {f"given_{name}": np.array(row) for name, row in numbers.items()} | {
        "given_cumulative": np.stack([curves[0], *ends], axis=-1),
        "given_positive_share": np.mean(known.pressures[:designs] > 0),
        "judged_cumulative": cumulative_given_contact(judged.pressures[0], levels),
        "judged_distance": np.mean([kolmogorov_distance(a[a > 0], b[b > 0]) for a, b in pairs]),
        "judged_chance": KOLMOGOROV_95 * np.sqrt(sum(1 / size for size in sizes)),
    }


def given_contact(
    known: Mapping[str, Members], judged: Mapping[str, Members], sampled: Sampled, first_variable: np.ndarray
) -> dict[str, store.Variable]:
    """The variables that stage chaos_square stores of this reading; NaN for a variant whose fit was refused.

    known, judged : by variant, at solved surfaces in contact and at draws that our expansion finds in contact
    first_variable : (surfaces,) of the solved surfaces in contact
    """
    levels = len(sampled.solved.levels)
    of_variant = {name: _of_variant(known[name], judged[name], sampled) for name in known}
    variables = {"variant": store.Variable(("variant",), np.array(VARIANTS), "1", "expansion at surfaces in contact")}
    for name, (dimensions, ends, text) in STORED.items():
        shape = (*((levels,) if dimensions else ()), *((3,) if ends else ()))
        nothing = {name: np.full(shape, np.nan)}
        values = np.stack([of_variant.get(variant, nothing)[name] for variant in VARIANTS])
        where = ("variant", *dimensions)
        if ends:
            variables |= store.with_interval(name, where, np.moveaxis(values, -1, 0), "1", text)
        else:
            variables[name] = store.Variable(where, values, "1", text)
    text = "Kolmogorov distance of eqs. (8) and (9) at solved surfaces in contact"
    variables |= store.with_interval("given_between", (), between(known), "1", text)
    design = sampled.latin_hypercube[0]
    contacts = int(np.count_nonzero(design))
    curve = cumulative_given_contact(design, sampled.solved.levels)
    low, high = wilson_interval(curve * contacts, contacts)
    title = "distribution of the Latin hypercube samples of the first design"
    variables |= store.with_interval("design_cumulative", ("pressure",), (curve, low, high), "1", title)
    density = np.histogram(first_variable, BINS)[0] / len(first_variable) / np.diff(BINS)
    title = "density of the first variable of solved surfaces in contact"
    variables["first_variable"] = store.Variable(("variable_bin",), density, "1", title)
    variables["first_variable_edge"] = store.Variable(("variable_edge",), BINS, "1", "edges of its bins")
    title = "solved surfaces in contact that no fit has seen"
    variables["given_surfaces"] = store.Variable((), len(first_variable), "1", title)
    title = "least of the low probabilities that are compared"
    variables["given_tail_from"] = store.Variable((), sampled.tail_from, "1", title)
    return variables
