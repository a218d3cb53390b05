"""Regressions for expansion coefficients: weighted least squares, and censored regression by maximum likelihood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.special import log_ndtr, ndtr, ndtri

from roughslip.chaos.left_out import numbered, solve_definite
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.validation import finite, gate

CHOLESKY_CONDITION = 100.0  # of columns that are factorised by Cholesky, with an error of 1e-12
WORST_CONDITION = 1e8  # above it half the digits of the coefficients are rounding error
LEAST_FREEDOM = 1e-10  # of 1 - leverage: below it a residual is rounding error
LEAST_VARIATION = 1e-13  # of the target, relative to its magnitude: the rounding error of its mean

# Samples that differ by no more than this share of the root mean square of every term are taken as one point. Copies
# in single precision differ by less.
SAME_POINT = 1e-5

REMEDY = "take more samples, fewer variables or a lower degree"

STEPS = 60  # of Newton's method for a censored regression
HALVINGS = 40  # of each step
DECREMENT = 1e-16  # predicted rise of log L: the parameters are then within 1e-8 of their standard errors
LEAST_SCATTER = 1e-7  # relative to the target in contact; below it the scatter tends to zero and log L has no maximum
GOLDEN = 0.6180339887498949
LEAST_UNIFORM = 1e-300


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
            f"{samples} samples ({effective:.0f} effective) are too few for {terms} coefficients: {REMEDY}"
        )
    root = np.sqrt(weights)
    factor = factorised(root[:, None] * basis)
    q, r, norms = factor.q, factor.r, factor.norms
    projected = q.T @ (root * target)
    residual = root * target - q @ projected
    variance = float(np.average((target - np.average(target, weights=weights)) ** 2, weights=weights)) + within
    if not np.sqrt(variance) > LEAST_VARIATION * np.max(np.abs(target)):
        raise IllPosedError("the target is the same on every sample, so there is nothing to expand: use its value")
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


def factorised(basis: np.ndarray) -> Factor:
    """Factorise a (weighted) basis : (K, P).

    Raises IllPosedError where the samples are not more than the terms, a column vanishes, the condition number exceeds
    WORST_CONDITION, or a single sample determines a coefficient.
    """
    samples, terms = basis.shape
    if samples <= terms:
        raise IllPosedError(f"{samples} samples are too few for {terms} coefficients: {REMEDY}")
    norms = np.linalg.norm(basis, axis=0)
    if not np.all(norms > 0):
        raise IllPosedError(f"a term of the basis vanishes on every sample: {REMEDY}")
    q, r = orthonormal(basis / norms)
    singular = scipy.linalg.svdvals(r, check_finite=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    if condition > WORST_CONDITION:
        raise IllPosedError(f"condition number {condition:.1e} of {samples} samples for {terms} terms: {REMEDY}")
    freedom = 1.0 - np.einsum("kp,kp->k", q, q)
    if np.min(freedom) < LEAST_FREEDOM:
        raise IllPosedError(f"without sample {np.argmin(freedom)} a coefficient is undetermined: {REMEDY}")
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


@dataclass(frozen=True)
class CensoredFit:
    """Maximum of the likelihood of a censored regression.

    coefficients : (P,) beta in the unit of y
    scatter : sigma in the unit of y
    parameters : (P + 1,) theta, and h times `unit`
    unit : root mean square of y in contact
    """

    coefficients: np.ndarray
    scatter: float
    parameters: np.ndarray
    unit: float


@gate
def censored_regression(basis: np.ndarray, target: np.ndarray) -> CensoredFit:
    """Maximum likelihood of eq. (8), with the variable only known to be not positive out of contact.

    r = beta' psi + sigma e with e standard normal; y = r where r > 0, and elsewhere only r <= 0 is known.

    basis : (K, P) psi, terms at the samples
    target : (K,) y > 0 in contact, not positive out of contact; with all samples in contact it is least squares

    Raises ParameterError for input that is not finite or does not match. Raises IllPosedError where the samples in
    contact are not more than the coefficients or have no scatter, or where the terms are linearly dependent. Raises
    ConvergenceError with the decrement of the log-likelihood and the steps.

    Method: in theta = beta / sigma and h = 1 / sigma the log-likelihood is concave (Tobin, Econometrica 26 (1958) 24;
    Olsen, Econometrica 46 (1978) 1211). Newton's method, with steps halved until the likelihood rises::

        log L = sum_contact [log h - (h y - theta' psi)^2 / 2] + sum_out log Phi(-theta' psi)
    """
    basis, target = _checked(basis, target)
    contact, terms = target > 0, basis.shape[1]
    if contact.sum() <= terms:
        raise IllPosedError(
            f"{contact.sum()} of {len(target)} samples are in contact; a censored regression needs more than the "
            f"{terms} coefficients: take more samples or a deeper penetration, or a target that uses the gap"
        )
    unit = float(np.sqrt(np.mean(target[contact] ** 2)))
    rows = np.column_stack([basis, -np.where(contact, target / unit, 0.0)])
    found = _start(rows, contact)
    value = log_likelihood(rows, contact, found)
    decrement = np.inf
    for step in range(1, STEPS + 1):
        slope, weight = derivatives(rows, contact, found)
        score, information = rows.T @ slope, (rows.T * weight) @ rows
        score[-1] += contact.sum() / found[-1]
        information[-1, -1] += contact.sum() / found[-1] ** 2
        direction = solve_definite(information, score)
        decrement = float(score @ direction)
        size = 1.0
        for _ in range(HALVINGS):
            new = found + size * direction
            rise = log_likelihood(rows, contact, new) - value if new[-1] > 0 else -np.inf
            if decrement <= DECREMENT or rise >= 0.1 * size * decrement - 1e-13 * abs(value):
                break
            size /= 2
        else:
            raise ConvergenceError(
                "no step along Newton's direction raises the likelihood; take more samples", decrement, step
            )
        found, value = new, value + rise
        if found[-1] * LEAST_SCATTER > 1:
            raise IllPosedError("samples in contact have no scatter around the expansion: take trial_pressure")
        if decrement <= DECREMENT:
            return CensoredFit(found[:-1] / found[-1] * unit, unit / found[-1], found, unit)
    raise ConvergenceError("censored regression: log-likelihood; take more samples", decrement, STEPS)


def log_likelihood(rows: np.ndarray, contact: np.ndarray, parameters: np.ndarray) -> float:
    """log L [-] without its constant.

    rows : (K, P + 1) terms, and -y in contact or 0 out of it
    contact : (K,) bool
    parameters : (P + 1,) theta and h > 0
    """
    product = rows @ parameters
    quadratic = 0.5 * np.sum(product[contact] ** 2)
    return float(contact.sum() * np.log(parameters[-1]) - quadratic + np.sum(log_ndtr(-product[~contact])))


def derivatives(rows: np.ndarray, contact: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and negative second derivative of each sample's log-likelihood by rows @ parameters : (K,), (K,).

    Without log h, whose derivatives by h are 1 / h and -1 / h^2 for each sample in contact.
    """
    product = rows @ parameters
    hazard = _hazard(product)
    curvature = np.clip(hazard * (hazard - product), 0.0, 1.0)
    return np.where(contact, -product, -hazard), np.where(contact, 1.0, curvature)


def expected(fit: CensoredFit, predicted: np.ndarray, target: np.ndarray) -> np.ndarray:
    """r : (K,), out of contact its mean given r <= 0, from the predictions : (K,)."""
    return np.where(target > 0, target, predicted - fit.scatter * _hazard(predicted / fit.scatter))


def _hazard(z: np.ndarray) -> np.ndarray:
    """phi(z) / Phi(-z), also far out in the tails."""
    return np.asarray(np.exp(-0.5 * z**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(-z)))


def completed(predicted: np.ndarray, scatter: float, target: np.ndarray) -> np.ndarray:
    """r : (K,), out of contact a draw from its distribution given r <= 0.

    predicted : (K,) beta' psi
    scatter : sigma
    target : (K,) y

    The draws of neighbouring predictions are evenly distributed, by the golden ratio (Weyl, Math. Ann. 77 (1916) 313).
    """
    rank = np.empty(len(predicted))
    rank[np.argsort(predicted, kind="stable")] = np.arange(len(predicted))
    uniform = (0.5 + GOLDEN * rank) % 1.0
    share = np.maximum(uniform * ndtr(-predicted / scatter), LEAST_UNIFORM)
    drawn = np.minimum(predicted + scatter * ndtri(share), 0.0)
    return np.where(target > 0, target, drawn)


def _start(rows: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Initial parameters: least squares with zero out of contact."""
    basis, y = rows[:, :-1], -rows[:, -1]
    beta, _, rank, _ = np.linalg.lstsq(basis, y, rcond=None)
    if rank < basis.shape[1]:
        raise IllPosedError("terms of the basis are linearly dependent: take more samples or a lower degree")
    scatter = np.sqrt(np.mean((y - basis @ beta)[contact] ** 2))
    if not scatter > LEAST_SCATTER:
        raise IllPosedError("samples in contact have no scatter around the expansion: take trial_pressure")
    return np.append(beta, 1.0) / scatter
