"""Censored regression: eq. (8), with the variable only known to be not positive out of contact.

    r = theta' psi / h + e / h,  e standard normal;   y = r where r > 0, elsewhere only r <= 0 is known.

In the parameters theta = beta / sigma and h = 1 / sigma the log-likelihood is concave. Newton's method finds its only
maximum:

    log L = sum_contact [log h - (h y - theta' psi)^2 / 2] + sum_out log Phi(-theta' psi)

Tobin, Econometrica 26 (1958) 24; Olsen, Econometrica 46 (1978) 1211.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.special import log_ndtr, ndtr, ndtri

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.validation import finite

STEPS = 60
HALVINGS = 40
DECREMENT = 1e-16  # predicted rise of log L: the parameters are then within 1e-8 of their standard errors
LEAST_SCATTER = 1e-7  # relative to the target in contact; below it the scatter tends to zero and log L has no maximum
GOLDEN = 0.6180339887498949
LEAST_UNIFORM = 1e-300


@dataclass(frozen=True)
class CensoredFit:
    """Maximum of the likelihood.

    coefficients : (P,) beta in the unit of y
    scatter : sigma in the unit of y
    log_likelihood : [-] with y in units of its root mean square in contact
    iterations : Newton steps
    parameters : (P + 1,) theta, and h times `unit`
    unit : root mean square of y in contact
    """

    coefficients: np.ndarray
    scatter: float
    log_likelihood: float
    iterations: int
    parameters: np.ndarray
    unit: float


def censored_regression(basis: np.ndarray, target: np.ndarray) -> CensoredFit:
    """Coefficients and scatter of maximum likelihood.

    basis : (K, P) terms at the samples
    target : (K,) y > 0 in contact, not positive out of contact; with all samples in contact it is least squares

    Raises ParameterError for input that is not finite or does not match. Raises IllPosedError where the samples in
    contact are not more than the coefficients or have no scatter, or where the terms are linearly dependent. Raises
    ConvergenceError with the decrement of the log-likelihood and the steps.

    Method: Newton in Olsen's parameters, with steps halved until the likelihood rises.
    """
    basis, target = finite("basis of a regression", basis, 2), finite("target of a regression", target, 1)
    if target.shape != basis.shape[:1]:
        raise ParameterError(f"a regression needs a target for each row of its basis: {target.shape}, {basis.shape}")
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
        direction = _newton_direction(information, score)
        decrement = float(score @ direction)
        size = 1.0
        for _ in range(HALVINGS):
            new = found + size * direction
            rise = log_likelihood(rows, contact, new) - value if new[-1] > 0 else -np.inf
            if decrement <= DECREMENT or rise >= 0.1 * size * decrement - 1e-13 * abs(value):
                break
            size /= 2
        else:
            raise ConvergenceError("no step along Newton's direction raises the likelihood", decrement, step)
        found, value = new, value + rise
        if found[-1] * LEAST_SCATTER > 1:
            raise IllPosedError("samples in contact have no scatter around the expansion: take trial_pressure")
        if decrement <= DECREMENT:
            return CensoredFit(found[:-1] / found[-1] * unit, unit / found[-1], float(value), step, found, unit)
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
    hazard = np.exp(-0.5 * product**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(-product))
    curvature = np.clip(hazard * (hazard - product), 0.0, 1.0)
    return np.where(contact, -product, -hazard), np.where(contact, 1.0, curvature)


def expected(fit: CensoredFit, predicted: np.ndarray, target: np.ndarray) -> np.ndarray:
    """r : (K,), out of contact its mean given r <= 0, from the predictions : (K,)."""
    z = predicted / fit.scatter
    hazard = np.exp(-0.5 * z**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(-z))
    return np.where(target > 0, target, predicted - fit.scatter * hazard)


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


def _newton_direction(information: np.ndarray, score: np.ndarray) -> np.ndarray:
    norms = np.sqrt(np.diag(information))
    try:
        factor = scipy.linalg.cho_factor(information / np.outer(norms, norms), check_finite=False)
    except np.linalg.LinAlgError as error:
        raise IllPosedError("the samples leave a coefficient undetermined: take more samples") from error
    return np.asarray(scipy.linalg.cho_solve(factor, score / norms, check_finite=False)) / norms
