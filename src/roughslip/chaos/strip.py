"""One expansion along a stationary strip: the pressure field from the heights, without a contact solve.

Along the strip the field is stationary, so every node of a row shares the coefficients; the rows differ, since the
border of the contact is near for some and far for others. The variables are the local functionals of the heights,
whitened row by row; they do not depend on the penetration, so one basis serves all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.chaos.checks import finite
from roughslip.chaos.functionals import Stencil, local_functionals, whitening
from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.indices import multi_indices
from roughslip.chaos.pressure import PressureTarget, fit_all_samples
from roughslip.errors import IllPosedError, ParameterError

QUALITY = ("leave_one_out", "condition_number", "effective_samples")


@dataclass(frozen=True)
class StripExpansion:
    """Expansion of the target at every row and penetration.

    indices : (P, 8) exponents
    whiten : (ny, 8, 8) [1/m] from local functionals to variables of unit variance, a row
    coefficients : (ny, P, levels) in the unit of the target
    stencil : boxes of the local means
    target : how the target gives the pressure
    """

    indices: np.ndarray
    whiten: np.ndarray
    coefficients: np.ndarray
    stencil: Stencil
    target: PressureTarget

    def pressure(self, heights: np.ndarray) -> np.ndarray:
        """Pressure at every penetration.

        heights : (nx, ny) [m] a strip as wide as those of the fit, of any length

        Returns p : (levels, nx, ny) [Pa]. Raises ParameterError for another width or heights that are not finite.
        """
        rows, _, levels = self.coefficients.shape
        if heights.ndim != 2 or heights.shape[1] != rows:
            raise ParameterError(f"the expansion is of strips of {rows} rows, not of heights {heights.shape}")
        functionals = local_functionals(heights, self.stencil)
        values = np.empty((levels, *heights.shape))
        for row in range(rows):
            xi = functionals[:, :, row].T @ self.whiten[row].T
            values[:, :, row] = (hermite_basis(xi, self.indices) @ self.coefficients[row]).T
        return self.target.pressure(values)


def fit_strip(
    functionals: np.ndarray, target_values: np.ndarray, degree: int, stencil: Stencil, target: PressureTarget
) -> tuple[StripExpansion, dict[str, np.ndarray]]:
    """Fit the expansion row by row and penetration by penetration.

    functionals : (K, ny, 8) [m] local functionals at the training nodes
    target_values : (K, ny, levels) [Pa] or [Pa^2] values of `target` there
    degree : total degree of the expansion
    stencil : the boxes that the functionals were taken with

    Returns the expansion and, as (ny, levels) arrays, its QUALITY. Neighbouring nodes are correlated, so that
    leave-one-out is an optimistic figure here. Raises ParameterError for arrays that do not match, and IllPosedError as
    the whitening and the regression do.
    """
    functionals, target_values = finite("functionals", functionals, 3), finite("targets", target_values, 3)
    if functionals.shape[:2] != target_values.shape[:2]:
        raise ParameterError(f"functionals {functionals.shape} and targets {target_values.shape} must match")
    _, rows, variables = functionals.shape
    levels = target_values.shape[2]
    indices = multi_indices(variables, degree)
    whiten = np.empty((rows, variables, variables))
    coefficients = np.empty((rows, len(indices), levels))
    quality = {name: np.empty((rows, levels)) for name in QUALITY}
    for row in range(rows):
        whiten[row] = whitening(functionals[:, row])
        basis = hermite_basis(functionals[:, row] @ whiten[row].T, indices)
        for level in range(levels):
            try:
                fit = fit_all_samples(basis, target_values[:, row, level], target)
            except IllPosedError as error:
                raise IllPosedError(f"row {row} of the strip, penetration {level}: {error}") from error
            coefficients[row, :, level] = fit.coefficients
            for name, array in quality.items():
                array[row, level] = getattr(fit, name)
    return StripExpansion(indices, whiten, coefficients, stencil, target), quality
