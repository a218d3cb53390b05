"""Weighted least squares of expansion coefficients, and predictions of samples that a fit has not seen.

Samples of one group, such as nodes of the same surfaces, are dependent and are left out together.
With Q the orthonormal columns of the weighted basis, c the coefficients in them and e the residuals, the fit without
the groups g and h has c - (1 - Q_g' Q_g - Q_h' Q_h)^-1 (Q_g' e_g + Q_h' e_h). Of a group of one sample the left-out
residual is e over 1 - leverage (PRESS: Allen, Technometrics 16 (1974) 125).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError
from roughslip.results import described, result
from roughslip.validation import finite, gate

WORST_CONDITION = 1e8  # above it half the digits of the coefficients are rounding error
LEAST_FREEDOM = 1e-10  # of 1 - leverage: below it a residual is rounding error
LEAST_VARIATION = 1e-13  # of the target, relative to its magnitude: the rounding error of its mean

# What to try where samples do not determine an expansion: the ends of error texts, with the scene keys.
FEWER_TERMS = (
    "take more samples, fewer variables or a lower degree; scene keys: expansion.samples or strip.training_samples, "
    "expansion.degree"
)
MORE_CONTACT = (
    "take more samples or a deeper penetration; scene keys: expansion.samples or strip.training_samples, "
    "strip.penetration_percentiles"
)
OTHER_PENETRATION = (
    "its value is the result; for a scatter take another penetration; scene key: strip.penetration_percentiles"
)
MORE_SURFACES = "take more samples; scene key: expansion.samples"


@result
class Fit:
    """Coefficients of one regression and its quality. Shares are of the weighted variance of the target."""

    coefficients: np.ndarray = described("coefficients in the unit of the target", "1", "P")
    condition_number: float = described("ratio of the extreme singular values of the weighted basis with unit columns")
    samples: int = described("number of samples with a weight")
    predicted: np.ndarray = described("target of each sample, predicted from the other groups", "1", "K")
    leave_one_out: float = described("share that these predictions miss")


@gate
def least_squares(
    basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None, group: np.ndarray | None = None
) -> Fit:
    """Coefficients that minimise the weighted sum of squares: eq. (10) with weights.

    basis : (K, P) terms at the samples
    target : (K,) the expanded quantity
    weights : (K,) [-] not negative, 1 if not given; only their ratios matter
    group : (K,) whole numbers; samples of one number are left out together, by default each alone

    Raises ParameterError for input that is not finite or of the wrong shape. Raises IllPosedError as `Regression`, and
    for a constant target.
    """
    weights = None if weights is None else finite("weights", weights, 1)
    return Regression(basis, weights, group).fit(target)


class Regression:
    """The factors of a weighted basis, from which fits of any target follow; arguments as of `least_squares`.

    q, r : (K, P), (P, P) of the weighted basis with unit columns
    condition : [-] ratio of the extreme singular values of that

    Raises IllPosedError where samples, or effective samples (Kish 1965), are not more than the terms, a column
    vanishes, the condition number exceeds WORST_CONDITION, or a single group determines a coefficient.
    """

    def __init__(self, basis: np.ndarray, weights: np.ndarray | None = None, group: np.ndarray | None = None) -> None:
        self.basis = basis = finite("basis of a regression", basis, 2)
        weights = np.ones(len(basis)) if weights is None else finite("weights of a regression", weights, 1)
        if len(weights) != len(basis):
            raise ParameterError(f"a regression needs a weight for each of {len(basis)} samples, not {len(weights)}")
        if np.any(weights < 0) or not np.any(weights > 0):
            raise ParameterError("weights of a regression must be non-negative and not all zero")
        self.weights = weights / weights.max()
        self._root = np.sqrt(self.weights)
        self.samples, terms = int(np.count_nonzero(self.weights)), basis.shape[1]
        effective = float(self.weights.sum() ** 2 / np.sum(self.weights**2))
        if min(self.samples, effective) <= terms:
            raise IllPosedError(
                f"{self.samples} samples ({effective:.0f} effective) are too few for {terms} coefficients: "
                f"{FEWER_TERMS}"
            )
        columns = self._root[:, None] * basis
        self._norms = np.linalg.norm(columns, axis=0)
        if not np.all(self._norms > 0):
            raise IllPosedError(f"a term of the basis vanishes on every sample: {FEWER_TERMS}")
        self.q, self.r = scipy.linalg.qr(columns / self._norms, mode="economic", check_finite=False)
        singular = scipy.linalg.svdvals(self.r, check_finite=False)
        self.condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
        if self.condition > WORST_CONDITION:
            raise IllPosedError(
                f"condition number {self.condition:.1e} of {self.samples} samples for {terms} terms, more than "
                f"{WORST_CONDITION:.0e}: {FEWER_TERMS}"
            )
        number = np.zeros(0) if group is None else np.unique(group, return_inverse=True)[1]
        self._groups = [np.flatnonzero(number == g) for g in np.unique(number)]
        self._leverage = np.einsum("kp,kp->k", self.q, self.q) if group is None else np.zeros(len(basis))
        if np.max(self._leverage) > 1.0 - LEAST_FREEDOM:
            worst = np.argmax(self._leverage)
            raise IllPosedError(f"without sample {worst} a coefficient is undetermined: {FEWER_TERMS}")

    def fit(self, target: np.ndarray) -> Fit:
        """The fit of a target : (K,). Raises IllPosedError for a constant one."""
        target = finite("target of a regression", target, 1)
        if len(target) != len(self.basis):
            raise ParameterError(f"a regression needs a target for each of {len(self.basis)} rows, not {len(target)}")
        variance = np.average((target - np.average(target, weights=self.weights)) ** 2, weights=self.weights)
        if not np.sqrt(variance) > LEAST_VARIATION * np.max(np.abs(target)):
            raise IllPosedError(f"the target is the same on every sample, {target[0]:.6g}: {OTHER_PENETRATION}")
        predicted = self.predicted(target)
        missed = np.average((target - predicted) ** 2, weights=self.weights)
        coefficients = self._natural(self.q.T @ (self._root * target))
        return Fit(coefficients, self.condition, self.samples, predicted, float(missed / variance))

    def predicted(self, target: np.ndarray) -> np.ndarray:
        """A target : (K,), predicted at each sample from the other groups."""
        projected = self.q.T @ (self._root * target)
        residual = self._root * target - self.q @ projected
        own = np.divide(residual, self._root, out=np.zeros(len(target)), where=self._root > 0)
        predicted = self.basis @ self._natural(projected) - self._leverage / (1.0 - self._leverage) * own
        for members in self._groups:
            q = self.q[members]
            coefficients = projected - self._solve(np.eye(len(projected)) - q.T @ q, q.T @ residual[members])
            predicted[members] = self.basis[members] @ self._natural(coefficients)
        return predicted

    def without_pairs(self, target: np.ndarray) -> np.ndarray:
        """Coefficients : (1 + G, 1 + G, P) of a target : (K,) without each pair of the groups that were given.

        c[g, h] is without groups g - 1 and h - 1, where index 0 stands for no group.
        """
        projected = self.q.T @ (self._root * target)
        residual = self._root * target - self.q @ projected
        count, terms = 1 + len(self._groups), len(projected)
        grams, sides = np.zeros((count, terms, terms)), np.zeros((count, terms))
        for g, members in enumerate(self._groups, start=1):
            q = self.q[members]
            grams[g], sides[g] = q.T @ q, q.T @ residual[members]
        coefficients = np.empty((count, count, terms))
        for g in range(count):
            for h in range(g, count):
                gram, side = (grams[g], sides[g]) if g == h else (grams[g] + grams[h], sides[g] + sides[h])
                solution = projected - self._solve(np.eye(terms) - gram, side)
                coefficients[g, h] = coefficients[h, g] = self._natural(solution)
        return coefficients

    def _natural(self, coefficients: np.ndarray) -> np.ndarray:
        """Coefficients of the terms from those of the orthonormal columns."""
        return scipy.linalg.solve_triangular(self.r, coefficients, check_finite=False) / self._norms

    def _solve(self, matrix: np.ndarray, side: np.ndarray) -> np.ndarray:
        try:
            factor = scipy.linalg.cho_factor(matrix, check_finite=False)
            if np.min(np.diag(factor[0])) ** 2 < LEAST_FREEDOM:
                raise np.linalg.LinAlgError
        except np.linalg.LinAlgError as error:
            raise IllPosedError(f"without a group of samples a coefficient is undetermined: {FEWER_TERMS}") from error
        return np.asarray(scipy.linalg.cho_solve(factor, side, check_finite=False))
