"""Multivariate probabilists' Hermite polynomials, normalised: orthonormal under independent standard normals."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from roughslip.errors import ParameterError


def multi_indices(variables: int, degree: int) -> np.ndarray:
    """Exponents of all P = C(variables + degree, degree) terms up to a total degree.

    variables : number of variables, at least 1
    degree : largest total degree, at least 0

    Returns indices : (P, variables), ordered by total degree, so that a lower degree is a leading block and row 0 is
    the constant. Raises ParameterError.
    """
    if variables < 1 or degree < 0:
        raise ParameterError(f"a basis needs variables and a degree >= 0, not {variables} and {degree}")
    rows = [
        np.bincount(np.array(chosen, dtype=np.int64), minlength=variables)
        for total in range(degree + 1)
        for chosen in combinations_with_replacement(range(variables), total)
    ]
    return np.array(rows, dtype=np.int64)


def hermite_polynomials(x: np.ndarray, degree: int) -> np.ndarray:
    """He_n(x) / sqrt(n!) by three-term recurrence.

    x : (...) [-] points

    Returns values : (degree + 1, ...), n = 0 ... degree.
    """
    values = np.empty((degree + 1, *np.shape(x)))
    values[0] = 1.0
    if degree >= 1:
        values[1] = x
    for n in range(1, degree):
        values[n + 1] = (x * values[n] - np.sqrt(n) * values[n - 1]) / np.sqrt(n + 1)
    return values


def hermite_basis(xi: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Every term of the basis at every sample: the matrix Gamma of eq. (11).

    xi : (K, variables) [-] samples of the standard normal variables
    indices : (P, variables) exponents, from `multi_indices`

    Returns basis : (K, P). Raises ParameterError where the variables do not match or a sample is not finite.

    Method: products of one-dimensional polynomials (Ghanem and Spanos, Stochastic Finite Elements, 1991, ch. 2).
    """
    if xi.ndim != 2 or indices.ndim != 2 or xi.shape[1] != indices.shape[1]:
        raise ParameterError(f"samples {xi.shape} and exponents {indices.shape} must be tables of the same variables")
    if not np.isfinite(xi).all():
        raise ParameterError("samples of the variables must be finite")
    values = hermite_polynomials(np.ascontiguousarray(xi.T), int(indices.max()))  # (degree + 1, variables, K)
    basis = np.ones((len(indices), len(xi)))
    for term, exponents in zip(basis, indices, strict=True):
        for variable in np.flatnonzero(exponents):
            term *= values[exponents[variable], variable]
    return np.ascontiguousarray(basis.T)
