"""Spells of stick-slip and of steady sliding: their mean lifetime, and the band of damping where both occur.

The states are those of `oscillator.states`. The friction path loses its correlation within a cycle, and all cycles
begin at the departure point. So lifetimes are close to exponential; the end of a run censors them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator.states import States
from roughslip.probability.estimate import TAILS
from roughslip.short_repr import short_repr
from roughslip.validation import gate

REPLICATES = 400


@short_repr
@dataclass(frozen=True)
class Spells:
    """Spells of one kind of motion.

    duration : (spells,) [-] natural periods
    ended : (spells,) false where the run was over before the spell
    """

    duration: np.ndarray
    ended: np.ndarray


@gate
def spells(states: States) -> tuple[Spells, Spells]:
    """Spells of stick-slip, and of steady sliding, in their order in time."""
    return (
        Spells(np.diff(states.stick_slip)[:, 0], states.stick_slip_ended),
        Spells(np.diff(states.sliding)[:, 0], states.sliding_ended),
    )


@gate
def mean_lifetime(spells: Spells) -> np.ndarray:
    """(value, low, high) [-] of the mean of exponential lifetimes, in natural periods, with its 95 % interval.

    The likelihood of censored lifetimes is largest at total time over spells that ended (B. Epstein & M. Sobel, J. Am.
    Stat. Assoc. 48 (1953) 486); twice the total time over the mean is chi-square with two degrees of freedom more
    than twice the ends below, as many above (D. R. Cox, Biometrika 40 (1953) 354). Without an end the mean has a lower
    bound alone, and value and upper end are infinite. Raises IllPosedError for no time at all.
    """
    total, ended = float(np.sum(spells.duration)), int(np.count_nonzero(spells.ended))
    if not total > 0.0:
        raise IllPosedError(
            f"no run showed this motion, in {spells.duration.size} spells: run longer or more realisations; scene "
            "keys: survival.duration_periods, survival.realisations"
        )
    low = 2.0 * total / float(chdtri(2 * ended + 2, TAILS[0]))
    if ended == 0:
        return np.array([math.inf, low, math.inf])
    return np.array([total / ended, low, 2.0 * total / float(chdtri(2 * ended, TAILS[1]))])


def falling_share(share: np.ndarray) -> np.ndarray:
    """The non-increasing sequence next to `share` : (..., dampings) in least squares, pooling neighbours that rise.

    Of equally many runs each, the maximum of their likelihood (M. Ayer, H. D. Brunk, G. M. Ewing, W. T. Reid & E.
    Silverman, Ann. Math. Stat. 26 (1955) 641), here by its min-max formula.
    """
    sums = np.concatenate([np.zeros((*share.shape[:-1], 1)), np.cumsum(share, axis=-1)], axis=-1)
    n = share.shape[-1]
    means = np.full((*share.shape[:-1], n, n), -math.inf)  # of the stretch from the first to the second index
    for first in range(n):
        lengths = np.arange(1, n - first + 1)
        means[..., first, first:] = (sums[..., first + 1 :] - sums[..., first : first + 1]) / lengths
    largest_to_come = np.maximum.accumulate(means[..., ::-1], axis=-1)[..., ::-1]
    fitted = np.empty_like(share, dtype=np.float64)
    for j in range(n):
        fitted[..., j] = np.min(largest_to_come[..., : j + 1, j], axis=-1)
    return fitted


def crossing(damping: np.ndarray, share: np.ndarray, level: float) -> np.ndarray:
    """Where each row of a falling `share` : (..., dampings) passes a level, by straight lines; NaN if it does not."""
    places = np.full(share.shape[:-1], np.nan)
    for index in np.ndindex(places.shape):
        row = share[index]
        below = int(np.argmax(row < level))
        if row[0] >= level > row[-1]:
            left, right = row[below - 1], row[below]
            places[index] = damping[below - 1] + (left - level) / (left - right) * (damping[below] - damping[below - 1])
    return places


@gate
def damping_band(
    damping: np.ndarray, shares: np.ndarray, levels: tuple[float, ...], generator: np.random.Generator
) -> np.ndarray:
    """(levels, 3) value, low, high [-]: the damping ratios at which the mean share falls to each level.

    damping : (dampings,) [-] ascending
    shares : (runs, dampings) of each run, 0 to 1; the same friction paths serve every damping ratio

    The mean is made to fall (`falling_share`); intervals are percentiles over resampled runs, whole rows of
    `shares`. Raises ParameterError for input that does not match, IllPosedError where a level lies outside the
    shares found, of the ensemble or of more than a twentieth of the replicates.
    """
    if shares.ndim != 2 or damping.shape != shares.shape[1:] or np.any(np.diff(damping) <= 0.0):
        raise ParameterError(
            f"shares {shares.shape} must be of runs by damping ratios {damping.shape}, and these must ascend"
        )
    runs = len(shares)
    weights = generator.multinomial(runs, np.full(runs, 1.0 / runs), size=REPLICATES)
    counts = np.concatenate([np.ones((1, runs), dtype=weights.dtype), weights])
    mean = falling_share(np.einsum("br,rd->bd", counts.astype(np.float64), shares.astype(np.float64)) / runs)
    band = np.empty((len(levels), 3))
    for row, level in enumerate(levels):
        at = crossing(damping, mean, level)
        if not np.isfinite(at[0]) or np.mean(np.isnan(at)) > 0.05:
            raise IllPosedError(
                f"the damping ratios from {damping[0]:.4g} to {damping[-1]:.4g} do not hold the one at which the mean "
                f"share is {level:g}: widen them or run more realisations; scene key: survival.realisations"
            )
        band[row] = at[0], *np.nanquantile(at[1:], TAILS)
    return band
