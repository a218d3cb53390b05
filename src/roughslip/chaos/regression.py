"""Least-squares expansion coefficients with the figures that tell how far to trust them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError

WORST_CONDITION = 1e8  # half the digits of the coefficients are rounding there
LEAST_FREEDOM = 1e-10  # of 1 - leverage: below it a residual is rounding and says nothing about the sample left out
LEAST_VARIATION = 1e-13  # of the target, relative to its magnitude: what the rounding of its mean can leave

REMEDY = "take more samples, fewer variables or a lower degree"


@dataclass(frozen=True)
class Fit:
    """Coefficients of one regression and its quality.

    coefficients : (P,) in the unit of the target
    condition_number : [-] ratio of the extreme singular values of the weighted basis with unit columns
    samples : K, the samples that entered
    effective_samples : [-] (sum w)^2 / sum w^2 (Kish 1965); equals K for equal weights
    r_squared : [-] share of the weighted variance of the target that the expansion explains, in sample
    leave_one_out : [-] share of the weighted variance that the residuals keep when each sample is predicted from the
        others; 1 - leave_one_out is the honest R^2
    scatter : root mean square of these residuals, weighted, in the unit of the target
    """

    coefficients: np.ndarray
    condition_number: float
    samples: int
    effective_samples: float
    r_squared: float
    leave_one_out: float
    scatter: float


def least_squares(basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> Fit:
    """Coefficients that minimise the weighted sum of squares: eq. (10) with weights.

    basis : (K, P) terms at the samples
    target : (K,) what is expanded
    weights : (K,) [-] not negative, 1 if not given; only their ratios count

    Returns the fit. Raises ParameterError for input that is not finite or of the wrong shape; IllPosedError where the
    effective samples are not more than the terms, where a column vanishes, where the condition number exceeds
    WORST_CONDITION, where a single sample determines a coefficient, or where the target does not vary.

    Method: QR of the weighted basis with unit columns; leave-one-out residuals from the leverages, without refits
    (PRESS: Allen, Technometrics 16 (1974) 125; for expansions Blatman and Sudret, J. Comput. Phys. 230 (2011) 2345).
    """
    weights = _weights_of_samples(basis, target, weights)
    samples, terms = basis.shape
    effective = float(weights.sum() ** 2 / np.sum(weights**2))
    if min(samples, effective) <= terms:
        raise IllPosedError(
            f"{samples} samples ({effective:.0f} effective) are too few for {terms} coefficients: {REMEDY}"
        )
    root = np.sqrt(weights)
    weighted = root[:, None] * basis
    norms = np.linalg.norm(weighted, axis=0)
    if not np.all(norms > 0):
        raise IllPosedError(f"a term of the basis vanishes on every sample: {REMEDY}")
    q, r = scipy.linalg.qr(weighted / norms, mode="economic", check_finite=False)
    singular = scipy.linalg.svdvals(r, check_finite=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    if condition > WORST_CONDITION:
        raise IllPosedError(f"condition number {condition:.1e} of {samples} samples for {terms} terms: {REMEDY}")
    projected = q.T @ (root * target)
    residual = root * target - q @ projected
    freedom = 1.0 - np.einsum("kp,kp->k", q, q)
    if np.min(freedom) < LEAST_FREEDOM:
        raise IllPosedError(f"without sample {np.argmin(freedom)} a coefficient is undetermined: {REMEDY}")
    mean = np.average(target, weights=weights)
    variance = np.average((target - mean) ** 2, weights=weights)
    if not np.sqrt(variance) > LEAST_VARIATION * np.max(np.abs(target)):
        raise IllPosedError("the target is the same on every sample: there is nothing to expand")
    kept = np.sum((residual / freedom) ** 2) / weights.sum()
    return Fit(
        coefficients=scipy.linalg.solve_triangular(r, projected, check_finite=False) / norms,
        condition_number=condition,
        samples=samples,
        effective_samples=effective,
        r_squared=float(1.0 - np.sum(residual**2) / weights.sum() / variance),
        leave_one_out=float(kept / variance),
        scatter=float(np.sqrt(kept)),
    )


def _weights_of_samples(basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None) -> np.ndarray:
    """The weights with the largest 1, after a check of all input."""
    if basis.ndim != 2 or target.shape != basis.shape[:1]:
        raise ParameterError(f"a regression needs a target for each row of its basis: {target.shape}, {basis.shape}")
    weights = np.ones(len(basis)) if weights is None else weights
    if weights.shape != target.shape:
        raise ParameterError(f"a regression needs a weight for each target, not {weights.shape} for {target.shape}")
    if not (np.isfinite(basis).all() and np.isfinite(target).all() and np.isfinite(weights).all()):
        raise ParameterError("basis, target and weights of a regression must be finite")
    if np.any(weights < 0) or not np.any(weights > 0):
        raise ParameterError("weights of a regression must be non-negative and not all zero")
    return weights / weights.max()


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
