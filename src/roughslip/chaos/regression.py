"""Weighted least squares of expansion coefficients, and predictions of samples that a fit has not seen.

Samples of one group, such as nodes of the same surfaces, are dependent and are left out together.
With the Gram matrix G = B' W B of the basis, the coefficients c and the residuals e, the fit without the groups g and h
has c - (G - G_g - G_h)^-1 (B_g' W e_g + B_h' W e_h). Of a group of one sample the left-out residual is e over
1 - leverage (PRESS: Allen, Technometrics 16 (1974) 125). A basis that is ill-conditioned is made
orthonormal first.
"""

from __future__ import annotations

import math
import warnings
from functools import cached_property

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError
from roughslip.results import described, result
from roughslip.validation import finite, gate

WORST_CONDITION = 1e8  # above it half the digits of the coefficients are rounding error
WELL_CONDITIONED = 100.0  # up to it a Gram matrix loses four digits of sixteen
LEAST_FREEDOM = 1e-10  # of 1 - leverage, and of a column without a group: below it there is rounding error
ERRORS = 4.0  # standard errors of a variance by which the sum of squares may exceed it
LEAST_VARIATION = 1e-13  # of the target, relative to its magnitude: the rounding error of its mean

# What to try where samples do not determine an expansion, the ends of error texts, and the scene keys of it.
FEWER_TERMS = "take more samples, fewer variables or a lower degree"
MORE_CONTACT = "take more samples or a deeper penetration"
OTHER_PENETRATION = "its value is the result; for a scatter take another penetration"
KEYS = "expansion.samples or strip.training_samples, expansion.degree, strip.penetration_percentiles"


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

    Warns where the coefficients of an orthonormal basis, as of `hermite_basis`, are not those of the response: their
    squares sum to no more than the variance. Of other bases squares say nothing. Raises ParameterError for input that
    is not finite or of the wrong shape, IllPosedError as `Regression`, and for a constant target.
    """
    weights = None if weights is None else finite("weights", weights, 1)
    fit = Regression(basis, weights, group).fit(target)
    if weights is None:
        _warn_of_variance(basis, target, fit.coefficients)
    return fit


def _warn_of_variance(basis: np.ndarray, target: np.ndarray, coefficients: np.ndarray) -> None:
    """Warn where an expansion has more variance than samples have, with its standard error sqrt((m4 - s^4) / K)."""
    if basis.shape[1] < 2 or np.any(basis[:, 0] != 1.0) or not 0.5 < np.mean(basis[:, 1] ** 2) < 2.0:
        return  # not orthonormal terms: the constant, a variable of variance 1, and others
    if np.any(np.abs(np.mean(basis[:, 1:], axis=0)) > 0.5):
        return  # nor these: but by chance an orthonormal term has no mean, that of x^2 is 1
    squares, from_mean = float(np.sum(coefficients[1:] ** 2)), target - np.mean(target)
    variance = float(np.mean(from_mean**2))
    error = math.sqrt((float(np.mean(from_mean**4)) - variance**2) / len(target))
    if squares > 1.1 * variance + ERRORS * error:
        warnings.warn(
            f"the squares of the coefficients of `target` sum to {squares:.3g}, and the samples have a variance of "
            f"{variance:.3g}: the expansion holds near the samples alone, and its variance, tails and shares of inputs "
            "are wrong: take a lower degree in `basis`, or more samples",
            stacklevel=4,
        )


class Regression:
    """The Gram matrix of a weighted basis, from which fits of any target follow; arguments as of `least_squares`.

    condition : [-] ratio of the extreme singular values of the weighted basis with unit columns

    Raises IllPosedError where samples, or effective samples (Kish 1965), are not more than the terms, a column
    vanishes, the condition number exceeds WORST_CONDITION, or a single group determines a coefficient.
    """

    def __init__(self, basis: np.ndarray, weights: np.ndarray | None = None, group: np.ndarray | None = None) -> None:
        self.basis = basis = finite("basis", basis, 2)
        weights = np.ones(len(basis)) if weights is None else finite("weights", weights, 1)
        if len(weights) != len(basis):
            raise ParameterError(f"weights must be one for each of the {len(basis)} rows of basis, not {len(weights)}")
        if np.any(weights < 0) or not np.any(weights > 0):
            raise ParameterError("weights must be non-negative and not all zero")
        self.weights = weights / weights.max()
        self.samples, terms = int(np.count_nonzero(self.weights)), basis.shape[1]
        effective = float(self.weights.sum() ** 2 / np.sum(self.weights**2))
        if min(self.samples, effective) <= terms:
            few = f"{self.samples} samples ({effective:.0f} effective) are too few for {terms} coefficients"
            raise IllPosedError(f"{few}: {FEWER_TERMS}", KEYS)
        self._members = [slice(None)] if group is None else [_members(group == g) for g in np.unique(group)]
        self._change: np.ndarray | None = None  # triangular, from coefficients of the terms to those of the fit
        self._take(basis)
        norms = np.sqrt(np.diag(self._gram))
        if not np.all(norms > 0):
            raise IllPosedError(f"a term of the basis vanishes on every sample: {FEWER_TERMS}", KEYS)
        self.condition = _condition(self._factor / norms)
        if self.condition > WELL_CONDITIONED:
            self._change = self._triangle(norms)
            self._take(scipy.linalg.solve_triangular(self._change, basis.T, trans=1, check_finite=False).T)
        self._leverage = self._leverages() if group is None else None

    def _take(self, basis: np.ndarray) -> None:
        """Set the basis with its Gram matrices and their factor."""
        self.basis = basis
        self._grams = np.stack([part.T @ part for part in map(self._weighted, self._members)])
        self._gram = self._grams.sum(axis=0)
        self._factor = _cholesky(self._gram)

    def _weighted(self, members: slice | np.ndarray) -> np.ndarray:
        return np.sqrt(self.weights[members])[:, None] * self.basis[members]

    def _triangle(self, norms: np.ndarray) -> np.ndarray:
        """The triangle of the QR factors of the weighted basis. norms : of its columns"""
        columns = self._weighted(slice(None)) / norms
        triangle = scipy.linalg.qr(columns, mode="r", check_finite=False)[0][: len(norms)]
        self.condition = _condition(triangle)
        if self.condition > WORST_CONDITION:
            of = f"of {self.samples} samples for {len(norms)} terms, more than {WORST_CONDITION:.0e}"
            raise IllPosedError(f"condition number {self.condition:.1e} {of}: {FEWER_TERMS}", KEYS)
        return np.asarray(triangle * norms)

    def _leverages(self) -> np.ndarray:
        columns = self._weighted(slice(None)).T
        columns = scipy.linalg.solve_triangular(self._factor, columns, trans=1, check_finite=False)
        leverage = np.einsum("pk,pk->k", columns, columns)
        if np.max(leverage) > 1.0 - LEAST_FREEDOM:
            worst = np.argmax(leverage)
            raise IllPosedError(f"without sample {worst} a coefficient is undetermined: {FEWER_TERMS}", KEYS)
        return leverage

    def fit(self, target: np.ndarray) -> Fit:
        """The fit of a target : (K,). Raises IllPosedError for a constant one."""
        target = finite("target", target, 1)
        if len(target) != len(self.basis):
            raise ParameterError(
                f"target must have a value for each of the {len(self.basis)} rows of basis, not {len(target)}"
            )
        variance = np.average((target - np.average(target, weights=self.weights)) ** 2, weights=self.weights)
        if not np.sqrt(variance) > LEAST_VARIATION * np.max(np.abs(target)):
            raise IllPosedError(f"the target is the same on every sample, {target[0]:.6g}: {OTHER_PENETRATION}", KEYS)
        predicted = self.predicted(target)
        missed = np.average((target - predicted) ** 2, weights=self.weights)
        coefficients = self._natural(self._solution(target))
        return Fit(coefficients, self.condition, self.samples, predicted, float(missed / variance))

    def predicted(self, target: np.ndarray) -> np.ndarray:
        """A target : (K,), predicted at each sample from the other groups."""
        solution = self._solution(target)
        predicted = self.basis @ solution
        if self._leverage is not None:
            return np.asarray(predicted - self._leverage / (1.0 - self._leverage) * (target - predicted))
        for members, factor, side in zip(self._members, self._factors, self._sides(target, solution), strict=True):
            predicted[members] = self.basis[members] @ (solution - _solved(factor, side))
        return np.asarray(predicted)

    def without_pairs(self, target: np.ndarray) -> np.ndarray:
        """Coefficients : (1 + G, 1 + G, P) of a target : (K,) without each pair of the groups that were given.

        c[g, h] is without groups g - 1 and h - 1, where index 0 stands for no group.
        """
        solution = self._solution(target)
        none = np.zeros_like(self._gram)
        grams, sides = [none, *self._grams], [none[0], *self._sides(target, solution)]
        coefficients = np.empty((len(grams), len(grams), len(solution)))
        for g in range(len(grams)):
            for h in range(g, len(grams)):
                gram, side = (grams[g], sides[g]) if g == h else (grams[g] + grams[h], sides[g] + sides[h])
                left_out = self._natural(solution - _solved(self._factor_without(gram), side))
                coefficients[g, h] = coefficients[h, g] = left_out
        return coefficients

    def _solution(self, target: np.ndarray) -> np.ndarray:
        """Coefficients of the fit to all samples."""
        return _solved(self._factor, self.basis.T @ (self.weights * target))

    def _sides(self, target: np.ndarray, solution: np.ndarray) -> np.ndarray:
        """B_g' W e_g : (G, P) of each group."""
        residual = self.weights * (target - self.basis @ solution)
        return np.stack([self.basis[members].T @ residual[members] for members in self._members])

    def _natural(self, coefficients: np.ndarray) -> np.ndarray:
        """Coefficients of the terms that were given."""
        if self._change is None:
            return coefficients
        return np.asarray(scipy.linalg.solve_triangular(self._change, coefficients, check_finite=False))

    @cached_property
    def _factors(self) -> list[np.ndarray]:
        """The factors without each group."""
        return [self._factor_without(gram) for gram in self._grams]

    def _factor_without(self, gram: np.ndarray) -> np.ndarray:
        """The Cholesky factor of G less a part. Raises IllPosedError where that leaves nothing of a column."""
        factor = _cholesky(self._gram - gram)
        if not np.min(np.diag(factor) / np.diag(self._factor)) ** 2 > LEAST_FREEDOM:
            raise IllPosedError(f"without a group of samples a coefficient is undetermined: {FEWER_TERMS}", KEYS)
        return factor


def _members(chosen: np.ndarray) -> slice | np.ndarray:
    """Numbers of the samples of a group, as a slice where they follow each other: no copy."""
    numbers = np.flatnonzero(chosen)
    follows = numbers[-1] - numbers[0] == len(numbers) - 1
    return slice(int(numbers[0]), int(numbers[-1]) + 1) if follows else numbers


def _cholesky(gram: np.ndarray) -> np.ndarray:
    """The upper Cholesky factor; zero where a Gram matrix has none."""
    try:
        return np.asarray(scipy.linalg.cholesky(gram, check_finite=False))
    except np.linalg.LinAlgError:
        return np.zeros_like(gram)


def _condition(triangle: np.ndarray) -> float:
    singular = scipy.linalg.svdvals(triangle, check_finite=False)
    return float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf


def _solved(factor: np.ndarray, side: np.ndarray) -> np.ndarray:
    return np.asarray(scipy.linalg.cho_solve((factor, False), side, check_finite=False))
