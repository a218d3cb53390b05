"""How long a state lasts in the mean, of durations with two ages that the ends of runs cut off.

Slip that has just missed the belt vibrates, and often sticks again at once. Settled it may last ten thousand times
longer, and ends at one rate. With S(t) the part of durations longer than t, and a the age of settling, in the long run

    mean = int_0^a S dt + S(a) (time past a) / (ends past a),
    rate of births = (int_0^a S dH + S(a) (births past a) / (ends past a)) / mean.

Births are the ends in stick-slip, H their cumulative rate. S follows from spells whose beginning was seen, by factors
1 - 1 / Y of their ends, Y being the number that lasts as long (E. L. Kaplan & P. Meier, J. Am. Stat. Assoc. 53 (1958)
457). Spells that runs begin with count past an age of their own, as they may vibrate at first.

Intervals: an end multiplies S by a Beta(Y, 1) number, exp(-E / Y) with an exponential E, and n ends past a in the time
T have the rate Gamma(n) / T. Draws of these bound the mean from above; from below one more end is supposed at
each place. So one rate has the limits of D. R. Cox (Biometrika 40 (1953) 354), a part those of C. J. Clopper & E. S.
Pearson (Biometrika 26 (1934) 404). For S see M. P. Fay, E. H. Brittain & M. A. Proschan, Biostatistics 14 (2013) 723.

Limits: without ends past a the mean has a lower bound alone. Ends that scatter more than at one rate count as fewer.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import gammaincinv

REPLICATES = 399  # of which the 10th from either end is at 2.5 %
LEAST = 1e-200  # of a mean, and of what divides a time: draws of one short spell come to 0

Ages = tuple[float, float]  # of spells whose beginning was seen, and of those that a run begins with
Draws = tuple[float, np.ndarray, np.ndarray]  # value, (REPLICATES,) draws for its lower and its upper limit
UNKNOWN: Draws = math.nan, np.full(REPLICATES, math.nan), np.full(REPLICATES, math.nan)


def mean_of_ages(spells: np.ndarray, settled: Ages, generator: np.random.Generator) -> tuple[Draws, Draws]:
    """The mean duration and the rate of births, UNKNOWN without time.

    spells : (spells, 4) beginning, 0 for one that the run begins with; duration; whether it ended, and by a birth
    settled : ages from which the rate of ends is constant
    """
    begin, duration, ended, _ = spells.T
    young = (begin > 0.0) & (duration > 0.0)
    last = min(settled[0], float(duration.max())) if np.any(young) else 0.0
    past = duration - np.where(young, last, settled[1])
    if not np.any(young | (past > 0.0)):
        return UNKNOWN, UNKNOWN
    past, (ends, births) = np.maximum(past, 0.0), spells[past > 0.0, 2:].sum(axis=0)
    time, ends, births = np.array([past.sum(), ends, births]) / _spread(past, ended * (past > 0.0))
    order = np.flatnonzero(young)[np.lexsort((1.0 - ended[young], duration[young]))]
    early = (ended[order] > 0.0) & (duration[order] <= last)
    survival, shorter, longer, lengths = survivals(duration[order], early, last, generator)
    of_births, of_others, one = (generator.standard_gamma(shape, REPLICATES) for shape in (births, ends - births, 1.0))
    places = (generator.permutation(REPLICATES) + 1.0) / (REPLICATES + 1)
    forever = 0.0 if time == 0.0 and ended[np.argmax(duration)] else math.inf  # or what no spell outlives
    value = survival @ lengths + (survival[-1] and survival[-1] * (time / ends if ends else math.inf))
    low = np.maximum(shorter @ lengths + shorter[:, -1] * time / gammaincinv(ends + 1.0, places), LEAST)
    high = longer @ lengths + longer[:, -1] * (time / np.maximum(gammaincinv(ends, places), LEAST) if ends else forever)

    def chance(survival: np.ndarray, share: np.ndarray | float) -> np.ndarray:
        return np.asarray(-np.diff(survival) @ spells[order, 3][early] + survival[..., -1] * share)

    rate = float(chance(survival, births / ends if ends else 0.0) / value)
    least = chance(longer, of_births / (of_births + of_others) if ends else 0.0) / high
    return (value, low, high), (rate, least, chance(longer, 1.0 - of_others / (of_births + of_others + one)) / low)


def survivals(
    duration: np.ndarray, early: np.ndarray, settled: float, generator: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(1 + ends,) S between early ends of ordered durations, draws from below and above, and the lengths between."""
    lengths = np.diff(duration[early], prepend=0.0, append=settled)
    at_risk = duration.size - np.flatnonzero(early)
    time = float(np.sum(np.clip(duration - (settled - lengths[-1]), 0.0, lengths[-1])))
    next_one = lengths[-1] / time if time > 0.0 else math.inf if lengths[-1] > 0.0 else 0.0
    exponentials = generator.standard_exponential((REPLICATES, lengths.size))
    shorter = np.exp(-np.cumsum(exponentials * np.append(1.0 / at_risk, next_one), axis=1))
    longer = np.concatenate([np.ones((REPLICATES, 1)), shorter[:, :-1]], axis=1)
    return np.cumprod(np.append(1.0, 1.0 - 1.0 / at_risk)), shorter, longer, lengths


def _spread(past: np.ndarray, ended: np.ndarray) -> float:
    """Variance of the ends in so much time, over that of ends at one rate; at least 1."""
    ends = ended.sum()
    return max(1.0, float(np.sum((past * ends / past.sum() - ended) ** 2) / ends)) if ends else 1.0
