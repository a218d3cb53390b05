"""Sparse expansions: least-angle regression ranks the terms, least squares and leave-one-out say how many to keep."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from roughslip.chaos.regression import (
    LARGEST_ERROR,
    LEAST_FREEDOM,
    WORST_CONDITION,
    Fit,
    checked,
    correction,
    distinct_samples,
    effective_samples,
    fit_distinct,
    variance_of_target,
)
from roughslip.errors import IllPosedError, ParameterError

LEAST_INDEPENDENT = 1e-6  # norm that a unit column must keep beside the active ones: else it is their combination
EXACT = 1e-13  # of the first correlation: what remains is rounding
LEAST_SAMPLES = 20  # with fewer some set out of many fits by chance
PATIENCE = 50  # terms beyond 1.5 times the best set, after which the path ends; whole paths never chose others
# Leave-one-out errors are held for equal within so much of sqrt(2 / N), the standard error of a mean of N squares.
# Of three functions with 70 to 400 samples errors at fresh points fell by up to 5 %; with 1 those of the least sparse
# one rose by 5 %.
ALIKE = 0.25


@dataclass(frozen=True)
class SparseFit:
    """The chosen terms and their fit.

    active : (A,) columns of the candidates, in the order in which they entered, the constant first
    fit : least squares on these columns alone, coefficients in the same order. They were chosen on the same samples, so
        that its errors are somewhat low
    errors : (steps,) corrected leave-one-out errors along the path, of 1, 2, ... terms; infinite where a set is refused
    """

    active: np.ndarray
    fit: Fit
    errors: np.ndarray


def sparse_least_squares(basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> SparseFit:
    """The few of many terms that explain a target, which may be more than the samples.

    basis : (K, P) candidates at the samples, orthonormal under their law, column 0 the constant 1
    target : (K,) what is expanded
    weights : (K,) [-] not negative, 1 if not given

    Returns the fit of the smallest set whose corrected leave-one-out error is hardly above the least on the path of
    least-angle regression. The path ends where a set of two thirds of the size has been the best for long. Its cost is
    a product of all candidates with a vector a step, and one QR of the columns that entered. Raises ParameterError for
    input that is not finite, of the wrong shape or without a constant; IllPosedError as `least_squares` and `checked`,
    and for fewer than LEAST_SAMPLES effective samples.

    Method: hybrid least-angle regression (Efron et al., Ann. Stat. 32 (2004) 407; Blatman and Sudret, J. Comput. Phys.
    230 (2011) 2345).
    """
    basis, target, weights, within = distinct_samples(basis, target, weights)
    if basis.shape[1] == 0 or not np.all(basis[:, 0] == 1):
        raise ParameterError("column 0 of the candidates must be the constant 1")
    effective = effective_samples(weights)
    if effective < LEAST_SAMPLES:
        raise IllPosedError(f"{effective:.0f} effective samples are too few to choose terms by: take {LEAST_SAMPLES}")
    variance = variance_of_target(target, weights, within)
    active, errors, best = [], [], 0
    for column, left_out, trace in _path(basis, target, weights, int(np.ceil(effective)) - 1):
        active.append(column)
        error = (left_out + within) / variance
        trusted = error * (trace - len(active) + 1) <= LARGEST_ERROR  # 1 / the least eigenvalue, if the others are 1
        errors.append(error * correction(len(active), effective, trace) if trusted else np.inf)
        if errors[-1] < errors[best]:
            best = len(errors) - 1
        if len(active) > 1.5 * best + PATIENCE:
            break
    enough = np.array(errors) <= errors[best] * (1.0 + ALIKE * np.sqrt(2.0 / effective))
    chosen = np.array(active[: int(np.argmax(enough)) + 1])
    columns = np.ascontiguousarray(basis[:, chosen])
    return SparseFit(chosen, checked(fit_distinct(columns, target, weights, within)), np.array(errors))


def _path(basis: np.ndarray, target: np.ndarray, weights: np.ndarray, most: int) -> Iterator[tuple[int, float, float]]:
    """Terms in the order of least-angle regression, each with the figures of the least-squares fit up to it.

    Yields the column, the mean square of the leave-one-out residuals and tr(C^-1), as `regression.correction` takes it.

    With the active columns X_A = Q R, the direction u = X_A (X_A' X_A)^-1 s = Q z with R' z = s, the signs. A new
    column adds one entry to z and one vector to the sum, so that a step costs one product with all the candidates.
    """
    root = np.sqrt(weights / weights.sum())
    terms = (root[:, None] * basis).T
    means = terms @ root
    unit = terms - means[:, None] * root
    norms = np.linalg.norm(unit, axis=1)
    free = norms > LEAST_INDEPENDENT * np.linalg.norm(terms, axis=1)
    free[0] = False
    unit[free] /= norms[free, None]
    refit = _Refit(root, root * target, most)
    yield 0, *refit.figures()
    correlation, slope, signed = unit @ refit.residual, np.zeros(len(unit)), np.zeros(most)
    largest = np.max(np.abs(correlation), where=free, initial=0.0)
    while free.any() and refit.count < most and not refit.exact:
        column, step = _next(correlation, slope, largest, free)
        if step >= largest:
            return
        correlation -= step * slope
        largest -= step
        free[column] = False
        row = refit.add(unit[column], norms[column], means[column])
        if row is None:
            continue
        new = refit.count - 1
        sign = np.sign(correlation[column])
        signed[new] = (sign * norms[column] - row[:-1] @ signed[:new]) / row[-1]
        slope += signed[new] * (unit @ refit.q[new])
        if refit.ill_posed:
            return
        yield column, *refit.figures()


def _next(correlation: np.ndarray, slope: np.ndarray, largest: float, free: np.ndarray) -> tuple[int, float]:
    """The free column whose correlation is the first to reach the falling one of the active columns, and when."""
    step = np.full(len(correlation), np.inf)
    for sign in (1.0, -1.0):
        closing = 1.0 - sign * slope
        ahead = free & (closing > 0)
        gap = np.maximum(largest - sign * correlation[ahead], 0.0)
        step[ahead] = np.minimum(step[ahead], gap / closing[ahead])
    column = int(np.argmin(step))
    return column, float(step[column])


class _Refit:
    """Least squares on a growing set of columns, with their leave-one-out residuals.

    q : (columns, K) orthonormal rows, the first the root of the weights
    inverse : of the triangular factor of the columns
    residual, leverage : (K,) of the weighted target
    """

    def __init__(self, root: np.ndarray, target: np.ndarray, most: int) -> None:
        self.q, self.inverse = np.empty((most, len(root))), np.zeros((most, most))
        self.q[0], self.inverse[0, 0] = root, 1.0
        self.sizes = np.ones(most)  # norms of the columns
        self.count, self.trace, self.unit_trace = 1, 1.0, 1.0
        self.residual, self.leverage = target - (root @ target) * root, root**2
        self.negligible = EXACT * np.linalg.norm(self.residual)

    @property
    def exact(self) -> bool:
        """Whether the target is met to rounding: what is left of it says nothing about further columns."""
        return bool(np.linalg.norm(self.residual) <= self.negligible)

    @property
    def ill_posed(self) -> bool:
        """Whether `least_squares` would refuse the set; its condition number from above, by Frobenius norms."""
        condition = np.sqrt(self.count * self.unit_trace)
        return bool(condition > WORST_CONDITION or np.max(self.leverage) > 1.0 - LEAST_FREEDOM)

    def figures(self) -> tuple[float, float]:
        """Mean square of the leave-one-out residuals, and tr(C^-1)."""
        return float(np.sum((self.residual / (1.0 - self.leverage)) ** 2)), self.trace

    def add(self, unit: np.ndarray, norm: float, mean: float) -> np.ndarray | None:
        """Add the column norm unit + mean root. Returns its column of the factor, None where it depends on the others.

        Gram-Schmidt with reorthogonalisation, twice being enough.
        """
        m, rest = self.count, unit
        row = np.zeros(m + 1)
        for _ in range(2):
            parts = self.q[:m] @ rest
            rest = rest - parts @ self.q[:m]
            row[:-1] += norm * parts
        own = np.linalg.norm(rest)
        if own < LEAST_INDEPENDENT:
            return None
        row[0], row[-1] = mean, norm * own
        q = rest / own
        self.q[m], self.count, self.sizes[m] = q, m + 1, np.hypot(norm, mean)
        self.inverse[:m, m] = -(self.inverse[:m, :m] @ row[:-1]) / row[-1]
        self.inverse[m, m] = 1.0 / row[-1]
        added = self.inverse[: m + 1, m]
        self.trace += float(added @ added)
        self.unit_trace += float(np.sum((self.sizes[: m + 1] * added) ** 2))
        self.residual = self.residual - (q @ self.residual) * q
        self.leverage = self.leverage + q**2
        return row
