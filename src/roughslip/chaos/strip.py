"""Expansion of the pressure along a stationary strip, from the heights and without a contact solve.

The field is stationary along the strip, so all nodes of a row share the coefficients. The rows differ, because their
distances from the border differ. The variables are the local functionals of the heights, whitened row by row. They do
not depend on the penetration, so one basis is enough for all penetrations. Contact probability and mean
pressure are tables over the predicted target, from its distribution at left-out strips (`scatter`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from roughslip.chaos.hermite import HermiteBasis, even_terms, multi_indices, terms_at
from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.regression import Regression
from roughslip.chaos.scatter import lowest_in_contact, residual_scatter
from roughslip.chaos.variables import HALF_TURN, NO_SYMMETRY, Stencil, local_functionals, whitening
from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError
from roughslip.results import described, result
from roughslip.validation import finite

ALL = slice(None)
GROUPS = 20  # largest number of groups of training strips, left out in turn
TABLE_PLACES = 2000  # evenly spaced up to the largest target, which near a border is some 40 times the mean
DRAWS = 200  # quantiles of the scatter over which a mean is taken


@result
class StripExpansion:
    """Expansion of the target at every row and penetration."""

    indices: np.ndarray = described("exponents")
    whiten: np.ndarray = described("for each row, from local functionals to variables of unit variance", "1/m")
    coefficients: np.ndarray = described("coefficients in the unit of the target", "1", "y P levels")
    stencil: Stencil = described("boxes of the local means")
    target: PressureTarget = described("how the target gives the pressure")

    @cached_property
    def _basis(self) -> HermiteBasis:
        return HermiteBasis(self.indices)

    def predicted(self, heights: np.ndarray, columns: slice = ALL) -> np.ndarray:
        """The target at every penetration.

        heights : (nx, ny) [m] a strip of the width of the fit and of any length
        columns : columns of the result

        Returns s : (levels, columns, ny) [target]. Raises ParameterError for heights that are not finite.
        """
        functionals = local_functionals(finite("heights", heights, 2), self.stencil)[:, columns].transpose(2, 0, 1)
        xi = self.whiten @ np.ascontiguousarray(functionals)
        values = np.empty((self.coefficients.shape[2], *xi[:, 0].shape))
        terms = np.empty((len(self.indices), xi.shape[2]))
        for row, coefficients in enumerate(self.coefficients):
            np.matmul(coefficients.T, self._basis.by_term(xi[row], terms), out=values[:, row])
        return values.transpose(0, 2, 1)


def fit_strip(
    functionals: np.ndarray,
    target_values: np.ndarray,
    degree: int,
    stencil: Stencil,
    target: PressureTarget,
    strip: np.ndarray,
    odd: np.ndarray = NO_SYMMETRY,
) -> tuple[StripExpansion, np.ndarray, np.ndarray]:
    """Fit the expansion row by row and penetration by penetration.

    functionals : (K, ny, 8) [m] local functionals at the training nodes
    target_values : (K, ny, levels) [Pa] or [Pa^2] values of `target` there
    degree : total degree of the expansion
    stencil : the boxes of the functionals
    strip : (K,) number of the strip of each node; strips are left out in at most GROUPS groups
    odd : (8, symmetries) 1 for a functional that changes sign under a symmetry of the strip that keeps every row, else
        0; terms that change sign are left out

    Returns the expansion; (ny, levels) [-] the share of the variance that predictions of left-out samples miss; and
    (levels, K, ny) [target] these predictions. Raises IllPosedError as the whitening and the
    regression.
    """
    nodes, rows, variables = functionals.shape
    levels = target_values.shape[2]
    group = np.unique(strip, return_inverse=True)[1] % GROUPS
    order = np.argsort(group, kind="stable")  # groups in one piece are not copied
    functionals, target_values, group = functionals[order], target_values[order], group[order]
    indices = even_terms(multi_indices(variables, degree), odd)
    whiten = np.empty((rows, variables, variables))
    coefficients = np.empty((rows, len(indices), levels))
    missed, predicted = np.empty((rows, levels)), np.empty((levels, nodes, rows))
    for row in range(rows):
        whiten[row] = whitening(functionals[:, row], odd)
        basis = terms_at(functionals[:, row] @ whiten[row].T, indices)
        regression = None
        for level in range(levels):
            values = np.ascontiguousarray(target_values[:, row, level])
            weights = target.weights(values)
            try:
                if regression is None or not np.array_equal(weights, regression.weights):
                    regression = Regression(basis, weights, group)
                fit = regression.fit(values)
            except IllPosedError as error:
                where = f"row {row} of the strip, penetration {level} (both from 0 on)"
                raise IllPosedError(f"{where}: {error}", error.scene_keys) from error
            coefficients[row, :, level], missed[row, level] = fit.coefficients, fit.leave_one_out
            predicted[level, order, row] = fit.predicted
    return StripExpansion(indices, whiten, coefficients, stencil, target), missed, predicted


def turned_to_half(functionals: np.ndarray, target_values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Training nodes of one half of the rows, with those of the other half after half a turn of the strip.

    functionals, target_values : (K, ny, 8), (K, ny, levels) as in `fit_strip`

    Returns both as (2 K, (ny + 1) // 2, ...). Half a turn does not change the distribution of a stationary surface nor
    the half-space. A row and its mirror row are therefore equivalent: twice the samples for half the fits.
    """
    half = (functionals.shape[1] + 1) // 2
    pairs = ((functionals, functionals[:, ::-1] * HALF_TURN), (target_values, target_values[:, ::-1]))
    folded = [np.ascontiguousarray(np.concatenate(pair)[:, :half]) for pair in pairs]
    return folded[0], folded[1]


