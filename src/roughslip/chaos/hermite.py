"""Orthonormal Hermite polynomials of independent standard normal variables, and sets of their terms."""

from __future__ import annotations

import math
import warnings
from itertools import chain, combinations_with_replacement

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import ParameterError
from roughslip.validation import finite, gate, whole_at_least

MOST_TERMS = 20_000  # a table of as many terms at 5000 samples takes 0.8 GB
CORRELATED = 0.2  # correlation of two variables, below which shares of the variance err by a few per cent
BLOCK = 256  # points at which terms are multiplied at a time: 165 terms take 0.3 MB, which stays in the cache


@gate
def multi_indices(variables: int, degree: int) -> np.ndarray:
    """Exponents of all terms up to a total degree.

    variables : number of variables, at least 1
    degree : largest total degree, at least 0

    Returns indices : (P, variables) with P = C(variables + degree, degree), ordered by total degree, so that a lower
    degree is a leading block; row 0 is the constant. Raises ParameterError, also for more than MOST_TERMS terms.
    """
    variables = whole_at_least("variables", variables, 1)
    degree = whole_at_least("degree", degree, 0)
    terms = math.comb(variables + degree, degree)
    if terms > MOST_TERMS:
        raise ParameterError(
            f"degree {degree} in {variables} variables has {terms} terms, more than {MOST_TERMS}: lower one of them",
            scene_keys="expansion.degree",
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


@compiled()
def hermite_polynomials(x: np.ndarray, values: np.ndarray) -> None:
    """Write He_n(x) / sqrt(n!), n = 0 ... degree, by the three-term recurrence.

    x : (n,) [-] points
    values : (degree + 1, n) to write to
    """
    values[0] = 1.0
    if len(values) > 1:
        values[1] = x
    for n in range(1, len(values) - 1):
        less, scale = math.sqrt(n), 1.0 / math.sqrt(n + 1)
        for k in range(len(x)):
            values[n + 1, k] = (x[k] * values[n, k] - less * values[n - 1, k]) * scale


@gate
def hermite_basis(xi: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Every term of a basis at every sample: the matrix Gamma of eq. (11).

    xi : (K, variables) [-] samples of the standard normal variables
    indices : (P, variables) exponents, from `multi_indices`

    Returns basis : (K, P). Warns of samples with correlated variables. Raises ParameterError where the variables do not
    match or a sample is not finite.
    """
    xi = finite("xi", xi, 2)
    _warn_of_correlation(xi)
    return terms_at(xi, indices)


def terms_at(xi: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """The same without a warning, for variables that need not be independent, as those in contact."""
    return HermiteBasis(indices).by_term(xi.T).T


def _warn_of_correlation(xi: np.ndarray) -> None:
    """Warn of a correlation of two variables above CORRELATED, and five standard errors 1 / sqrt(K)."""
    if len(xi) <= 25 or not 2 <= xi.shape[1] <= 100:
        return
    moved = xi - xi.mean(axis=0)
    norm = np.sqrt(np.sum(moved**2, axis=0))
    correlation = np.triu(moved.T @ moved / np.maximum(np.outer(norm, norm), np.finfo(float).tiny), 1)
    i, j = np.unravel_index(np.argmax(np.abs(correlation)), correlation.shape)
    if abs(correlation[i, j]) > max(CORRELATED, 5 / math.sqrt(len(xi))):
        warnings.warn(
            f"variables {i} and {j} of `xi` have the correlation {correlation[i, j]:.2f}: terms are orthonormal in "
            "independent variables alone, so squares of coefficients are no shares of the variance: expand in "
            "independent ones, such as xi @ inv(cholesky(correlation)).T",
            stacklevel=4,
        )


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
        steps = []  # a term, the term that it starts from or -1, and what multiplies it
        rows: dict[tuple[tuple[int, int], ...], int] = {}
        for row, exponents in enumerate(indices.tolist()):
            factors = [(variable, exponent) for variable, exponent in enumerate(exponents) if exponent]
            start = rows.get(tuple(factors[:-1]), -1) if len(factors) > 1 else -1
            for variable, exponent in (factors if start < 0 else factors[-1:]) or [(0, 0)]:
                steps.append((row, start, variable, exponent))
                start = row
            rows[tuple(factors)] = row
        self._steps = np.array(steps, dtype=np.int64).reshape(-1, 4)

    def by_term(self, points: np.ndarray, table: np.ndarray | None = None) -> np.ndarray:
        """Every term at every point.

        points : (variables, K) [-]; table : (P, K) to write to

        Returns values : (P, K). Raises ParameterError where the variables do not match.
        """
        variables = self.indices.shape[-1]
        if len(points) != variables:
            raise ParameterError(f"points {points.T.shape} must be a table of {variables} variables")
        table = np.empty((len(self.indices), points.shape[1])) if table is None else table
        _terms(np.ascontiguousarray(points), self._steps, int(self.indices.max(initial=0)), table)
        return table


@compiled()
def _terms(points: np.ndarray, steps: np.ndarray, degree: int, table: np.ndarray) -> None:
    """Write every term at every point, some points at a time."""
    polynomials = np.empty((len(points), degree + 1, BLOCK))
    for first in range(0, points.shape[1], BLOCK):
        last = min(first + BLOCK, points.shape[1])
        for variable in range(len(points)):
            hermite_polynomials(points[variable, first:last], polynomials[variable, :, : last - first])
        for term, start, variable, exponent in steps:
            factor, product = polynomials[variable, exponent], table[term, first:last]
            if start < 0:
                product[:] = factor[: last - first]
            else:
                before = table[start, first:last]
                for k in range(last - first):
                    product[k] = before[k] * factor[k]
