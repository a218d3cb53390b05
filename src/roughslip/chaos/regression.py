"""Least-squares expansion coefficients with the figures that tell how far to trust them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from roughslip.chaos.checks import finite
from roughslip.chaos.leave_group_out import numbered
from roughslip.errors import IllPosedError, ParameterError

WORST_CONDITION = 1e8  # half the digits of the coefficients are rounding there
LEAST_FREEDOM = 1e-10  # of 1 - leverage: below it a residual is rounding and says nothing about the sample left out
LEAST_VARIATION = 1e-13  # of the target, relative to its magnitude: what the rounding of its mean can leave

ALIKE = 1e-5  # of the root mean square of a term: samples that differ by no more in any of them are at one point, as
# copies in single precision are

FOLDS = 10
LARGEST_ERROR = 10.0  # variances of the target that an expansion may err by at fresh samples, as far as is known

REMEDY = "take more samples, fewer variables or a lower degree"


@dataclass(frozen=True)
class Fit:
    """Coefficients of one regression and its quality. Shares are of the weighted variance of the target.

    coefficients : (P,) in the unit of the target
    condition_number : [-] ratio of the extreme singular values of the weighted basis with unit columns
    samples : K, the distinct points that entered
    effective_samples : [-] (sum w)^2 / sum w^2 (Kish 1965); equals K for equal weights
    r_squared : [-] share that the expansion explains, in sample
    leave_one_out : [-] share that the residuals keep when each sample is predicted from the others; 1 - leave_one_out
        is the honest R^2
    corrected_leave_one_out : [-] the same times `correction`: what fresh samples cost where terms are many for the
        samples. By it expansions of one target are chosen
    least_eigenvalue : [-] of C = sum_k w_k psi_k psi_k' / sum_k w_k, which is the unit matrix for many samples of an
        orthonormal basis: the variance that a polynomial of these terms shows at the samples is at least so many times
        the one that it has. Errors may be as many times larger than the samples show
    cross_validation : [-] share that the residuals keep when each of 10 runs of neighbouring samples is predicted from
        the others; infinite where these do not determine the coefficients. Above leave_one_out where neighbours are
        alike
    scatter : root mean square of the leave-one-out residuals, weighted, in the unit of the target
    """

    coefficients: np.ndarray
    condition_number: float
    samples: int
    effective_samples: float
    r_squared: float
    leave_one_out: float
    corrected_leave_one_out: float
    least_eigenvalue: float
    cross_validation: float
    scatter: float

    @property
    def error_bound(self) -> float:
        """Share of the variance that fresh samples may cost: leave_one_out / least_eigenvalue.

        Method: the norm of a polynomial is to that at its samples at most as 1 to the root of the least eigenvalue
        (Cohen, Davenport and Leviatan, Found. Comput. Math. 13 (2013) 819).
        """
        return self.leave_one_out / self.least_eigenvalue if self.leave_one_out > 0 else 0.0


def least_squares(basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> Fit:
    """Coefficients that minimise the weighted sum of squares: eq. (10) with weights.

    basis : (K, P) terms at the samples; orthonormal under the law of the samples, which the corrected leave-one-out
        error asks, and nothing else
    target : (K,) what is expanded
    weights : (K,) [-] not negative, 1 if not given; only their ratios count

    Samples alike in all terms are one with their mean target and the sum of their weights, and are left out together:
    else each would predict the others, and leave-one-out would praise terms that pass through every point. What targets
    of one point scatter counts as error.

    Returns the fit. Raises ParameterError for input that is not finite or of the wrong shape; IllPosedError where the
    effective samples are not more than the terms, where a column vanishes, where the condition number exceeds
    WORST_CONDITION, where a single sample determines a coefficient, or where the target does not vary.

    Method: QR of the weighted basis with unit columns; residuals of samples and folds left out from the leverages,
    without refits (PRESS: Allen, Technometrics 16 (1974) 125; for expansions Blatman and Sudret, J. Comput. Phys. 230
    (2011) 2345).
    """
    return fit_distinct(*distinct_samples(basis, target, weights))


def fit_distinct(basis: np.ndarray, target: np.ndarray, weights: np.ndarray, within: float) -> Fit:
    """As `least_squares`, of what `distinct_samples` returns."""
    samples, terms = basis.shape
    effective = effective_samples(weights)
    if min(samples, effective) <= terms:
        raise IllPosedError(
            f"{samples} samples ({effective:.0f} effective) are too few for {terms} coefficients: {REMEDY}"
        )
    root = np.sqrt(weights)
    factor = factorised(root[:, None] * basis)
    q, r, norms = factor.q, factor.r, factor.norms
    projected = q.T @ (root * target)
    residual = root * target - q @ projected
    variance = variance_of_target(target, weights, within)
    inverse = scipy.linalg.solve_triangular(r, np.eye(terms), check_finite=False) / norms[:, None]
    trace = float(weights.sum() * np.sum(inverse**2))
    left_out = float(np.sum((residual / factor.freedom) ** 2) / weights.sum()) + within
    folds = np.sum(_folds_left_out(q, residual) ** 2) / weights.sum() + within
    return Fit(
        coefficients=scipy.linalg.solve_triangular(r, projected, check_finite=False) / norms,
        condition_number=factor.condition,
        samples=samples,
        effective_samples=effective,
        r_squared=float(1.0 - (np.sum(residual**2) / weights.sum() + within) / variance),
        leave_one_out=left_out / variance,
        corrected_leave_one_out=left_out / variance * correction(terms, effective, trace),
        least_eigenvalue=float(scipy.linalg.svdvals(r * norms, check_finite=False)[-1] ** 2 / weights.sum()),
        cross_validation=float(folds / variance),
        scatter=float(np.sqrt(left_out)),
    )


@dataclass(frozen=True)
class Factor:
    """Q R of a basis with unit columns, of which every regression on its samples is made.

    q, r : (K, P), (P, P)
    norms : (P,) of the columns
    condition : [-] ratio of the extreme singular values of the unit columns
    freedom : (K,) [-] 1 - leverage: a residual over it is that of the sample when it is left out
    """

    q: np.ndarray
    r: np.ndarray
    norms: np.ndarray
    condition: float
    freedom: np.ndarray


def factorised(basis: np.ndarray) -> Factor:
    """Factorise a (weighted) basis : (K, P).

    Raises IllPosedError where samples are not more than terms, a column vanishes, the condition number exceeds
    WORST_CONDITION, or a single sample determines a coefficient.
    """
    samples, terms = basis.shape
    if samples <= terms:
        raise IllPosedError(f"{samples} samples are too few for {terms} coefficients: {REMEDY}")
    norms = np.linalg.norm(basis, axis=0)
    if not np.all(norms > 0):
        raise IllPosedError(f"a term of the basis vanishes on every sample: {REMEDY}")
    q, r = scipy.linalg.qr(basis / norms, mode="economic", check_finite=False)
    singular = scipy.linalg.svdvals(r, check_finite=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    if condition > WORST_CONDITION:
        raise IllPosedError(f"condition number {condition:.1e} of {samples} samples for {terms} terms: {REMEDY}")
    freedom = 1.0 - np.einsum("kp,kp->k", q, q)
    if np.min(freedom) < LEAST_FREEDOM:
        raise IllPosedError(f"without sample {np.argmin(freedom)} a coefficient is undetermined: {REMEDY}")
    return Factor(q, r, norms, condition, freedom)


def checked(fit: Fit) -> Fit:
    """The fit of an orthonormal basis whose first term is the constant, where fresh samples cannot show wild errors.

    Raises IllPosedError where they could show more than LARGEST_ERROR variances of the target; also where it could be
    more than one and the expansion, by its coefficients, varies so many times as much as the target at the samples:
    then it is large where there were none.
    """
    variance = fit.scatter**2 / fit.leave_one_out if fit.leave_one_out > 0 else math.inf
    own = float(np.sum(fit.coefficients[1:] ** 2))
    if not fit.error_bound <= LARGEST_ERROR or (fit.error_bound > 1 and own > LARGEST_ERROR * variance):
        raise IllPosedError(
            f"{len(fit.coefficients)} terms could err by {fit.error_bound:.1e} variances of the target beyond their "
            f"{fit.samples} samples: {REMEDY}"
        )
    return fit


def correction(terms: int, effective: float, trace: float) -> float:
    """T(P, N) = N / (N - P) (1 + tr(C^-1) / N), by which leave-one-out errors are too small for the choice of a model.

    terms, effective : P and N > P, the effective samples
    trace : of the inverse of C = sum_k w_k psi_k psi_k' / sum_k w_k; near P for many samples of an orthonormal basis

    Method: Chapelle, Vapnik and Bengio, Machine Learning 48 (2002) 9; Blatman and Sudret (2011), eq. 23.
    """
    return effective / (effective - terms) * (1.0 + trace / effective)


def effective_samples(weights: np.ndarray) -> float:
    """(sum w)^2 / sum w^2 (Kish 1965) of weights : (K,)."""
    return float(weights.sum() ** 2 / np.sum(weights**2))


def variance_of_target(target: np.ndarray, weights: np.ndarray, within: float = 0.0) -> float:
    """Weighted variance of target : (K,), and what it scatters within points. IllPosedError where that is rounding."""
    variance = float(np.average((target - np.average(target, weights=weights)) ** 2, weights=weights)) + within
    if not np.sqrt(variance) > LEAST_VARIATION * np.max(np.abs(target)):
        raise IllPosedError("the target is the same on every sample: there is nothing to expand; take its value")
    return variance


def distinct_samples(
    basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """One sample a point, after a check of all input: none without weight, the largest weight 1.

    basis, target, weights : as in `least_squares`

    Returns them in the order in which the points first come, means over the samples of a point with the sum of their
    weights, and the mean square of the target about the mean of its point. Raises ParameterError for input that is not
    finite or of the wrong shape.
    """
    basis, target = finite("basis of a regression", basis, 2), finite("target of a regression", target, 1)
    if target.shape != basis.shape[:1]:
        raise ParameterError(f"a regression needs a target for each row of its basis: {target.shape}, {basis.shape}")
    weights = np.ones(len(basis)) if weights is None else finite("weights of a regression", weights)
    if weights.shape != target.shape:
        raise ParameterError(f"a regression needs a weight for each target, not {weights.shape} for {target.shape}")
    if np.any(weights < 0) or not np.any(weights > 0):
        raise ParameterError("weights of a regression must be non-negative and not all zero")
    kept = weights > 0
    basis, target, weights = basis[kept], target[kept], weights[kept] / weights.max()
    point = same_points(basis) if basis.shape[1] > 1 else np.arange(len(basis))  # a constant tells no samples apart
    count = int(point.max()) + 1
    if count == len(basis):
        return basis, target, weights, 0.0
    sums = np.bincount(point, weights)
    share = weights / sums[point]
    # About one sample of the point: the mean of equal numbers is then exactly theirs.
    first = np.unique(point, return_index=True)[1]
    mean = target[first] + np.bincount(point, share * (target - target[first[point]]))
    terms = basis[first]
    np.add.at(terms, point, share[:, None] * (basis - basis[first[point]]))
    within = float(np.average((target - mean[point]) ** 2, weights=weights))
    return terms, mean, sums / sums.max(), within


def same_points(basis: np.ndarray) -> np.ndarray:
    """(K,) number of the point of each sample, 0, 1, ... as they first come: those ALIKE in all terms share it.

    Such samples are neighbours in the order along any direction, here a fixed one at random.
    """
    size = np.sqrt(np.mean(basis**2, axis=0))
    direction = np.random.default_rng(0).standard_normal(basis.shape[1])
    along = basis @ np.divide(direction, size, out=np.zeros_like(size), where=size > 0)
    order = np.argsort(along, kind="stable")
    apart = np.ones(len(basis), dtype=bool)
    near = 1 + np.flatnonzero(np.diff(along[order]) <= ALIKE * np.abs(direction).sum())
    difference = np.abs(basis[order[near]] - basis[order[near - 1]])
    apart[near] = np.any(difference > ALIKE * size, axis=1)
    point = np.empty(len(basis), dtype=np.int64)
    point[order] = np.cumsum(apart) - 1
    return numbered(point)


def _folds_left_out(q: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """(K,) residuals of each fold of neighbouring samples when the others are fitted, from those of the whole fit.

    Method: (I - H)^-1 r with H = Q Q' the hat matrix of the fold (Cook and Weisberg, Residuals and Influence, 1982, eq.
    2.2.23), by the smaller of I - Q Q' and I - Q' Q.
    """
    left_out = np.full(residual.shape, np.inf)
    for fold in np.array_split(np.arange(len(q)), min(FOLDS, len(q))):
        block, wide = q[fold], len(fold) <= q.shape[1]
        gram = block @ block.T if wide else block.T @ block
        try:
            factor = scipy.linalg.cholesky(np.eye(len(gram)) - gram, lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            continue
        if np.min(np.diag(factor)) ** 2 < LEAST_FREEDOM:
            continue
        right = residual[fold] if wide else block.T @ residual[fold]
        solved = scipy.linalg.cho_solve((factor, True), right, check_finite=False)
        left_out[fold] = solved if wide else residual[fold] + block @ solved
    return left_out


def wild_coefficients(basis: np.ndarray, values: np.ndarray, weights: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Coefficients : (P, R) of refits to the fitted values plus the residuals times signs : (K, R).

    Every refit keeps all samples. Resampling would leave out more than a third of them, and with four samples a
    coefficient, as eq. (8) has, refits would be far worse than the fit (1.6 times its distance, in a trial).

    Method: wild bootstrap of residuals over sqrt(1 - leverage) (Wu, Ann. Stat. 14 (1986) 1261; Liu, Ann. Stat. 16
    (1988) 1696).
    """
    root = np.sqrt(weights)
    q, r = scipy.linalg.qr(root[:, None] * basis, mode="economic")
    projected = q.T @ (root * values)
    residual = (root * values - q @ projected) / np.sqrt(1.0 - np.einsum("kp,kp->k", q, q))
    return scipy.linalg.solve_triangular(r, projected[:, None] + q.T @ (residual[:, None] * signs))
