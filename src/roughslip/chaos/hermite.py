"""Orthonormal Hermite polynomials of independent standard normal variables, sets of their terms, and Sobol' indices."""

from __future__ import annotations

import math
import warnings
from functools import cached_property
from itertools import chain, combinations_with_replacement

import numpy as np

from roughslip.chaos.regression import Fit
from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError, InaccurateWarning, ParameterError
from roughslip.validation import finite, gate, whole_at_least

MOST_TERMS = 20_000  # a table of as many terms at 5000 samples takes 0.8 GB
WORTHLESS = 0.2  # share of the variance that left-out samples miss: indices may err by as much
BLOCK = 256  # points at which terms are multiplied at a time: 165 terms take 340 kB, which stays in the cache


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
            "use fewer variables; scene keys: expansion.degree, expansion.variables"
        )
    products = (combinations_with_replacement(range(variables), total) for total in range(degree + 1))
    factors = (np.array(product, dtype=np.int64) for product in chain.from_iterable(products))
    return np.stack([np.bincount(product, minlength=variables) for product in factors])


def even_terms(indices: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """The terms that keep their sign under every symmetry of the response; the coefficients of the others vanish.

    indices : (P, variables) exponents
    odd : (variables, symmetries) 1 for a variable that changes sign under a symmetry, else 0

    A symmetry leaves the distribution of the variables and the response unchanged. A term that changes its sign
    under it therefore has no mean product with the response. Raises ParameterError for shapes that do not match.
    """
    if odd.ndim != 2 or len(odd) != indices.shape[1]:
        raise ParameterError(f"signs {odd.shape} must have a row for each of {indices.shape[1]} variables")
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


@gate
class HermiteBasis:
    """Products of Hermite polynomials (Ghanem and Spanos, Stochastic Finite Elements, 1991, ch. 2).

    indices : (P, variables) exponents, from `multi_indices`

    One object serves many calls: how each term follows from an earlier one is found once.
    """

    def __init__(self, indices: np.ndarray) -> None:
        self.indices = indices

    @gate
    def by_term(self, points: np.ndarray) -> np.ndarray:
        """Every term at every point.

        points : (K, variables) [-]

        Returns values : (P, K). Raises ParameterError where the variables do not match or a point is not finite.
        """
        points = finite("points", points, 2)
        values = self._polynomials(points)
        table = np.empty((len(self.indices), values.shape[2]))
        _multiply(values, *self._products, table)
        return table

    @gate
    def sums(self, points: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """Expansions at every point, without a table of the terms.

        points : (K, variables) [-]
        coefficients : (P, n) of n expansions

        Returns values : (n, K). Raises as `by_term`.
        """
        points = finite("points", points, 2)
        values = self._polynomials(points)
        sums = np.zeros((coefficients.shape[1], values.shape[2]))
        _add_terms(values, *self._products, np.ascontiguousarray(coefficients), sums)
        return sums

    def _polynomials(self, points: np.ndarray) -> np.ndarray:
        points = finite("points of the variables", points)
        variables = self.indices.shape[-1]
        if points.ndim != 2 or points.shape[1] != variables:
            raise ParameterError(f"points {points.shape} must be a table of {variables} variables")
        return hermite_polynomials(np.ascontiguousarray(points.T), int(self.indices.max(initial=0)))

    @cached_property
    def _products(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How each term is multiplied together.

        starts : (P,) an earlier term that lacks only the last variable of this one, -1 if there is none
        ends : (P,) where the remaining factors of a term end; those of the next term follow
        factors : (n, 2) variable and exponent of each factor
        """
        rows: dict[tuple[tuple[int, int], ...], int] = {}
        starts, ends, all_factors = np.full(len(self.indices), -1), np.zeros(len(self.indices), dtype=int), []
        for row, exponents in enumerate(self.indices):
            factors = [(int(variable), int(exponents[variable])) for variable in np.flatnonzero(exponents)]
            if len(factors) > 1:
                starts[row] = rows.get(tuple(factors[:-1]), -1)
            all_factors += factors if starts[row] < 0 else factors[-1:]
            ends[row] = len(all_factors)
            rows[tuple(factors)] = row
        return starts, ends, np.array(all_factors, dtype=int).reshape(-1, 2)


@compiled()
def _multiply(values: np.ndarray, starts: np.ndarray, ends: np.ndarray, factors: np.ndarray, table: np.ndarray) -> None:
    """Write every term at every point (P, K) from the polynomials (degree + 1, variables, K).

    Points are taken in blocks, so that the terms from which others start are still in the cache.
    """
    points = table.shape[1]
    for first in range(0, points, BLOCK):
        end = min(first + BLOCK, points)
        _multiply_block(values[:, :, first:end], starts, ends, factors, table[:, first:end])


@compiled()
def _multiply_block(
    values: np.ndarray, starts: np.ndarray, ends: np.ndarray, factors: np.ndarray, table: np.ndarray
) -> None:
    terms, width = table.shape
    factor = 0
    for row in range(terms):
        term = table[row]
        if starts[row] < 0:
            term[:] = 1.0
        else:
            earlier = table[starts[row]]
            for k in range(width):
                term[k] = earlier[k]
        while factor < ends[row]:
            value = values[factors[factor, 1], factors[factor, 0]]
            for k in range(width):
                term[k] *= value[k]
            factor += 1


@compiled(fastmath={"contract"})
def _add_terms(
    values: np.ndarray,
    starts: np.ndarray,
    ends: np.ndarray,
    factors: np.ndarray,
    coefficients: np.ndarray,
    sums: np.ndarray,
) -> None:
    """Add every term times its coefficients (P, n) to the sums (n, K), a block of points after the other.

    Four terms at a time, because a sum is read and written as often.
    """
    terms, expansions = coefficients.shape
    points = sums.shape[1]
    table = np.empty((terms, min(BLOCK, points)))
    for first in range(0, points, BLOCK):
        end = min(first + BLOCK, points)
        width = end - first
        block = table[:, :width]
        _multiply_block(values[:, :, first:end], starts, ends, factors, block)
        for row in range(0, terms - terms % 4, 4):
            t0, t1, t2, t3 = block[row], block[row + 1], block[row + 2], block[row + 3]
            for n in range(expansions):
                c0, c1, c2, c3 = (
                    coefficients[row, n],
                    coefficients[row + 1, n],
                    coefficients[row + 2, n],
                    coefficients[row + 3, n],
                )
                row_of_sums = sums[n, first:end]
                for k in range(width):
                    row_of_sums[k] += (c0 * t0[k] + c1 * t1[k]) + (c2 * t2[k] + c3 * t3[k])
        for row in range(terms - terms % 4, terms):
            for n in range(expansions):
                row_of_sums = sums[n, first:end]
                for k in range(width):
                    row_of_sums[k] += coefficients[row, n] * block[row, k]


@gate
def sobol_indices(indices: np.ndarray, coefficients: np.ndarray | Fit) -> tuple[np.ndarray, np.ndarray]:
    """Sobol' indices of the variables of an expansion.

    indices : (P, v) exponents, each term once
    coefficients : (P,) of the terms, or their fit

    Returns first, total : (v,) [-], shares of the variance that a variable explains alone, and with all others. Warns
    with InaccurateWarning where left-out samples of the fit miss more than WORTHLESS of the variance. Raises
    ParameterError for coefficients that are not finite or do not match, IllPosedError for a constant.

    Method: squares of coefficients are shares of the variance (Sobol', Math. Comput. Simul. 55 (2001) 271; Sudret,
    Reliab. Eng. Syst. Saf. 93 (2008) 964).
    """
    if isinstance(coefficients, Fit):
        missed = coefficients.leave_one_out
        if missed > WORTHLESS:
            text = f"the expansion misses {missed:.0%} of the variance of left-out samples, and indices may err by as "
            text += "much: take more samples, another degree, or polynomials for the distributions of the inputs"
            warnings.warn(text, InaccurateWarning, stacklevel=3)
        coefficients = coefficients.coefficients
    coefficients = finite("coefficients", coefficients, 1)
    if coefficients.shape != indices.shape[:1]:
        raise ParameterError(
            f"a coefficient for each term is needed, not {coefficients.shape} for exponents {indices.shape}"
        )
    present = indices > 0
    varying = np.where(present.any(axis=1), coefficients, 0.0)
    size = np.max(np.abs(varying), initial=0.0)
    if size == 0:
        raise IllPosedError("the expansion is constant, without a variance to share: take one that varies")
    shares = (varying / size) ** 2
    shares /= shares.sum()
    alone = present & (np.count_nonzero(present, axis=1) == 1)[:, None]
    return shares @ alone, shares @ present
