"""How many variables an expansion takes, and which: as many as asked, or as predict left-out surfaces best.

The candidates are nested: variables in their order, the given ones (leading modes, or local functionals of the heights)
and behind them the directions in which the residual of all given ones still varies (see `directions`).

Directions that were found at a surface fit it too well: with four of them the score of left-out surfaces fell by 7 %
where that of fresh ones rose by as much. So a surface is scored in directions that were found on the other half of the
surfaces. Of numbers whose scores cannot be told apart the least is taken: within one standard error of the best, of the
difference over the groups of surfaces (Breiman, Friedman, Olshen and Stone, Classification and Regression Trees, 1984).

The jackknife of the expansion that is taken holds its directions fixed: it does not know of their own scatter. Nor is
the direction of a regression (`regressed`) found anew without a surface that it is scored at.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from roughslip.chaos.directions import residual_directions
from roughslip.chaos.functionals import orthonormal_directions
from roughslip.chaos.local import GROUPS, LocalExpansion, Samples, fit_best, fit_local
from roughslip.chaos.pressure import Kind, PressureTarget
from roughslip.chaos.regression import least_squares
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.limits import VARIABLE_COUNTS as COUNTS

LEAST_SAMPLES = 5  # surfaces times nodes for each term of a number of variables to choose from
SIGNS = 1  # seed of the random signs of directions


@dataclass(frozen=True)
class Chosen:
    """An expansion, in the variables that it takes.

    expansion, samples : its fit, and what it was fitted to
    rotation : (v, candidates) orthonormal rows, from the candidates to its variables
    targets : score of every kind of target, NaN where its fit is refused
    counts : numbers of variables that were tried, ascending
    scores : (counts,) [-] at left-out surfaces, NaN where the fit is refused
    errors : (counts,) [-] standard error of how much more each is than the least
    """

    expansion: LocalExpansion
    samples: Samples
    rotation: np.ndarray
    targets: dict[Kind, float]
    counts: tuple[int, ...]
    scores: np.ndarray
    errors: np.ndarray


def turned(samples: Samples, rotation: np.ndarray) -> Samples:
    """The samples in variables rotation @ u; what symmetries do is known of those that are variables of before."""
    chosen = rotation != 0
    known = np.all(chosen.sum(axis=1) == 1)
    odd = chosen @ samples.odd if samples.odd.size and known else np.zeros((0, 0), dtype=np.int64)
    return replace(samples, variables=samples.variables @ rotation.T, odd=odd)


def fit_count(
    samples: Samples,
    given: int,
    count: int | None,
    degree: int,
    targets: Sequence[PressureTarget],
    *,
    regression: bool = False,
) -> Chosen:
    """The expansion in so many variables, or in the number of COUNTS that predicts left-out surfaces best.

    samples : in all candidates: the given variables, then a frame of others (see `moving_frame`)
    given : number of the former, at least 1
    count : number of variables, None if it is to be found
    degree, targets : as in `fit_best`; where the number is to be found, the target is the best in the given variables
    regression : the regression direction in all candidates comes first, before the given variables, see `regressed`

    Raises ParameterError for numbers out of range; IllPosedError where more variables are asked for than directions
    stand out of the noise; else as `fit_best` does.
    """
    candidates, rows = samples.variables.shape[2], samples.pressure.size
    if not 1 <= given <= candidates or not (count is None or 1 <= count <= candidates):
        raise ParameterError(f"{count} variables, {given} of them given, cannot be had of {candidates} candidates")
    if regression:
        first = regressed(samples, given, targets[0])
        chosen = fit_count(turned(samples, first), given, count, degree, targets)
        return replace(chosen, rotation=chosen.rotation @ first)
    if count is None:
        return _least(samples, given, [c for c in COUNTS if _enough(rows, c, degree)], degree, targets)
    rotation = np.eye(candidates)[: min(count, given)]
    if count > given:
        whole, _ = fit_best(turned(samples, rotation), degree, targets)
        offered, number = _offered(samples, given, whole, slice(None))
        if given + number < count:
            raise IllPosedError(
                f"{count} variables were asked for, but beyond the first {given} only {number} directions stand "
                f"out of the noise of {len(samples.pressure)} surfaces: take more samples or fewer variables"
            )
        rotation = np.vstack([rotation, offered[: count - given]])
    last = turned(samples, rotation)
    found, kinds = fit_best(last, degree, targets)
    return Chosen(found, last, rotation, kinds, (count,), np.array([found.score]), np.zeros(1))


def regressed(samples: Samples, given: int, target: PressureTarget) -> np.ndarray:
    """Rotation : (candidates, candidates) after which the direction of a linear regression comes first.

    samples, given : as in `fit_count`
    target : what is regressed, weighted as it asks

    After it come the given variables, as far as they are independent of it, and what is left. A monotone function of
    one direction shows that direction in a linear regression whatever the function (Brillinger, in A Festschrift for
    Erich L. Lehmann, 1982, 97; Li and Duan, Ann. Stat. 17 (1989) 1009). As it is found at all surfaces, scores of
    left-out ones are up to 5 % too good on the paper's square. Raises IllPosedError as the regression does.
    """
    candidates = samples.variables.shape[2]
    values = target.values(samples.pressure, samples.gap).ravel()
    basis = np.column_stack([np.ones(len(values)), samples.variables.reshape(-1, candidates)])
    slope = least_squares(basis, values, target.weights(values)).coefficients[1:]
    leading = orthonormal_directions(np.vstack([slope, np.eye(candidates)[:given]]), given)
    rest = np.linalg.svd(leading)[2][given:]
    return np.vstack([leading, rest])


def standard_errors(shares: np.ndarray) -> np.ndarray:
    """Of how much more each score is than the least: sums over groups, of which those of two candidates go together.

    shares : (n, groups) of each score, NaN where there is none

    Returns errors : (n,), 0 for the least and NaN where there is none.
    """
    more = shares - shares[np.nanargmin(shares.sum(axis=1))]
    return np.sqrt(shares.shape[1] * np.var(more, axis=1, ddof=1))


def _enough(rows: int, count: int, degree: int) -> bool:
    """Whether so many samples determine the terms of so many variables well."""
    return LEAST_SAMPLES * math.comb(count + degree, degree) <= rows


def _least(
    samples: Samples, given: int, counts: Sequence[int], degree: int, targets: Sequence[PressureTarget]
) -> Chosen:
    """The least number of variables that cannot be told from the best.

    counts : to choose from
    """
    leading = np.eye(samples.variables.shape[2])
    among = [c for c in counts if c <= given]
    if not among:
        raise IllPosedError(
            f"{samples.pressure.size} samples are too few to choose a number of variables by, {LEAST_SAMPLES} for each "
            "term: take more samples or a lower degree"
        )
    most = among[-1]
    whole, kinds = fit_best(turned(samples, leading[:most]), degree, targets)
    (target,) = (one for one in targets if one.kind == whole.target.kind)
    offered, number = leading[:0], 0
    if most == given:  # all given variables are in it, so what it leaves unexplained is of others
        offered, number = _offered(samples, given, whole, slice(None))
    tried = [c for c in counts if c <= most + number]
    known, shares = {most: whole}, np.full((len(tried), GROUPS), np.nan)
    for row, count in enumerate(tried):
        try:
            if count > given:
                shares[row] = _scores_beyond(samples, given, count, degree, target, whole)
                continue
            if count < most:
                known[count] = fit_local(turned(samples, leading[:count]), degree, target)
            shares[row] = known[count].scores
        except (IllPosedError, ConvergenceError):
            continue
    scores, errors = shares.sum(axis=1), standard_errors(shares)
    count = tried[int(np.flatnonzero(scores - np.nanmin(scores) <= errors)[0])]
    rotation = np.vstack([leading[: min(count, given)], offered[: max(count - given, 0)]])
    last = turned(samples, rotation)
    expansion = known[count] if count in known else fit_local(last, degree, target)
    return Chosen(expansion, last, rotation, kinds, tuple(tried), scores, errors)


def _offered(
    samples: Samples, given: int, whole: LocalExpansion, surfaces: slice | np.ndarray
) -> tuple[np.ndarray, int]:
    """Directions : (m, candidates) beyond the given variables, from some surfaces; how many stand out of noise."""
    variables, frame = np.split(samples.variables[surfaces], [given], axis=2)
    found, number = residual_directions(whole.residual[surfaces], variables, frame, np.random.default_rng(SIGNS))
    return np.hstack([np.zeros((len(found), given)), found]), number


def _scores_beyond(
    samples: Samples, given: int, count: int, degree: int, target: PressureTarget, whole: LocalExpansion
) -> np.ndarray:
    """Scores : (GROUPS,) of each group of surfaces in the directions that the other half of the groups shows.

    Whether these stand out of the noise of that half does not matter: scores are honest. Raises as `fit_local` does.
    """
    half = samples.group % 2  # copies of a surface are in one
    found = np.empty(GROUPS)
    for part in range(2):
        directions, _ = _offered(samples, given, whole, np.flatnonzero(half != part))
        rotation = np.vstack([np.eye(samples.variables.shape[2])[:given], directions[: count - given]])
        found[part::2] = fit_local(turned(samples, rotation), degree, target).scores[part::2]
    return found
