"""Orthonormal Hermite polynomials of independent standard normal variables, and sets of their terms."""

from __future__ import annotations

import math
from itertools import chain, combinations_with_replacement

import numpy as np

from roughslip.errors import ParameterError
from roughslip.validation import finite, gate, whole_at_least

MOST_TERMS = 20_000  # a table of as many terms at 5000 samples takes 0.8 GB
BLOCK = 2048  # points at which terms are multiplied at a time: 165 terms take 2.7 MB, which stays in the cache


@gate
def multi_indices(variables: int, degree: int) -> np.ndarray:
    """Exponents of all terms up to a total degree.

    variables : number of variables, at least 1
    degree : largest total degree, at least 0

    Returns indices : (P, variables) with P = C(variables + degree, degree), ordered by total degree, so that a lower
    degree is a leading block; row 0 is the constant. Raises ParameterError, also for more than MOST_TERMS terms.
    """
    variables = whole_at_least("number of variables", variables, 1)
    degree = whole_at_least("degree of a basis", degree, 0)
    terms = math.comb(variables + degree, degree)
    if terms > MOST_TERMS:
        raise ParameterError(
            f"degree {degree} in {variables} variables has {terms} terms, more than {MOST_TERMS}: lower the degree or "
            "use fewer variables; scene key: expansion.degree"
        )
    products = (combinations_with_replacement(range(variables), total) for total in range(degree + 1))
    factors = (np.array(product, dtype=np.int64) for product in chain.from_iterable(products))
    return np.stack([np.bincount(product, minlength=variables) for product in factors])


def even_terms(indices: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """The terms that keep their sign under every symmetry of the response; the coefficients of the others vanish.

    indices : (P, variables) exponents
    odd : (variables, symmetries) 1 for a variable that changes sign under a symmetry, else 0

    A symmetry leaves the distribution of the variables and the response unchanged. A term that changes its sign
    under it therefore has no mean product with the response.
    """
    return indices[np.all(indices @ odd % 2 == 0, axis=1)]


def hermite_polynomials(x: np.ndarray, degree: int) -> np.ndarray:
    """He_n(x) / sqrt(n!) by the three-term recurrence.

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


@gate
def hermite_basis(xi: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Every term of a basis at every sample: the matrix Gamma of eq. (11).

    xi : (K, variables) [-] samples of the standard normal variables
    indices : (P, variables) exponents, from `multi_indices`

    Returns basis : (K, P). Raises ParameterError where the variables do not match or a sample is not finite.
    """
    xi = finite("xi", xi, 2)
    return np.ascontiguousarray(HermiteBasis(indices).by_term(xi).T)


class HermiteBasis:
    """Products of Hermite polynomials (Ghanem and Spanos, Stochastic Finite Elements, 1991, ch. 2).

    indices : (P, variables) exponents, from `multi_indices`

    One object serves many calls: how each term follows from an earlier one is found once.
    """

    def __init__(self, indices: np.ndarray) -> None:
        if indices.ndim != 2 or indices.dtype.kind not in "iu":
            raise ParameterError(
                f"indices must be whole numbers (terms, variables), not {indices.dtype} {indices.shape}"
            )
        self.indices = indices
        self.steps: list[tuple[int, list[tuple[int, int]]]] = []  # an earlier term or -1, and what multiplies it
        rows: dict[tuple[tuple[int, int], ...], int] = {}
        for row, exponents in enumerate(indices.tolist()):
            factors = [(variable, exponent) for variable, exponent in enumerate(exponents) if exponent]
            start = rows.get(tuple(factors[:-1]), -1) if len(factors) > 1 else -1
            self.steps.append((start, factors if start < 0 else factors[-1:]))
            rows[tuple(factors)] = row

    def by_term(self, points: np.ndarray) -> np.ndarray:
        """Every term at every point.

        points : (K, variables) [-]

        Returns values : (P, K). Raises ParameterError where the variables do not match or a point is not finite.
        """
        points = finite("points of the variables", points, 2)
        variables = self.indices.shape[-1]
        if points.shape[1] != variables:
            raise ParameterError(f"points {points.shape} must be a table of {variables} variables")
        values = hermite_polynomials(np.ascontiguousarray(points.T), int(self.indices.max(initial=0)))
        table = np.ones((len(self.indices), len(points)))
        for first in range(0, len(points), BLOCK):
            block, polynomials = table[:, first : first + BLOCK], values[:, :, first : first + BLOCK]
            for term, (start, factors) in zip(block, self.steps, strict=True):
                for variable, exponent in factors:
                    np.multiply(term if start < 0 else block[start], polynomials[exponent, variable], out=term)
        return table
