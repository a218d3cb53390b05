"""Regression for expansion coefficients: weighted least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from roughslip.chaos.left_out import numbered
from roughslip.chaos.remedies import FEWER_TERMS, OTHER_PENETRATION
from roughslip.errors import IllPosedError, ParameterError
from roughslip.short_repr import short_repr
from roughslip.validation import finite, gate

CHOLESKY_CONDITION = 100.0  # of columns that are factorised by Cholesky, with an error of 1e-12
WORST_CONDITION = 1e8  # above it half the digits of the coefficients are rounding error
LEAST_FREEDOM = 1e-10  # of 1 - leverage: below it a residual is rounding error
LEAST_VARIATION = 1e-13  # of the target, relative to its magnitude: the rounding error of its mean

# Samples that differ by no more than this share of the root mean square of every term are taken as one point. Copies
# in single precision differ by less.
SAME_POINT = 1e-5


@short_repr
@dataclass(frozen=True)
class Fit:
    """Coefficients of one regression and its quality. Shares are of the weighted variance of the target.

    coefficients : (P,) in the unit of the target
    condition_number : [-] ratio of the extreme singular values of the weighted basis with unit columns
    samples : K, number of distinct points
    effective_samples : [-] (sum w)^2 / sum w^2 (Kish 1965); K for equal weights
    leave_one_out : [-] share that remains when each sample is predicted from the others
    """

    coefficients: np.ndarray
    condition_number: float
    samples: int
    effective_samples: float
    leave_one_out: float


@gate
def least_squares(basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> Fit:
    """Coefficients that minimise the weighted sum of squares: eq. (10) with weights.

    basis : (K, P) terms at the samples
    target : (K,) the expanded quantity
    weights : (K,) [-] not negative, 1 if not given; only their ratios matter

    Samples that agree in all terms count as one, with their mean target and the sum of their weights, and are left
    out together. Otherwise each would predict the others, and leave-one-out errors would be too small. The scatter of
    the targets at one point counts as error.

    Returns the fit. Raises ParameterError for input that is not finite or of the wrong shape. Raises IllPosedError as
    `factorised`, for effective samples that are not more than the terms, and for a constant target.

    Method: QR of the weighted basis with unit columns. Residuals of left-out samples follow from the leverages without
    refits (PRESS: Allen, Technometrics 16 (1974) 125; for expansions Blatman and Sudret, J. Comput. Phys. 230 (2011)
    2345).
    """
    basis, target, weights, within = _distinct_samples(basis, target, weights)
    samples, terms = basis.shape
    effective = float(weights.sum() ** 2 / np.sum(weights**2))
    if min(samples, effective) <= terms:
        raise IllPosedError(
            f"{samples} samples ({effective:.0f} effective) are too few for {terms} coefficients: {FEWER_TERMS}"
        )
    root = np.sqrt(weights)
    factor = factorised(root[:, None] * basis)
    q, r, norms = factor.q, factor.r, factor.norms
    projected = q.T @ (root * target)
    residual = root * target - q @ projected
    variance = float(np.average((target - np.average(target, weights=weights)) ** 2, weights=weights)) + within
    if not np.sqrt(variance) > LEAST_VARIATION * np.max(np.abs(target)):
        raise IllPosedError(f"the target is the same on every sample, {target[0]:.6g}: {OTHER_PENETRATION}")
    left_out = float(np.sum((residual / factor.freedom) ** 2) / weights.sum()) + within
    return Fit(
        coefficients=scipy.linalg.solve_triangular(r, projected, check_finite=False) / norms,
        condition_number=factor.condition,
        samples=samples,
        effective_samples=effective,
        leave_one_out=left_out / variance,
    )


@dataclass(frozen=True)
class Factor:
    """QR factors of a basis with unit columns, shared by all regressions on its samples.

    q, r : (K, P), (P, P)
    norms : (P,) of the columns
    condition : [-] ratio of the extreme singular values of the unit columns
    freedom : (K,) [-] 1 - leverage; a residual divided by it is the residual of the left-out sample
    """

    q: np.ndarray
    r: np.ndarray
    norms: np.ndarray
    condition: float
    freedom: np.ndarray


def factorised(basis: np.ndarray, remedy: str = FEWER_TERMS) -> Factor:
    """Factorise a (weighted) basis : (K, P). remedy : what an error says to try

    Raises IllPosedError where the samples are not more than the terms, a column vanishes, the condition number exceeds
    WORST_CONDITION, or a single sample determines a coefficient.
    """
    samples, terms = basis.shape
    if samples <= terms:
        raise IllPosedError(f"{samples} samples are too few for {terms} coefficients: {remedy}")
    norms = np.linalg.norm(basis, axis=0)
    if not np.all(norms > 0):
        raise IllPosedError(f"a term of the basis vanishes on every sample: {remedy}")
    q, r = orthonormal(basis / norms)
    singular = scipy.linalg.svdvals(r, check_finite=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    if condition > WORST_CONDITION:
        raise IllPosedError(
            f"condition number {condition:.1e} of {samples} samples for {terms} terms, more than "
            f"{WORST_CONDITION:.0e}: {remedy}"
        )
    freedom = 1.0 - np.einsum("kp,kp->k", q, q)
    if np.min(freedom) < LEAST_FREEDOM:
        raise IllPosedError(f"without sample {np.argmin(freedom)} a coefficient is undetermined: {remedy}")
    return Factor(q, r, norms, condition, freedom)


def orthonormal(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """QR factors (K, P), (P, P) of columns : (K, P); by Cholesky where that is exact, in half the time.

    The columns of Q are then orthonormal to 1e-16 times the squared condition number (Yamamoto et al., Electron. Trans.
    Numer. Anal. 44 (2015) 306), so to CHOLESKY_CONDITION^2 1e-16. Others are factorised by reflections.
    """
    gram = columns.T @ columns
    r, info = scipy.linalg.lapack.dpotrf(gram, clean=True)
    if info == 0 and np.linalg.cond(r) <= CHOLESKY_CONDITION:
        return scipy.linalg.solve_triangular(r, columns.T, trans="T", check_finite=False).T, r
    return scipy.linalg.qr(columns, mode="economic", check_finite=False)


def wild_coefficients(basis: np.ndarray, values: np.ndarray, weights: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Coefficients : (P, R) of refits to the fitted values plus the residuals times signs : (K, R).

    Every refit keeps all samples. Resampling would leave out more than a third of them; with four samples per
    coefficient, as eq. (8) has, its refits were 1.6 times as far from the truth as the fit.

    Method: wild bootstrap of residuals over sqrt(1 - leverage) (Wu, Ann. Stat. 14 (1986) 1261; Liu, Ann. Stat. 16
    (1988) 1696).
    """
    root = np.sqrt(weights)
    q, r = scipy.linalg.qr(root[:, None] * basis, mode="economic")
    projected = q.T @ (root * values)
    residual = (root * values - q @ projected) / np.sqrt(1.0 - np.einsum("kp,kp->k", q, q))
    return scipy.linalg.solve_triangular(r, projected[:, None] + q.T @ (residual[:, None] * signs))


