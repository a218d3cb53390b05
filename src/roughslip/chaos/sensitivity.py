"""Moments and Sobol' indices from the coefficients of an orthonormal expansion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import finite


@dataclass(frozen=True)
class Sensitivity:
    """Moments and Sobol' indices of an expansion.

    mean, variance : in the unit of the target, and its square
    first : (variables,) [-] share of the variance that a variable explains alone
    total : (variables,) [-] share of the variance of all terms that contain the variable
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
    indices, coefficients = finite("exponents", indices, 2), finite("coefficients", coefficients, 1)
    if coefficients.shape != indices.shape[:1]:
        raise ParameterError(
            f"a coefficient for each term is needed, not {coefficients.shape} for exponents {indices.shape}"
        )
    present = indices > 0
    order = present.sum(axis=1)
    size = np.max(np.abs(coefficients), initial=0.0)  # scaled, because squares could overflow or underflow
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


def sensitivity_to_directions(indices: np.ndarray, coefficients: np.ndarray, directions: np.ndarray) -> Sensitivity:
    """Sobol' indices of the normal variables xi for a Hermite expansion in rotated variables u = D xi.

    indices : (P, v) exponents
    coefficients : (P,) in the unit of the target
    directions : (v, M) D, orthonormal rows

    Returns the indices of xi : (M,). Raises as `sensitivity`, and ParameterError for rows that are not orthonormal.

    Method: only the part of u along d = D e_j, column j, depends on xi_j. The variables are rotated so that d lies
    along the first axis, which keeps the total degree. Then u_1 = |d| xi_j + (1 - |d|^2)^(1/2) eta with an independent
    normal eta. He_n(u_1) has the mean |d|^n He_n(xi_j) given xi_j, and (1 - |d|^2)^(n/2) He_n(eta) given all others.
    """
    plain = sensitivity(indices, coefficients)
    variables = indices.shape[1]
    if not np.allclose(directions @ directions.T, np.eye(variables), atol=1e-9):
        raise ParameterError("directions must be orthonormal rows")
    complete = multi_indices(variables, int(indices.sum(axis=1).max()))
    points = np.random.default_rng(0).standard_normal((4 * len(complete), variables))
    to_coefficients = np.linalg.pinv(hermite_basis(points, complete))
    first, total = np.empty(directions.shape[1]), np.empty(directions.shape[1])
    for mode, d in enumerate(directions.T):
        length = min(float(np.linalg.norm(d)), 1.0)
        rotated = to_coefficients @ (hermite_basis(points @ _first_along(d), indices) @ coefficients)
        squares, powers = rotated[1:] ** 2, complete[1:, 0]
        alone = powers == complete[1:].sum(axis=1)
        first[mode] = np.sum(squares[alone] * length ** (2.0 * powers[alone]))
        total[mode] = np.sum(squares * (1.0 - (1.0 - length**2) ** powers))
    return Sensitivity(plain.mean, plain.variance, first / plain.variance, total / plain.variance)


def _first_along(d: np.ndarray) -> np.ndarray:
    """An orthogonal matrix whose first row is along d : (v,); the unit matrix where d vanishes."""
    mirror = d / (np.linalg.norm(d) or 1.0) - np.eye(len(d))[0]
    square = mirror @ mirror
    return np.eye(len(d)) - (2.0 / square * np.outer(mirror, mirror) if np.any(d) and square > 0 else 0.0)


def sensitivity_along(direction: np.ndarray, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sobol' indices of the normal variables xi for functions sum_n h_n He_n(d xi) / sqrt(n!), one per node.

    direction : (M, nodes) d, unit vectors
    coefficients : (degree + 1, nodes) h

    Returns first, total : (M, nodes) [-]. Raises ParameterError for shapes that do not match or directions that are not
    of unit length, IllPosedError for a constant.

    Method: as `sensitivity_to_directions` with one variable. The share d_j^(2n) of h_n^2 is due to xi_j alone, and the
    share (1 - d_j^2)^n does not contain xi_j. For a set of modes, d_j^2 is the sum over the set.
    """
    if coefficients.ndim != 2 or direction.shape[1:] != coefficients.shape[1:]:
        raise ParameterError(f"directions {direction.shape} do not match coefficients {coefficients.shape}")
    squares = direction**2
    if not np.allclose(squares.sum(axis=0), 1.0, atol=1e-9):
        raise ParameterError("directions must be of unit length")
    return _shares(squares, coefficients)


def share_of_modes(direction: np.ndarray, coefficients: np.ndarray, modes: int) -> np.ndarray:
    """Share : (nodes,) [-] of the variance that the leading modes explain; arguments as `sensitivity_along`."""
    return _shares(np.sum(direction[:modes] ** 2, axis=0, keepdims=True), coefficients)[0][0]


def _shares(squares: np.ndarray, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    variance = np.sum(coefficients[1:] ** 2, axis=0)
    if not np.all(variance > 0):
        raise IllPosedError("the expansion is constant: there is no variance to share")
    first, without = np.zeros(squares.shape), np.zeros(squares.shape)
    for h in coefficients[:0:-1]:  # Horner
        first, without = squares * (h**2 + first), (1.0 - squares) * (h**2 + without)
    return first / variance, 1.0 - without / variance
