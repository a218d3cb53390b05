"""Multivariate probabilists' Hermite polynomials, normalised: orthonormal under independent standard normals."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from roughslip.errors import ParameterError


def multi_indices(variables: int, degree: int) -> np.ndarray:
    """indices : (P, variables) the exponents of all P = C(variables + degree, degree) terms up to the total degree.

    Ordered by degree, so that a lower degree is a leading block; the first row is the constant.
    """
    if variables < 1 or degree < 0:
        raise ParameterError(f"a basis needs variables and a degree >= 0, not {variables} and {degree}")
    rows = []
    for total in range(degree + 1):
        for chosen in combinations_with_replacement(range(variables), total):
            rows.append(np.bincount(np.array(chosen, dtype=int), minlength=variables))
    return np.array(rows, dtype=np.int64)


def hermite_polynomials(x: np.ndarray, degree: int) -> np.ndarray:
    """values : (degree + 1, *x.shape) He_n(x) / sqrt(n!) by their recurrence, n = 0 ... degree."""
    values = np.empty((degree + 1, *np.shape(x)))
    values[0] = 1.0
    if degree >= 1:
        values[1] = x
    for n in range(1, degree):
        values[n + 1] = (x * values[n] - np.sqrt(n) * values[n - 1]) / np.sqrt(n + 1)
    return values


def hermite_basis(xi: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """basis : (K, P) every term of `indices` at every sample of xi : (K, variables)."""
    degree = int(indices.max())
    values = hermite_polynomials(np.ascontiguousarray(xi.T), degree)  # (degree + 1, variables, K)
    basis = np.ones((len(indices), xi.shape[0]))
    for term, exponents in zip(basis, indices, strict=True):
        for variable in np.flatnonzero(exponents):
            term *= values[exponents[variable], variable]
    return np.ascontiguousarray(basis.T)
