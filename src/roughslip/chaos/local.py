"""The pressure at the centre as an expansion in local variables, trained at several nodes of every solved surface.

What a surface does around a node gives the pressure there in nearly the same way at all nodes near the centre, so one
contact solve yields a sample at each of them. The variables are local functionals of the heights, orthonormal at every
node by itself, so that they are standard normal at each. How the response drifts with the distance d from the centre of
the mesh (a border is nearer, the elastic half-space less depressed) is a term in d^2, by symmetry the lowest:

    target = sum_a c_a psi_a(u) + b (d^2 - d_centre^2) + scatter (see `scatter`),   pressure from target^+.

The samples of one surface depend on each other, so errors are found by leaving out whole groups of surfaces: a
cross-validated prediction for the scatter, and a jackknife for everything that is read off the distribution.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.indices import multi_indices
from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.regression import Fit, least_squares
from roughslip.chaos.scatter import ResidualScatter, residual_scatter
from roughslip.errors import IllPosedError, ParameterError

GROUPS = 20  # of surfaces, left out in turn
REACH = 1.5  # times the mean target in contact: predictions further below than this are out of contact for certain,
# unless a sample in contact was predicted further below still


@dataclass(frozen=True)
class Samples:
    """Solved surfaces, each seen at some nodes around the centre.

    variables : (K, nodes, v) [-] orthonormal local functionals
    distance2 : (nodes,) [-] squared distance of each node from the centre of the mesh, less that of the centre node
    pressure, gap : (K, nodes) [Pa], [m]

    Raises ParameterError for shapes that do not match or numbers that are not finite.
    """

    variables: np.ndarray
    distance2: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray

    def __post_init__(self) -> None:
        shape = self.variables.shape[:2]
        if self.variables.ndim != 3 or {self.pressure.shape, self.gap.shape} != {shape}:
            raise ParameterError(f"pressure {self.pressure.shape} and gap {self.gap.shape} do not match {shape}")
        if self.distance2.shape != shape[1:]:
            raise ParameterError(f"{len(self.distance2)} distances were given for {shape[1]} nodes")
        if not all(np.isfinite(part).all() for part in (self.variables, self.distance2, self.pressure, self.gap)):
            raise ParameterError("variables, distances, pressures and gaps must be finite")


@dataclass(frozen=True)
class LocalExpansion:
    """An expansion with its scatter, and the same with each group of surfaces left out.

    indices : (P, v) exponents
    coefficients : (1 + groups, P) in the unit of the target; row 0 is the fit to all surfaces
    scatters : 1 + groups laws of the target given its prediction
    lowest : [target] predictions below are out of contact
    target : how the target gives the pressure
    fit : quality of the regression; its leave-one-out counts samples of a surface as if they were independent
    cross_validated : share of the weighted variance of the target that predictions of left-out surfaces miss
    """

    indices: np.ndarray
    coefficients: np.ndarray
    scatters: tuple[ResidualScatter, ...]
    lowest: float
    target: PressureTarget
    fit: Fit
    cross_validated: float

    @property
    def groups(self) -> int:
        """Number of groups of surfaces that were left out in turn."""
        return len(self.coefficients) - 1

    def mean_pressure_at(self, variables: np.ndarray) -> np.ndarray:
        """p : (n,) [Pa] at variables : (n, v), of the target without its scatter."""
        predicted = hermite_basis(variables, self.indices) @ self.coefficients[0]
        return self.target.pressure(self.scatters[0].centre(predicted))

    def draw(self, generator: np.random.Generator, count: int, *, left_out: bool = False) -> np.ndarray:
        """Pressures of independent surfaces.

        Returns p : (count,) [Pa], or with `left_out` (1 + groups, count): the same draws for every group left out.
        """
        variables = generator.standard_normal((count, self.indices.shape[1]))
        uniform = generator.random(count)
        members = range(1 + self.groups) if left_out else range(1)
        basis = hermite_basis(variables, self.indices)
        pressure = np.zeros((len(members), count))
        for member in members:
            predicted = basis @ self.coefficients[member]
            near = predicted > self.lowest
            drawn = self.scatters[member].draw(predicted[near], uniform[near])
            pressure[member, near] = self.target.pressure(drawn)
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

    Raises IllPosedError for too few surfaces and as the regression and the scatter do.
    """
    surfaces, nodes, count = samples.variables.shape
    if surfaces < GROUPS:
        raise IllPosedError(f"{surfaces} surfaces are too few to leave out {GROUPS} groups of them: take more samples")
    indices = multi_indices(count, degree)
    basis = hermite_basis(samples.variables.reshape(-1, count), indices)
    if np.ptp(samples.distance2) > 0:
        basis = np.column_stack([basis, np.tile(samples.distance2, surfaces)])
    regression = _Regression(basis, np.repeat(np.arange(surfaces) % GROUPS, nodes))
    pressure, gap = samples.pressure.ravel(), samples.gap.ravel()
    if target.kind == "trial_pressure":
        target = replace(target, gap_stiffness=best_gap_stiffness(regression, pressure, gap, target.gap_stiffness))
    values = target.values(pressure, gap)
    weights = target.weights(values)
    fit = least_squares(basis, values, weights)
    without = regression.without_each_group(values, weights)
    predicted = np.einsum("kp,kp->k", basis, without[regression.group])
    missed = np.average((values - predicted) ** 2, weights=weights)
    variance = np.average((values - np.average(values, weights=weights)) ** 2, weights=weights)
    contact = pressure > 0
    if not contact.any():
        raise IllPosedError("no sample is in contact: take more samples or a deeper penetration")
    lowest = min(-REACH * float(values[contact].mean()), float(predicted[contact].min()))
    # A straight line through the predictions would do for the far ones; the scatter is wanted where contact is decided.
    # Without a group the predictions of the others move too, and their law makes up for it: b_-gh = b_-g + b_-h - b.
    moves = [(regression.group != group, without[group] - fit.coefficients) for group in range(GROUPS)]
    parts = [(predicted, values), *((predicted[kept] + basis[kept] @ move, values[kept]) for kept, move in moves)]
    terms = len(indices)
    return LocalExpansion(
        indices=indices,
        coefficients=np.vstack([fit.coefficients[:terms], without[:, :terms]]),
        scatters=tuple(residual_scatter(s[s >= lowest], values[s >= lowest]) for s, values in parts),
        lowest=lowest,
        target=target,
        fit=fit,
        cross_validated=float(missed / variance),
    )


