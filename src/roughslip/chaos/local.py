"""The pressure at the centre as an expansion in local variables, trained at several nodes of every solved surface.

What a surface does around a node gives the pressure there in nearly the same way at all nodes near the centre, so one
contact solve yields a sample at each of them. The variables are local functionals of the heights, orthonormal at every
node by itself, so that they are standard normal at each. How the response drifts with the distance d from the centre of
the mesh (a border is nearer, the elastic half-space less depressed) is a term in d^2, by symmetry the lowest; terms
that change sign where the surface is mirrored are left out, as nodes are trained together with their mirror images:

    target = sum_a c_a psi_a(u) + b (d^2 - d_centre^2) + scatter (see `scatter`),   pressure from target^+.

The samples of one surface depend on each other, so errors are found by leaving out whole groups of surfaces: a
cross-validated prediction for the scatter, and a jackknife for everything that is read off the distribution.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import ndtri

from roughslip.chaos.censored import censored_regression, completed, derivatives, expected
from roughslip.chaos.designs import sobol_places
from roughslip.chaos.hermite import even_terms, hermite_basis, multi_indices
from roughslip.chaos.leave_group_out import group_sums, left_out_predictions, numbered, without_one, without_two
from roughslip.chaos.pressure import Kind, PressureTarget
from roughslip.chaos.regression import Fit, least_squares
from roughslip.chaos.residual_distribution import ResidualScatter, residual_scatter
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.validation import finite

GROUPS = 20  # of surfaces, left out in turn
REACH = 1.5  # times the mean target in contact: predictions further below than this are out of contact for certain,
# unless a sample in contact was predicted further below still
SCORED = 32  # quantiles by which a predicted distribution is scored
BLOCK = 20_000  # draws evaluated at a time


@dataclass(frozen=True)
class Samples:
    """Solved surfaces, each seen at some nodes around the centre.

    variables : (K, nodes, v) [-] orthonormal local functionals
    distance2 : (nodes,) [-] squared distance of each node from the centre of the mesh, less that of the centre node
    pressure, gap : (K, nodes) [Pa], [m] the gap less than zero where the surface yields, by the plastic displacement
    odd : (v, symmetries) 1 for a variable that changes sign under a symmetry of surfaces and nodes together, else 0

    Raises ParameterError for shapes that do not match or numbers that are not finite.
    """

    variables: np.ndarray
    distance2: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    odd: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))

    def __post_init__(self) -> None:
        for name, dimensions in (("variables", 3), ("distance2", 1), ("pressure", 2), ("gap", 2)):
            finite(name, getattr(self, name), dimensions)
        shape = self.variables.shape[:2]
        if {self.pressure.shape, self.gap.shape} != {shape}:
            raise ParameterError(f"pressure {self.pressure.shape} and gap {self.gap.shape} do not match {shape}")
        if self.distance2.shape != shape[1:]:
            raise ParameterError(f"{len(self.distance2)} distances were given for {shape[1]} nodes")
        if np.any(self.pressure < 0) or np.any(self.gap[self.pressure == 0] < 0):
            raise ParameterError("pressures must not be negative, nor gaps where there is no pressure")

    @property
    def group(self) -> np.ndarray:
        """(K,) number below GROUPS of each surface, in turn; copies share it, as none may predict another."""
        return numbered(self.variables.reshape(len(self.variables), -1)) % GROUPS


@dataclass(frozen=True)
class LocalExpansion:
    """An expansion with its scatter, and the same with each group of surfaces left out.

    indices : (P, v) exponents
    coefficients : (1 + groups, P) in the unit of the target; row 0 is the fit to all surfaces
    scatters : 1 + groups laws of the target given its prediction
    balance : (1 + groups,) [-] factor of the pressures that are drawn: what was solved over what is expected of it
    lowest : [target] predictions below are out of contact
    target : how the target gives the pressure
    fit : quality of the regression; its leave-one-out counts samples of a surface as if they were independent
    cross_validated : share of the weighted variance of the target that predictions of left-out surfaces miss
    scores : (groups,) [-] of each left-out group its share of `score`
    residual : (K, nodes) weighted targets less their predictions from the other groups, 0 below `lowest`
    """

    indices: np.ndarray
    coefficients: np.ndarray
    scatters: tuple[ResidualScatter, ...]
    balance: np.ndarray
    lowest: float
    target: PressureTarget
    fit: Fit
    cross_validated: float
    scores: np.ndarray
    residual: np.ndarray

    @property
    def score(self) -> float:
        """Continuous ranked probability score of the pressure at left-out surfaces, over the mean pressure [-]."""
        return float(self.scores.sum())

    @property
    def groups(self) -> int:
        """Number of groups of surfaces that were left out in turn."""
        return len(self.coefficients) - 1

    def mean_pressure_at(self, variables: np.ndarray) -> np.ndarray:
        """p : (n,) [Pa] at variables : (n, v), of the target without its scatter."""
        predicted = hermite_basis(variables, self.indices) @ self.coefficients[0]
        return self.target.pressure(self.scatters[0].centre(predicted))

    def draw(self, generator: np.random.Generator, count: int, *, left_out: bool = False) -> np.ndarray:
        """Pressures of random surfaces, which together are spread evenly: not independent.

        Returns p : (count,) [Pa], or with `left_out` (1 + groups, count): the same draws for every group left out.

        Method: a scrambled Sobol sequence of the variables and the scatter. Measured with 8 variables, 400 000 draws
        and 5 % contact: their mean has a standard error of 0.06 %, of independent draws 1.1 %.
        """
        places = sobol_places(generator, count, 1 + self.indices.shape[1])
        members = range(1 + self.groups) if left_out else range(1)
        pressure = np.zeros((len(members), count))
        for first in range(0, count, BLOCK):
            block = places[first : first + BLOCK]
            basis = hermite_basis(ndtri(block[:, 1:]), self.indices)
            for member in members:
                predicted = basis @ self.coefficients[member]
                near = np.flatnonzero(predicted > self.lowest)
                drawn = self.scatters[member].draw(predicted[near], block[near, 0])
                pressure[member, first + near] = self.balance[member] * self.target.pressure(drawn)
        return pressure if left_out else pressure[0]


def jackknife_deviations(values: np.ndarray) -> np.ndarray:
    """What leaving out each group does to a number, scaled so that their squares sum to its variance.

    values : (groups, ...) the number without each group

    Method: delete-a-group jackknife (Kott, J. Off. Stat. 17 (2001) 521).
    """
    groups = len(values)
    return np.sqrt((groups - 1) / groups) * (values - values.mean(axis=0))


def fit_local(samples: Samples, degree: int, target: PressureTarget) -> LocalExpansion:
    """Expand the pressure around the centre.

    samples : at least GROUPS surfaces
    degree : total degree of the Hermite polynomials
    target : the smooth variable; of a trial pressure the gap's stiffness is chosen anew, see `best_gap_stiffness`

    Raises IllPosedError for too few surfaces, where left-out ones are predicted worse than by their mean, and as the
    regression and the scatter do; ConvergenceError as a censored regression does.
    """
    surfaces, nodes, count = samples.variables.shape
    group = samples.group
    if len(np.unique(group)) < GROUPS:
        raise IllPosedError(
            f"{surfaces} surfaces are too few to leave out {GROUPS} groups that differ: take more samples"
        )
    pressure, gap = samples.pressure.ravel(), samples.gap.ravel()
    contact = pressure > 0
    if not contact.any():
        raise IllPosedError("no sample is in contact: take more samples or a deeper penetration")
    indices = multi_indices(count, degree)
    if samples.odd.size:
        indices = even_terms(indices, samples.odd)
    basis = hermite_basis(samples.variables.reshape(-1, count), indices)
    if np.ptp(samples.distance2) > 0:
        basis = np.column_stack([basis, np.tile(samples.distance2, surfaces)])
    group = np.repeat(group, nodes)
    if target.kind == "trial_pressure":
        target = replace(target, gap_stiffness=best_gap_stiffness(basis, group, pressure, gap, target.gap_stiffness))
    values = target.values(pressure, gap)
    weights = target.weights(values)
    if target.kind == "censored":
        fit, without, values = _censored(basis, group, values)
    else:
        fit = least_squares(basis, values, weights)
        without = without_two(*group_sums(basis, weights, weights * values, group, GROUPS))
    predicted = left_out_predictions(basis, without, group)
    missed = np.average((values - predicted[0]) ** 2, weights=weights)
    variance = np.average((values - np.average(values, weights=weights)) ** 2, weights=weights)
    if not missed <= variance:
        raise IllPosedError(
            f"{len(basis.T)} terms predict left-out surfaces worse than a mean does, they miss {missed / variance:.2g} "
            "variances: take more samples, other or fewer variables, or a lower degree"
        )
    lowest = min(-REACH * float(values[contact].mean()), float(predicted[0, contact].min()))
    # A straight line through the predictions would do for the far ones; the scatter is wanted where contact is decided.
    known = [np.ones(len(group), dtype=bool), *(group != g for g in range(GROUPS))]
    near = [part & (s >= lowest) for part, s in zip(known, predicted, strict=True)]
    scatters = tuple(residual_scatter(s[part], values[part]) for part, s in zip(near, predicted, strict=True))
    coefficients = np.vstack([fit.coefficients, without[0, 1:]])
    fitted = coefficients @ basis.T
    balance = np.array(
        [
            _balance(s, f[part], lowest, target, pressure[part])
            for s, f, part in zip(scatters, fitted, known, strict=True)
        ]
    )
    terms = len(indices)
    return LocalExpansion(
        indices=indices,
        coefficients=coefficients[:, :terms],
        scatters=scatters,
        balance=balance,
        lowest=lowest,
        target=target,
        fit=fit,
        cross_validated=float(missed / variance),
        scores=_scores(scatters, balance, lowest, target, predicted, group, pressure),
        residual=np.where(near[0], weights * (values - predicted[0]), 0.0).reshape(surfaces, nodes),
    )


def fit_best(
    samples: Samples, degree: int, targets: Sequence[PressureTarget]
) -> tuple[LocalExpansion, dict[Kind, float]]:
    """The expansion of the target whose predictions of left-out surfaces score best.

    samples, degree : as in `fit_local`
    targets : candidates, of different kinds

    Returns it, and the score of every kind, NaN where its fit is refused. Raises as `fit_local` does where all are.

    Measured over ten designs: on the paper's square (percentiles 20, 50, 80) always the trial pressure, whose
    distribution was nearest in 7, 5 and 4 of them (L1); on the resolved one (20, 80) always the censored, nearest in 5
    and 4. Where scores are within a tenth of each other distributions differ by less than they scatter.
    """
    found: list[LocalExpansion] = []
    scores: dict[Kind, float] = {}
    refused: list[IllPosedError | ConvergenceError] = []
    for target in targets:
        try:
            found.append(fit_local(samples, degree, target))
            scores[target.kind] = found[-1].score
        except (IllPosedError, ConvergenceError) as error:
            scores[target.kind] = math.nan
            refused.append(error)
    if not found:
        raise refused[0]
    return min(found, key=lambda one: one.score), scores


def _censored(basis: np.ndarray, group: np.ndarray, values: np.ndarray) -> tuple[Fit, np.ndarray, np.ndarray]:
    """The expansion of a censored target, the same without each pair of groups, and the target drawn out of contact.

    Without groups: a step of Newton's method from the maximum of all, which is exact to second order in their share.
    """
    found = censored_regression(basis, values)
    contact = values > 0
    rows = np.column_stack([basis, -np.where(contact, values / found.unit, 0.0)])
    slope, weight = derivatives(rows, contact, found.parameters)
    matrices, sides = group_sums(rows, weight, slope, group, GROUPS)
    contacts, h = np.bincount(group, contact, GROUPS), found.parameters[-1]
    matrices[:, -1, -1] += contacts / h**2
    sides[:, -1] += contacts / h
    sides += matrices @ found.parameters
    moved = without_two(matrices, sides)
    without = moved[..., :-1] / moved[..., -1:] * found.unit
    fit = least_squares(basis, expected(found, basis @ found.coefficients, values))
    return fit, without, completed(left_out_predictions(basis, without, group)[0], found.scatter, values)


def _balance(
    scatter: ResidualScatter, fitted: np.ndarray, lowest: float, target: PressureTarget, pressure: np.ndarray
) -> float:
    """Mean pressure of samples over the mean of what the expansion that they train expects of them; 1 if it is capped.

    With it the mean of the draws is that of the samples, but for what the expansion says of variables that were not
    sampled: a regression estimate (W. G. Cochran, Sampling Techniques, 1977, ch. 7).
    """
    if math.isfinite(target.hardness_pa):
        return 1.0
    uniform = (np.arange(SCORED) + 0.5) / SCORED
    expected = target.pressure(scatter.draw(fitted[fitted > lowest, None], uniform))
    return float(pressure.sum() / (expected.sum() / SCORED))


def _scores(
    scatters: tuple[ResidualScatter, ...],
    balance: np.ndarray,
    lowest: float,
    target: PressureTarget,
    predicted: np.ndarray,
    group: np.ndarray,
    pressure: np.ndarray,
) -> np.ndarray:
    """Continuous ranked probability score of p at left-out surfaces over its mean: the law of each without its group.

    It asks for predictions that are sharp, and for a law as wide as they are wrong (Gneiting and Raftery, J. Am. Stat.
    Assoc. 102 (2007) 359), as an integral over quantiles (Laio and Tamea, Hydrol. Earth Syst. Sci. 11 (2007) 1267).
    Returns the share of each group : (GROUPS,) [-].
    """
    uniform = (np.arange(SCORED) + 0.5) / SCORED
    shares = np.empty(GROUPS)
    for g in range(GROUPS):
        members = np.flatnonzero(group == g)
        s, p = predicted[g + 1, members], pressure[members, None]
        near = s > lowest
        quantiles = np.zeros((len(s), SCORED))
        quantiles[near] = balance[g + 1] * target.pressure(scatters[g + 1].draw(s[near, None], uniform))
        shares[g] = 2 / SCORED * float(np.sum(((p < quantiles) - uniform) * (quantiles - p)))
    return shares / float(pressure.sum())


def best_gap_stiffness(
    basis: np.ndarray, group: np.ndarray, pressure: np.ndarray, gap: np.ndarray, guess: float
) -> float:
    """The stiffness k of p - k gap that is predicted best from left-out surfaces.

    With 1 / B_00 the target has a kink at first contact: in contact neighbours yield as well, so that the pressure
    rises faster than the gap closes. The right k is some 1.1 / B_00 where heights are independent from node to node.

    basis : (K, P) terms at the samples
    group : (K,) of surfaces, numbers below GROUPS
    pressure, gap : (K,) [Pa], [m]
    guess : [Pa/m] 1 / B_00

    Returns k [Pa/m], between half and twice the guess: the least of |e_p - k e_gap|^2 / Var(p - k gap), a ratio of two
    quadratics in k, with e the errors of cross-validated predictions, which are linear in the target. Raises
    IllPosedError where pressure and gap are the same on every sample.
    """
    errors, ones = [], np.ones(len(pressure))
    for values in (pressure, guess * gap):
        without = without_one(*group_sums(basis, ones, values, group, GROUPS))
        errors.append(values - left_out_predictions(basis, without, group))
    spread = [pressure - pressure.mean(), guess * (gap - gap.mean())]
    missed, variance = ([a @ a, a @ b, b @ b] for a, b in (errors, spread))
    if not variance[0] > 0 and not variance[2] > 0:
        raise IllPosedError("the target is the same on every sample: there is nothing to expand; take its value")
    factor = np.linspace(0.5, 2.0, 1501)
    share = (missed[0] - 2 * factor * missed[1] + factor**2 * missed[2]) / (
        variance[0] - 2 * factor * variance[1] + factor**2 * variance[2]
    )
    return guess * float(factor[np.argmin(share)])
