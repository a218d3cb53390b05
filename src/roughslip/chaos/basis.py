"""Orthonormal polynomials of independent variables, each standard normal or uniform on [-1, 1]."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from roughslip.chaos.checks import finite
from roughslip.chaos.indices import multi_indices
from roughslip.compilation import compiled
from roughslip.errors import ParameterError

Family = Literal["hermite", "legendre"]

POINTS = 256  # at which terms are multiplied together: 165 of them take 340 kB


@dataclass(frozen=True)
class Basis:
    """Products of one-dimensional polynomials (Ghanem and Spanos, Stochastic Finite Elements, 1991, ch. 2).

    indices : (P, variables) exponents, from `multi_indices`
    families : of each variable, "hermite" for a standard normal one, "legendre" for one uniform on [-1, 1]

    Raises ParameterError for an unknown family or as many families as there are not variables.
    """

    indices: np.ndarray
    families: tuple[Family, ...]

    def __post_init__(self) -> None:
        if self.indices.ndim != 2 or self.indices.shape[1] != len(self.families):
            raise ParameterError(
                f"exponents {self.indices.shape} must have a column for each of {len(self.families)} families"
            )
        if unknown := set(self.families) - set(get_args(Family)):
            raise ParameterError(f"families {sorted(unknown)} are not known: hermite or legendre")

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Every term at every point.

        points : (K, variables) [-]

        Returns values : (K, P). Raises ParameterError where the variables do not match, or a point is not finite or
        outside the interval of a uniform variable.
        """
        return np.ascontiguousarray(self.by_term(points).T)

    def by_term(self, points: np.ndarray) -> np.ndarray:
        """As the call, but (P, K): as it is built, without turning the table."""
        points = finite("points of the variables", points)
        if points.ndim != 2 or points.shape[1] != len(self.families):
            raise ParameterError(f"points {points.shape} must be a table of {len(self.families)} variables")
        along, highest = np.ascontiguousarray(points.T), int(self.indices.max(initial=0))
        values = np.empty((highest + 1, *along.shape))
        for family in set(self.families):
            rows = [row for row, one in enumerate(self.families) if one == family]
            values[:, rows] = POLYNOMIALS[family](along[rows], highest)
        table = np.empty((len(self.indices), len(points)))
        _multiply(values, *self._products, table)
        return table

    @cached_property
    def _products(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """starts : (P,) for each term an earlier one without its last variable, -1 if there is none
        ends : (P,) where the factors of a term end, those that it lacks of its start; the next term's follow
        factors : (n, 2) variable and exponent
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

    def subset(self, terms: np.ndarray) -> Basis:
        """The basis of these terms alone, by their row numbers."""
        return Basis(self.indices[terms], self.families)


def truncated(families: Sequence[Family], degree: int, *, norm: float = 1.0, interaction: int | None = None) -> Basis:
    """The basis of a truncation, as `multi_indices` describes it. Raises ParameterError as that and Basis do."""
    return Basis(multi_indices(len(families), degree, norm=norm, interaction=interaction), tuple(families))


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


def legendre_polynomials(x: np.ndarray, degree: int) -> np.ndarray:
    """sqrt(2 n + 1) P_n(x) by three-term recurrence: orthonormal under the uniform law on [-1, 1].

    x : (...) [-] points in [-1, 1]

    Returns values : (degree + 1, ...), n = 0 ... degree. Raises ParameterError for points outside.
    """
    if np.any(np.abs(x) > 1):
        raise ParameterError("a uniform variable must lie in [-1, 1]: map its interval to that")
    values = np.empty((degree + 1, *np.shape(x)))
    values[0] = 1.0
    if degree >= 1:
        values[1] = x
    for n in range(1, degree):
        values[n + 1] = ((2 * n + 1) * x * values[n] - n * values[n - 1]) / (n + 1)
    return values * np.sqrt(2 * np.arange(degree + 1) + 1.0).reshape(-1, *(1,) * np.ndim(x))


POLYNOMIALS: dict[Family, Callable[[np.ndarray, int], np.ndarray]] = {
    "hermite": hermite_polynomials,
    "legendre": legendre_polynomials,
}


@compiled()
def _multiply(values: np.ndarray, starts: np.ndarray, ends: np.ndarray, factors: np.ndarray, table: np.ndarray) -> None:
    """Writes every term at every point (P, K) from the polynomials (degree + 1, variables, K): a block of points at a
    time, so that the terms that others start from are still in the cache."""
    terms, points = table.shape
    for first in range(0, points, POINTS):
        end = min(first + POINTS, points)
        width, factor = end - first, 0
        for row in range(terms):
            term = table[row, first:end]
            if starts[row] < 0:
                term[:] = 1.0
            else:
                term[:] = table[starts[row], first:end]
            while factor < ends[row]:
                value = values[factors[factor, 1], factors[factor, 0], first:end]
                for k in range(width):
                    term[k] *= value[k]
                factor += 1
