"""What a linear fit would be without one or two groups of its samples, from sums over the groups.

Samples of one group (nodes of the same surfaces) depend on each other and are left out together. Without one group h
the fit predicts the samples of h as fresh ones. For the error of what is read off such predictions they are made again
without another group g, from fits that have seen neither g nor h. Were they kept, the law of the target given its
prediction would not follow the fit without g, and could not take back what changed in it: the error came out twice.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from roughslip.errors import IllPosedError


def numbered(rows: np.ndarray) -> np.ndarray:
    """(K,) number of each of the rows : (K, ...), 0, 1, ... as they first come; rows that are equal share it."""
    first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)[1:]
    return np.argsort(np.argsort(first))[number.ravel()]


def without_one(matrices: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Solutions of normal equations of all groups and without each.

    matrices : (G, P, P) each group's share of the matrix, symmetric
    sides : (G, P) its share of the right-hand side

    Returns c : (1 + G, P); c[0] of all groups, c[g] without group g - 1. Raises IllPosedError where a matrix is not
    positive definite.
    """
    matrix, side = matrices.sum(axis=0), sides.sum(axis=0)
    left_out = [_solved(matrix - m, side - s) for m, s in zip(matrices, sides, strict=True)]
    return np.stack([_solved(matrix, side), *left_out])


def without_two(matrices: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Solutions of normal equations without each pair of groups, from what `without_one` takes.

    Returns c : (1 + G, 1 + G, P), symmetric: c[0] and c[:, 0] as `without_one` has them, c[g, g] without group g - 1,
    and c[g, h] without g - 1 and h - 1. Raises as `without_one` does.
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
    """Each group's share of rows' W rows : (G, P, P) and of rows' values : (G, P).

    rows : (K, P); weights, values : (K,); group : (K,) numbers below `groups`
    """
    members = [np.flatnonzero(group == g) for g in range(groups)]
    matrices = np.stack([(rows[m].T * weights[m]) @ rows[m] for m in members])
    return matrices, np.stack([values[m] @ rows[m] for m in members])


def left_out_predictions(rows: np.ndarray, coefficients: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Each sample from the other groups.

    rows : (K, P) terms at the samples
    coefficients : (..., 1 + G, P) as `without_one` or `without_two` gives them

    Returns s : (..., K) without the sample's own group; of `without_two`, s[g] without group g - 1 as well.
    """
    found = np.empty((*coefficients.shape[:-2], len(rows)))
    for h in range(coefficients.shape[-2] - 1):
        members = np.flatnonzero(group == h)
        found[..., members] = coefficients[..., h + 1, :] @ rows[members].T
    return found