def on_all_rows(half: StripExpansion, rows: int) -> StripExpansion:
    """The expansion for all rows from that of the rows up to the middle one."""
    turned = np.flip(np.arange(rows // 2))
    return replace(
        half,
        whiten=np.concatenate([half.whiten, half.whiten[turned] * HALF_TURN]),
        coefficients=np.concatenate([half.coefficients, half.coefficients[turned]]),
    )


@dataclass(frozen=True)
class ConditionalMeans:
    """Contact probability and mean pressure as tables over the prediction, one for each penetration.

    target : how a target gives the pressure
    low, step : (levels,) [target] first place of each table, and distance between places
    scatter : (levels,) [target] root mean square of the target around m(s)
    expected : (levels, TABLE_PLACES, 2) [-], [Pa] P(contact | s) and E[p | s]
    """

    target: PressureTarget
    low: np.ndarray
    step: np.ndarray
    scatter: np.ndarray
    expected: np.ndarray

    def summed(self, predicted: np.ndarray) -> np.ndarray:
        """Contact probability [-] and mean pressure [Pa], summed over rows, at predictions : (levels, n, rows).

        Linear between places, zero below the first, and constant above the last, the largest true target, because
        polynomials grow without bound. A scatter narrower than two places is not resolved and is neglected.

        Returns (2, levels, n).
        """
        sums = np.zeros((2, *predicted.shape[:2]))
        for level, s in enumerate(predicted.transpose(0, 2, 1)):
            if self.scatter[level] <= 2 * self.step[level]:
                sums[:, level] = (s > 0).sum(axis=0), self.target.pressure(s).sum(axis=0)
            else:
                _interpolate(
                    np.ascontiguousarray(s), self.low[level], self.step[level], self.expected[level], sums[:, level]
                )
        return sums


@compiled()
def _interpolate(s: np.ndarray, low: float, step: float, table: np.ndarray, sums: np.ndarray) -> None:
    """Add both columns of a table : (places, 2), linear between places, at predictions s : (rows, n) to sums."""
    last = len(table) - 1.0
    for row in range(len(s)):
        for k in range(s.shape[1]):
            place = min((s[row, k] - low) / step, last)
            if place > 0:
                below = min(int(place), len(table) - 2)
                share = place - below
                for column in range(2):
                    first = table[below, column]
                    sums[column, k] += first + share * (table[below + 1, column] - first)


def conditional_means(predicted: np.ndarray, values: np.ndarray, target: PressureTarget) -> ConditionalMeans:
    """Tabulate contact probability and mean pressure from predictions of samples that the fit has not seen.

    predicted, values : (levels, n) [target] predictions and true values, at n nodes of all rows
    target : how a target gives the pressure

    Returns the tables. Raises IllPosedError as `residual_scatter` for too few samples near contact.
    """
    levels = len(predicted)
    low, step, scatter = np.empty((3, levels))
    expected = np.empty((levels, TABLE_PLACES, 2))
    for level, (s, value) in enumerate(zip(predicted, values, strict=True)):
        near = s >= lowest_in_contact(s, value, value > 0)
        distribution = residual_scatter(s[near], value[near])
        places = np.linspace(distribution.low, min(distribution.high, float(value.max())), TABLE_PLACES)
        drawn = distribution.draw_evenly(places, DRAWS)
        low[level], step[level] = places[0], places[1] - places[0]
        scatter[level] = np.sqrt(np.mean((value[near] - distribution.centre(s[near])) ** 2))
        expected[level] = np.stack([(drawn > 0).mean(axis=1), target.pressure(drawn).mean(axis=1)], axis=1)
    return ConditionalMeans(target, low, step, scatter, expected)
