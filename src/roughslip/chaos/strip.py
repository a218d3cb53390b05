"""One expansion along a stationary strip: the pressure field from the heights, without a contact solve.

Along the strip the field is stationary, so every node of a row shares the coefficients; the rows differ, since the
border of the contact is near for some and far for others. The variables are the local functionals of the heights,
whitened row by row; they do not depend on the penetration, so one basis serves all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.chaos.functionals import Stencil, local_functionals, whitening
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.pressure import PressureTarget, fit_all_samples


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
        """p : (levels, nx, ny) [Pa] for heights : (nx, ny) [m] of the strip it was fitted on, of any length."""
        functionals = local_functionals(heights, self.stencil)
        levels = self.coefficients.shape[2]
        field = np.empty((levels, *heights.shape))
        for row in range(heights.shape[1]):
            xi = functionals[:, :, row].T @ self.whiten[row].T
            field[:, :, row] = (hermite_basis(xi, self.indices) @ self.coefficients[row]).T
        return self.target.pressure(field)


def fit_strip(
    functionals: np.ndarray, target_values: np.ndarray, degree: int, stencil: Stencil, target: PressureTarget
) -> tuple[StripExpansion, dict[str, np.ndarray]]:
    """Fit the expansion row by row and penetration by penetration.

    functionals : (K, ny, 8) [m] local functionals at the training nodes
    target_values : (K, ny, levels) of `target` there
    Returns the expansion and, as (ny, levels) arrays, its quality: `leave_one_out`, `condition_number`,
    `effective_samples`. Neighbouring nodes are correlated, so leave-one-out is an optimistic figure here.
    Raises IllPosedError as the regression does.
    """
    rows, variables = functionals.shape[1:]
    levels = target_values.shape[2]
    indices = multi_indices(variables, degree)
    whiten = np.empty((rows, variables, variables))
    coefficients = np.empty((rows, len(indices), levels))
    quality = {name: np.empty((rows, levels)) for name in ("leave_one_out", "condition_number", "effective_samples")}
    for row in range(rows):
        whiten[row] = whitening(functionals[:, row])
        basis = hermite_basis(functionals[:, row] @ whiten[row].T, indices)
        for level in range(levels):
            fit = fit_all_samples(basis, target_values[:, row, level], target)
            coefficients[row, :, level] = fit.coefficients
            for name, array in quality.items():
                array[row, level] = getattr(fit, name)
    return StripExpansion(indices, whiten, coefficients, stencil, target), quality
