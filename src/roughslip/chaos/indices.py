"""Which terms a polynomial basis has: sets of exponents, truncated by degree, by norm and by interaction order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from roughslip.chaos.checks import whole
from roughslip.errors import ParameterError, real

MOST_TERMS = 20_000  # a table of as many terms at 5000 samples takes 0.8 GB

Term = tuple[tuple[int, int], ...]  # (variable, exponent > 0), variables ascending


def multi_indices(variables: int, degree: int, *, norm: float = 1.0, interaction: int | None = None) -> np.ndarray:
    """Exponents alpha of all terms with (sum_i alpha_i^q)^(1/q) <= degree in at most so many variables at once.

    variables : number of variables, at least 1
    degree : largest degree, at least 0
    norm : q, above 0 and at most 1; 1 is the total degree with its C(variables + degree, degree) terms, a smaller one
        keeps the powers of one variable and drops products of many
    interaction : largest number of variables in a term, at least 1; not limited if None

    Returns indices : (P, variables), ordered by total degree, so that with q = 1 a lower degree is a leading block; row
    0 is the constant. Raises ParameterError, also for more than MOST_TERMS terms.

    Method: hyperbolic truncation (Blatman and Sudret, J. Comput. Phys. 230 (2011) 2345, eq. 18). A term without one of
    its variables is in the set as well, so a tree that adds variables in order visits nothing but terms.
    """
    variables, degree = whole("number of variables", variables, 1), whole("degree of a basis", degree, 0)
    if not 0 < real("norm of the truncation", norm) <= 1:
        raise ParameterError(f"the norm of the truncation must be above 0 and at most 1, not {norm}")
    most = variables if interaction is None else whole("number of variables in a term", interaction, 1)
    # A hair above the limit: terms on it, such as x y with q = 1/2 and degree 4, must not be lost to rounding.
    costs = np.append(np.arange(1.0, degree + 1) ** norm, np.inf)
    found = list(islice(_grow((), 0, degree**norm * (1 + 1e-12), most, variables, costs), MOST_TERMS + 1))
    if len(found) > MOST_TERMS:
        raise ParameterError(
            f"more than {MOST_TERMS} terms of degree {degree} and norm {norm:g} in {variables} variables: lower the "
            "degree, the norm or the interaction order, or use fewer variables"
        )
    indices = np.zeros((len(found), variables), dtype=np.int64)
    for row, term in zip(indices, found, strict=True):
        for variable, exponent in term:
            row[variable] = exponent
    return indices[np.argsort(indices.sum(axis=1), kind="stable")]


def even_terms(indices: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """The terms that keep their sign under every symmetry of what is expanded; of the others the coefficients vanish.

    indices : (P, variables) exponents
    odd : (variables, symmetries) 1 for a variable that changes sign under a symmetry, else 0

    A symmetry maps the law of the variables on itself and leaves the response alone, so that a term which it turns into
    its negative has no mean product with the response. Raises ParameterError for shapes that do not match.
    """
    if odd.ndim != 2 or len(odd) != indices.shape[1]:
        raise ParameterError(f"signs {odd.shape} must have a row for each of {indices.shape[1]} variables")
    return indices[np.all(indices @ odd % 2 == 0, axis=1)]


def _grow(term: Term, first: int, left: float, most: int, variables: int, costs: np.ndarray) -> Iterator[Term]:
    """The term and all that follow from it by factors of the variables from `first` on, high powers first."""
    yield term
    if most == 0:
        return
    highest = int(np.searchsorted(costs, left, side="right"))
    if highest == 0:
        return
    for variable in range(first, variables):
        for exponent in range(highest, 0, -1):
            grown = (*term, (variable, exponent))
            yield from _grow(grown, variable + 1, left - costs[exponent - 1], most - 1, variables, costs)
