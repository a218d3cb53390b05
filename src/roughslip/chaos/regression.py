"""Least-squares expansion coefficients with the figures that tell how far to trust them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError, ParameterError

WORST_CONDITION = 1e8  # half the digits of the coefficients are rounding there


@dataclass(frozen=True)
class Fit:
    """Coefficients of one regression and its quality.

    coefficients : (P,) in the unit of the target
    condition_number : ratio of the extreme singular values of the weighted basis with unit columns
    samples : K, the samples that entered
    effective_samples : (sum w)^2 / sum w^2, Kish; equals K without weights
    r_squared : share of the weighted variance of the target that the expansion explains, in sample
    leave_one_out : share of the weighted variance that leave-one-out residuals keep (Blatman 2009, eq. 4.22);
        1 - leave_one_out is the honest R^2
    scatter : standard deviation of the leave-one-out residual, weighted, in the unit of the target
    """

    coefficients: np.ndarray
    condition_number: float
    samples: int
    effective_samples: float
    r_squared: float
    leave_one_out: float
    scatter: float


def least_squares(basis: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> Fit:
    """Regression of target : (K,) on basis : (K, P) with weights : (K,), by QR of the basis with unit columns.

    Raises IllPosedError where the samples are not more than the terms, where a column vanishes, or where the
    condition number exceeds WORST_CONDITION: take more samples, fewer variables or a lower degree.
    """
    samples, terms = basis.shape
    weights = np.ones(samples) if weights is None else weights
    if not (np.all(np.isfinite(basis)) and np.all(np.isfinite(target)) and np.all(np.isfinite(weights))):
        raise ParameterError("basis, target and weights of a regression must be finite")
    if np.any(weights < 0) or not np.any(weights > 0):
        raise ParameterError("weights of a regression must be non-negative and not all zero")
    effective = float(weights.sum() ** 2 / np.sum(weights**2))
    if min(samples, effective) <= terms:
        raise IllPosedError(
            f"{samples} samples ({effective:.0f} effective) cannot determine {terms} coefficients: "
            "take more samples, fewer variables or a lower degree"
        )
    root = np.sqrt(weights)
    weighted = root[:, None] * basis
    norms = np.linalg.norm(weighted, axis=0)
    if not np.all(norms > 0):
        raise IllPosedError("a term of the basis vanishes on every sample: take fewer variables or other samples")
    q, r = scipy.linalg.qr(weighted / norms, mode="economic", check_finite=False)
    singular = scipy.linalg.svdvals(r, check_finite=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    if condition > WORST_CONDITION:
        raise IllPosedError(
            f"condition number {condition:.1e} of {samples} samples for {terms} coefficients: "
            "take more samples, fewer variables or a lower degree"
        )
    projected = q.T @ (root * target)
    coefficients = scipy.linalg.solve_triangular(r, projected, check_finite=False) / norms
    residual = root * target - q @ projected
    leverage = np.minimum(np.einsum("kp,kp->k", q, q), 1.0 - 1e-12)
    deleted = residual / (1.0 - leverage)
    total = weights.sum()
    mean = np.sum(weights * target) / total
    variance = np.sum(weights * (target - mean) ** 2) / total
    if variance <= 0:
        return Fit(coefficients, condition, samples, effective, 1.0, 0.0, 0.0)
    kept = np.sum(deleted**2) / total
    return Fit(
        coefficients=coefficients,
        condition_number=condition,
        samples=samples,
        effective_samples=effective,
        r_squared=float(1.0 - np.sum(residual**2) / total / variance),
        leave_one_out=float(kept / variance),
        scatter=float(np.sqrt(kept)),
    )
