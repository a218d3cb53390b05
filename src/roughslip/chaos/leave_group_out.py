"""Linear fits without one or two groups of their samples, from sums over the groups.

Samples of one group (nodes of the same surfaces) are dependent and are left out together. The fit without group h
predicts the samples of h as new ones. For jackknife errors of results that use such predictions, the predictions are
repeated without another group g, from fits that have seen neither g nor h. If the first predictions were kept, the
distribution of the target given its prediction would not follow the fit without g, and errors would come out doubled.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError


def numbered(rows: np.ndarray) -> np.ndarray:
    """Number : (K,) of each of the rows : (K, ...), in order of first appearance; equal rows have the same number."""
    first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)[1:]
    return np.argsort(np.argsort(first))[number.ravel()]


def without_one(matrices: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Solutions of normal equations with all groups, and without each group.

    matrices : (G, P, P) contribution of each group to the matrix, symmetric
    sides : (G, P) contribution of each group to the right-hand side

    Returns c : (1 + G, P); c[0] with all groups, c[g] without group g - 1. Raises IllPosedError where a matrix is not
    positive definite.
    """
    matrix, side = matrices.sum(axis=0), sides.sum(axis=0)
    left_out = [_solved(matrix - m, side - s) for m, s in zip(matrices, sides, strict=True)]
    return np.stack([_solved(matrix, side), *left_out])


def without_two(matrices: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Solutions of normal equations without each pair of groups.

    matrices, sides : as in `without_one`

    Returns c : (1 + G, 1 + G, P), symmetric. c[g, h] is without groups g - 1 and h - 1, where index 0 stands for no
    group. Raises as `without_one`.
    """
    groups, terms = sides.shape
    found = np.empty((1 + groups, 1 + groups, terms))
    found[0] = found[:, 0] = without_one(matrices, sides)
    for g in range(groups):
        rest, right = matrices.sum(axis=0) - matrices[g], sides.sum(axis=0) - sides[g]
        found[g + 1, g + 1] = found[0, g + 1]
        for h in range(g + 1, groups):
            found[g + 1, h + 1] = found[h + 1, g + 1] = _solved(rest - matrices[h], right - sides[h])
    return found


def _solved(matrix: np.ndarray, side: np.ndarray) -> np.ndarray:
    norms = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    try:
        if not np.all(norms > 0):
            raise np.linalg.LinAlgError
        factor = scipy.linalg.cho_factor(matrix / np.outer(norms, norms), check_finite=False)
    except np.linalg.LinAlgError as error:
        raise IllPosedError(
            "without a group or two of surfaces a coefficient is undetermined: take more samples, fewer variables or a "
            "lower degree"
        ) from error
    return np.asarray(scipy.linalg.cho_solve(factor, side / norms, check_finite=False)) / norms


def group_sums(
    rows: np.ndarray, weights: np.ndarray, values: np.ndarray, group: np.ndarray, groups: int
) -> tuple[np.ndarray, np.ndarray]:
    """Contributions of each group to rows' W rows : (G, P, P) and to rows' values : (G, P).

    rows : (K, P); weights, values : (K,); group : (K,) numbers below `groups`
    """
    members = [np.flatnonzero(group == g) for g in range(groups)]
    matrices = np.stack([(rows[m].T * weights[m]) @ rows[m] for m in members])
    return matrices, np.stack([values[m] @ rows[m] for m in members])


def left_out_predictions(rows: np.ndarray, coefficients: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Predictions of each sample from the other groups.

    rows : (K, P) terms at the samples
    coefficients : (..., 1 + G, P) result of `without_one` or `without_two`

    Returns s : (..., K) without the group of the sample; from `without_two`, s[g] is also without group g - 1.
    """
    found = np.empty((*coefficients.shape[:-2], len(rows)))
    for h in range(coefficients.shape[-2] - 1):
        members = np.flatnonzero(group == h)
        found[..., members] = coefficients[..., h + 1, :] @ rows[members].T
    return found
