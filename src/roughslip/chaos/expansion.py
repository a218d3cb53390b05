"""Polynomial expansions of any target: all terms of a basis, the few that matter, or the degree that predicts best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roughslip.chaos.basis import Basis, Family, truncated
from roughslip.chaos.checks import whole
from roughslip.chaos.regression import Fit, checked, least_squares
from roughslip.chaos.sparse import sparse_least_squares
from roughslip.errors import IllPosedError, ParameterError


@dataclass(frozen=True)
class Expansion:
    """A polynomial of independent variables.

    basis : the terms that were kept
    fit : their coefficients, and how far to trust them
    """

    basis: Basis
    fit: Fit

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """values : (K,) at points : (K, variables). Raises ParameterError as the basis does."""
        return self.basis(points) @ self.fit.coefficients


def expand(
    points: np.ndarray, target: np.ndarray, basis: Basis, weights: np.ndarray | None = None, *, sparse: bool = False
) -> Expansion:
    """The expansion of a target by regression.

    points : (K, variables) [-] independent samples of the variables
    target : (K,) what is expanded
    basis : all terms, or with `sparse` the candidates, of which there may be more than samples
    weights : (K,) [-] not negative, 1 if not given; only their ratios count

    Raises ParameterError and IllPosedError as the basis and the regressions do, IllPosedError also where fresh points
    could show errors above LARGEST_ERROR.
    """
    values = basis(points)
    if not sparse:
        return Expansion(basis, checked(least_squares(values, target, weights)))
    found = sparse_least_squares(values, target, weights)
    return Expansion(basis.subset(found.active), found.fit)


def expand_adaptively(
    points: np.ndarray,
    target: np.ndarray,
    families: Sequence[Family],
    degrees: Sequence[int],
    weights: np.ndarray | None = None,
    *,
    norm: float = 1.0,
    interaction: int | None = None,
    sparse: bool = False,
) -> tuple[Expansion, np.ndarray]:
    """The expansion of the degree with the least corrected leave-one-out error.

    points, target, weights, sparse : as in `expand`
    families : of each variable
    degrees : to try, ascending; without `sparse` up to the last one that has fewer terms than there are samples
    norm, interaction : of the truncation at each degree

    Returns the expansion and errors : (degrees,) corrected leave-one-out of each, infinite where it was refused. Raises
    ParameterError as `expand` does, IllPosedError where every degree is refused.

    Method: Blatman and Sudret, J. Comput. Phys. 230 (2011) 2345, section 4.
    """
    degrees = [whole("degree of a basis", degree, 0) for degree in degrees]
    if len(degrees) == 0 or np.any(np.diff(degrees) <= 0):
        raise ParameterError(f"degrees to try must ascend, not {degrees}")
    tried: dict[int, Expansion] = {}
    refused: list[IllPosedError] = []
    for degree in degrees:
        basis = truncated(families, degree, norm=norm, interaction=interaction)
        if tried and not sparse and len(basis.indices) >= len(points):
            break
        try:
            tried[degree] = expand(points, target, basis, weights, sparse=sparse)
        except IllPosedError as error:
            refused.append(error)
    if not tried:
        raise refused[0]
    errors = np.array([tried[d].fit.corrected_leave_one_out if d in tried else np.inf for d in degrees])
    return tried[degrees[int(np.argmin(errors))]], errors