def _checked(basis: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    basis, target = finite("basis of a regression", basis, 2), finite("target of a regression", target, 1)
    if target.shape != basis.shape[:1]:
        raise ParameterError(f"a regression needs a target for each row of its basis: {target.shape}, {basis.shape}")
    return basis, target


def _distinct_samples(
    basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Check the input of a regression and merge the samples that lie at one point.

    basis, target, weights : as in `least_squares`

    Returns them with one row for each point of positive weight, in order of first appearance, with a largest weight of
    1. The last value is the mean square of the target about the mean of its point. Raises ParameterError for input that
    is not finite or of the wrong shape.
    """
    basis, target = _checked(basis, target)
    weights = np.ones(len(basis)) if weights is None else finite("weights of a regression", weights)
    if weights.shape != target.shape:
        raise ParameterError(f"a regression needs a weight for each target, not {weights.shape} for {target.shape}")
    if np.any(weights < 0) or not np.any(weights > 0):
        raise ParameterError("weights of a regression must be non-negative and not all zero")
    kept = weights > 0
    basis, target, weights = basis[kept], target[kept], weights[kept] / weights.max()
    point = _point_numbers(basis) if basis.shape[1] > 1 else np.arange(len(basis))  # a constant cannot separate samples
    count = int(point.max()) + 1
    if count == len(basis):
        return basis, target, weights, 0.0
    sums = np.bincount(point, weights)
    share = weights / sums[point]
    # Relative to one sample of the point, so that the mean of equal numbers is exactly that number.
    first = np.unique(point, return_index=True)[1]
    mean = target[first] + np.bincount(point, share * (target - target[first[point]]))
    terms = basis[first]
    np.add.at(terms, point, share[:, None] * (basis - basis[first[point]]))
    within = float(np.average((target - mean[point]) ** 2, weights=weights))
    return terms, mean, sums / sums.max(), within


def _point_numbers(basis: np.ndarray) -> np.ndarray:
    """Number : (K,) of the point of each sample, counted in order of first appearance.

    Samples at one point are neighbours in the order along any direction; a fixed random direction is taken.
    """
    size = np.sqrt(np.mean(basis**2, axis=0))
    direction = np.random.default_rng(0).standard_normal(basis.shape[1])
    along = basis @ np.divide(direction, size, out=np.zeros_like(size), where=size > 0)
    order = np.argsort(along, kind="stable")
    apart = np.ones(len(basis), dtype=bool)
    near = 1 + np.flatnonzero(np.diff(along[order]) <= SAME_POINT * np.abs(direction).sum())
    difference = np.abs(basis[order[near]] - basis[order[near - 1]])
    apart[near] = np.any(difference > SAME_POINT * size, axis=1)
    point = np.empty(len(basis), dtype=np.int64)
    point[order] = np.cumsum(apart) - 1
    return numbered(point)