@dataclass(frozen=True)
class _Regression:
    """A basis whose rows belong to groups.

    basis : (K, P)
    group : (K,)
    """

    basis: np.ndarray
    group: np.ndarray

    def without_each_group(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Coefficients : (GROUPS, P) of the weighted least squares without each group, from sums of normal equations.

        Raises IllPosedError where they are not positive definite.
        """
        weighted = weights[:, None] * self.basis
        members = [self.group == group for group in range(GROUPS)]
        matrices = np.stack([self.basis[member].T @ weighted[member] for member in members])
        sides = np.stack([weighted[member].T @ values[member] for member in members])
        matrices, sides = matrices.sum(axis=0) - matrices, sides.sum(axis=0) - sides
        try:
            return np.stack([scipy.linalg.solve(m, s, assume_a="pos") for m, s in zip(matrices, sides, strict=True)])
        except np.linalg.LinAlgError as error:
            raise IllPosedError(
                "without a group of surfaces a coefficient is undetermined: take more samples, fewer variables or a "
                "lower degree"
            ) from error

    def predictions(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Predictions : (K,) of values, each from the other groups."""
        return np.einsum("kp,kp->k", self.basis, self.without_each_group(values, weights)[self.group])


def best_gap_stiffness(regression: _Regression, pressure: np.ndarray, gap: np.ndarray, guess: float) -> float:
    """The stiffness k of p - k gap that is predicted best from left-out surfaces.

    With 1 / B_00 the target has a kink at first contact: in contact neighbours yield as well, so that the pressure
    rises faster than the gap closes. The right k is some 1.1 / B_00 where heights are independent from node to node.

    pressure, gap : (K,) [Pa], [m] at the rows of the regression
    guess : [Pa/m] 1 / B_00

    Returns k [Pa/m], between half and twice the guess: the least of |e_p - k e_gap|^2 / Var(p - k gap), a ratio of two
    quadratics in k, with e the errors of cross-validated predictions, which are linear in the target.
    """
    ones = np.ones(len(pressure))
    errors = [values - regression.predictions(values, ones) for values in (pressure, guess * gap)]
    spread = [pressure - pressure.mean(), guess * (gap - gap.mean())]
    missed, variance = ([a @ a, a @ b, b @ b] for a, b in (errors, spread))
    factor = np.linspace(0.5, 2.0, 1501)
    share = (missed[0] - 2 * factor * missed[1] + factor**2 * missed[2]) / (
        variance[0] - 2 * factor * variance[1] + factor**2 * variance[2]
    )
    return guess * float(factor[np.argmin(share)])
