"""How many variables an expansion takes, and which.

The candidates are nested. First come the given variables u in their order: leading modes, or local functionals. Then
come directions q in which the residual r of the expansion in all given variables still varies. By Stein's identity the
terms of r that contain q, to second degree in it, are

    r ~ sum_a psi_a(u) g_a'q + q'Hq / 2,    g_a = E[r psi_a(u) q],    H = E[r (q q' - I)].

The leading eigenvectors of the mean outer product of their gradient, sum_a g_a g_a' + H^2, are the directions along
which r varies most (Li and Duan, Ann. Stat. 17 (1989) 1009; Li, J. Am. Stat. Assoc. 87 (1992) 1025; Constantine, Dow
and Wang, SIAM J. Sci. Comput. 36 (2014) A1500). Only those beyond what random signs of the surfaces give are used.

Directions overfit the surfaces at which they were found, four of them by 7 % of the score. So each half of the
surfaces is scored in directions from the other half. The smallest number of variables within one standard error of the
best is taken (Breiman, Friedman, Olshen and Stone, Classification and Regression Trees, 1984). The jackknife of the
chosen expansion does not include the scatter of its directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from roughslip.chaos.functionals import orthonormal_directions
from roughslip.chaos.local import GROUPS, LocalExpansion, Samples, fit_best, fit_local
from roughslip.chaos.pressure import Kind, PressureTarget
from roughslip.chaos.regression import least_squares
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.limits import VARIABLE_COUNTS as COUNTS

LEAST_SAMPLES = 5  # surfaces times nodes per term, for a number of variables to be tried
SIGNS = 1  # seed of the random signs of directions

BLOCKS = 256  # of surfaces, each with one sign
LEAST_SURFACES = 40  # for the quantile of random signs
REPLICATES = 400  # of the signs: the estimated quantile lies between the 93 and 97 % ones
QUANTILE = 0.95


@dataclass(frozen=True)
class Chosen:
    """An expansion in the chosen variables.

    expansion, samples : the fit, and its samples in the chosen variables
    rotation : (v, candidates) orthonormal rows, from the candidates to the variables
    targets : score of every kind of target, NaN where its fit is refused
    counts : numbers of variables that were tried, ascending
    scores : (counts,) [-] at left-out surfaces, NaN where the fit is refused
    errors : (counts,) [-] standard error of the difference of each score from the least
    """

    expansion: LocalExpansion
    samples: Samples
    rotation: np.ndarray
    targets: dict[Kind, float]
    counts: tuple[int, ...]
    scores: np.ndarray
    errors: np.ndarray


def rotated(samples: Samples, rotation: np.ndarray) -> Samples:
    """The samples in the variables rotation @ u; their signs under symmetries are kept where rows select variables."""
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
    """The expansion in a given number of variables, or in the number of COUNTS that predicts left-out surfaces best.

    samples : in all candidates: the given variables, then a frame of others (see `moving_frame`)
    given : number of given variables, at least 1
    count : number of variables; None chooses it, with the target that is best in the given variables
    degree, targets : as in `fit_best`
    regression : whether the regression direction in all candidates comes first, see `regression_first`

    Raises ParameterError for numbers out of range, IllPosedError where fewer directions than requested exceed the
    noise, and otherwise as `fit_best`.
    """
    candidates, rows = samples.variables.shape[2], samples.pressure.size
    if not 1 <= given <= candidates or not (count is None or 1 <= count <= candidates):
        raise ParameterError(f"{count} variables, {given} of them given, cannot be had of {candidates} candidates")
    if regression:
        first = regression_first(samples, given, targets[0])
        chosen = fit_count(rotated(samples, first), given, count, degree, targets)
        return replace(chosen, rotation=chosen.rotation @ first)
    if count is None:
        return _least(
            samples,
            given,
            [c for c in COUNTS if LEAST_SAMPLES * math.comb(c + degree, degree) <= rows],
            degree,
            targets,
        )
    rotation = np.eye(candidates)[: min(count, given)]
    if count > given:
        whole, _ = fit_best(rotated(samples, rotation), degree, targets)
        offered, number = _offered(samples, given, whole, slice(None))
        if given + number < count:
            raise IllPosedError(
                f"{count} variables were asked for, but beyond the first {given} only {number} directions exceed "
                f"the noise of {len(samples.pressure)} surfaces: take more samples or fewer variables"
            )
        rotation = np.vstack([rotation, offered[: count - given]])
    last = rotated(samples, rotation)
    found, kinds = fit_best(last, degree, targets)
    return Chosen(found, last, rotation, kinds, (count,), np.array([found.score]), np.zeros(1))


def regression_first(samples: Samples, given: int, target: PressureTarget) -> np.ndarray:
    """Rotation : (candidates, candidates) that puts the direction of a linear regression first.

    samples, given : as in `fit_count`
    target : the regressed variable, with its weights

    The given variables follow, as far as they are independent of it, and then the others. The linear regression of any
    monotone function of one direction finds that direction (Brillinger, in A Festschrift for Erich L. Lehmann, 1982,
    97; Li and Duan, Ann. Stat. 17 (1989) 1009). As all surfaces are used, scores of left-out surfaces are up to 5 % too
    good on the paper's square. Raises IllPosedError as the regression does.
    """
    candidates = samples.variables.shape[2]
    values = target.values(samples.pressure, samples.gap).ravel()
    basis = np.column_stack([np.ones(len(values)), samples.variables.reshape(-1, candidates)])
    slope = least_squares(basis, values, target.weights(values)).coefficients[1:]
    leading = orthonormal_directions(np.vstack([slope, np.eye(candidates)[:given]]), given)
    rest = np.linalg.svd(leading)[2][given:]
    return np.vstack([leading, rest])


def _least(
    samples: Samples, given: int, counts: Sequence[int], degree: int, targets: Sequence[PressureTarget]
) -> Chosen:
    """The expansion in the smallest of the counts whose score is within one standard error of the best."""
    leading = np.eye(samples.variables.shape[2])
    among = [c for c in counts if c <= given]
    if not among:
        raise IllPosedError(
            f"{samples.pressure.size} samples are too few to choose a number of variables, which takes {LEAST_SAMPLES} "
            "per term: take more samples or a lower degree"
        )
    most = among[-1]
    whole, kinds = fit_best(rotated(samples, leading[:most]), degree, targets)
    (target,) = (one for one in targets if one.kind == whole.target.kind)
    offered, number = leading[:0], 0
    if most == given:  # all given variables are used, so the residual varies with others only
        offered, number = _offered(samples, given, whole, slice(None))
    tried = [c for c in counts if c <= most + number]
    known, shares = {most: whole}, np.full((len(tried), GROUPS), np.nan)
    for row, count in enumerate(tried):
        try:
            if count > given:
                shares[row] = _scores_beyond(samples, given, count, degree, target, whole)
                continue
            if count < most:
                known[count] = fit_local(rotated(samples, leading[:count]), degree, target)
            shares[row] = known[count].scores
        except (IllPosedError, ConvergenceError):
            continue
    scores = shares.sum(axis=1)
    more = shares - shares[np.nanargmin(scores)]  # paired by groups
    errors = np.sqrt(GROUPS * np.var(more, axis=1, ddof=1))
    count = tried[int(np.flatnonzero(scores - np.nanmin(scores) <= errors)[0])]
    rotation = np.vstack([leading[: min(count, given)], offered[: max(count - given, 0)]])
    last = rotated(samples, rotation)
    expansion = known[count] if count in known else fit_local(last, degree, target)
    return Chosen(expansion, last, rotation, kinds, tuple(tried), scores, errors)


def _offered(
    samples: Samples, given: int, whole: LocalExpansion, surfaces: slice | np.ndarray
) -> tuple[np.ndarray, int]:
    """Directions : (m, candidates) beyond the given variables, from some surfaces, and how many exceed the noise."""
    variables, frame = np.split(samples.variables[surfaces], [given], axis=2)
    found, number = residual_directions(whole.residual[surfaces], variables, frame, np.random.default_rng(SIGNS))
    return np.hstack([np.zeros((len(found), given)), found]), number


def _scores_beyond(
    samples: Samples, given: int, count: int, degree: int, target: PressureTarget, whole: LocalExpansion
) -> np.ndarray:
    """Scores : (GROUPS,) of each group of surfaces, in directions from the other half of the groups.

    The directions need not exceed the noise of that half, because scores are not biased. Raises as `fit_local`.
    """
    half = samples.group % 2  # copies of a surface are in one
    found = np.empty(GROUPS)
    for part in range(2):
        directions, _ = _offered(samples, given, whole, np.flatnonzero(half != part))
        rotation = np.vstack([np.eye(samples.variables.shape[2])[:given], directions[: count - given]])
        found[part::2] = fit_local(rotated(samples, rotation), degree, target).scores[part::2]
    return found


def residual_directions(
    residual: np.ndarray, variables: np.ndarray, frame: np.ndarray, generator: np.random.Generator
) -> tuple[np.ndarray, int]:
    """Directions along which a residual varies, the most important first, and how many of them exceed chance.

    residual : (K, nodes) of an expansion in the variables, at K independent surfaces
    variables : (K, nodes, v) [-] in use
    frame : (K, nodes, n) [-] standard normal variables independent of them
    generator : of the signs

    Returns directions : (n, n), orthonormal rows, and the number of significant ones. Along a significant direction the
    root mean square of the gradient is above the 95 % quantile of the largest one with random signs of the surfaces.
    Raises ParameterError for arrays that do not match or are not finite, IllPosedError for fewer than LEAST_SURFACES.

    Method: random signs as in the wild bootstrap (Mammen, Ann. Stat. 21 (1993) 255), less the mean.
    """
    if variables.shape[:2] != residual.shape or frame.shape[:2] != residual.shape or residual.ndim != 2:
        raise ParameterError(
            f"residuals {residual.shape}, variables {variables.shape} and a frame {frame.shape} do not match"
        )
    if not all(np.isfinite(part).all() for part in (residual, variables, frame)):
        raise ParameterError("residuals and variables must be finite")
    surfaces, nodes = residual.shape
    if surfaces < LEAST_SURFACES:
        raise IllPosedError(
            f"{surfaces} surfaces are too few to separate a direction from noise, which takes {LEAST_SURFACES}: "
            "take more samples, or no more variables than local functionals"
        )
    n = frame.shape[2]
    if n == 0:  # every variable is in use
        return np.empty((0, 0)), 0
    blocks = min(BLOCKS, surfaces)
    shares = np.stack(
        [_gradients(*(part[number::blocks] for part in (residual, variables, frame))) for number in range(blocks)]
    ) / (surfaces * nodes)
    _, strength, right = np.linalg.svd(shares.sum(axis=0), full_matrices=False)
    signs = generator.choice([-1.0, 1.0], (REPLICATES, blocks))
    chance = np.tensordot(signs, shares - shares.mean(axis=0), axes=1)
    largest = np.linalg.norm(chance, ord=2, axis=(1, 2))
    return right, int(np.sum(strength > np.quantile(largest, QUANTILE)))


def _gradients(residual: np.ndarray, variables: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Sums over the samples : (1 + v + n, n): rows g_a' for the constant and each variable, then H."""
    q = frame.reshape(-1, frame.shape[2])
    r = residual.reshape(-1, 1)
    terms = np.column_stack([np.ones(len(q)), variables.reshape(len(q), -1), q])
    found = (r * terms).T @ q
    found[-q.shape[1] :] -= np.sum(r) * np.eye(q.shape[1])
    return found
