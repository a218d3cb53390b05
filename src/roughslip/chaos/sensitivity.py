"""What the coefficients of an orthonormal expansion say at once: mean, variance and whose variance it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.errors import IllPosedError, ParameterError


@dataclass(frozen=True)
class Sensitivity:
    """Moments and Sobol' indices of an expansion.

    mean, variance : in the unit of the target, and its square
    first : (variables,) [-] share of the variance that a variable explains alone
    total : (variables,) [-] share that would go if the variable were known last: alone and in products
    """

    mean: float
    variance: float
    first: np.ndarray
    total: np.ndarray


def sensitivity(indices: np.ndarray, coefficients: np.ndarray) -> Sensitivity:
    """Moments and Sobol' indices from coefficients.

    indices : (P, variables) exponents, each term once
    coefficients : (P,) of orthonormal terms

    Raises ParameterError for coefficients that are not finite or do not match; IllPosedError for a constant.

    Method: Sobol', Math. Comput. Simul. 55 (2001) 271; Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964.
    """
    if indices.ndim != 2 or coefficients.shape != indices.shape[:1] or not np.isfinite(coefficients).all():
        raise ParameterError(
            f"a finite coefficient for each term is needed, not {coefficients.shape} for exponents {indices.shape}"
        )
    present = indices > 0
    order = present.sum(axis=1)
    size = np.max(np.abs(coefficients), initial=0.0)  # squares of what is far from 1 would leave the range
    shares = np.where(order > 0, (coefficients / (size or 1.0)) ** 2, 0.0)
    variance = float(shares.sum())
    if variance == 0:
        raise IllPosedError("the expansion is constant: there is no variance to share")
    return Sensitivity(
        mean=float(coefficients[order == 0].sum()),
        variance=variance * float(size) ** 2,
        first=shares @ (present & (order == 1)[:, None]) / variance,
        total=shares @ present / variance,
    )
