"""How long stick-slip and steady sliding last, how often each ends, and the share of time in stick-slip, by long runs.

A spell of stick-slip ends in steady sliding, at the rate `death`. A spell of sliding ends in stick, and stick-slip
begins there or the mass slides again; stick-slip is born at the rate `birth` in the time of sliding. So in the long run

    share of stick-slip = birth / (birth + death)

of the time in either state, whichever state the runs begin in. `trough_chain` has the theory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from roughslip.oscillator.states import States
from roughslip.oscillator.survival import Spells, mean_lifetime, spells
from roughslip.probability.estimate import TAILS, interval_margin
from roughslip.validation import gate

REPLICATES, FEWEST_SPELLS = 400, 8


@dataclass(frozen=True)
class Residence:
    """How long the states last and how often they end, each (value, low, high); by theory without interval.

    stick_slip, sliding : (3,) [natural periods] mean duration of a spell; infinite where none ends
    birth : (3,) [1 / natural period] rate at which stick-slip begins in the time of sliding
    share : (3,) [-] of the time in either state that is stick-slip, in the long run
    """

    stick_slip: np.ndarray
    sliding: np.ndarray
    birth: np.ndarray
    share: np.ndarray

    @property
    def death(self) -> np.ndarray:
        """Rate (value, low, high) [1 / natural period] at which stick-slip ends."""
        return 1.0 / self.stick_slip[[0, 2, 1]]


@gate
def residence(runs: Sequence[States], generator: np.random.Generator) -> Residence:
    """Durations and rates of the states in long runs, with 95 % intervals.

    A mean is the time of all spells over the number that ended, or in which stick-slip was born. Whole spells are
    resampled; with fewer than FEWEST_SPELLS ends the interval is that of exponential lifetimes (`mean_lifetime`).
    Without a spell of a state its mean is NaN.
    """
    stuck, slid = (
        Spells(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("duration", "ended")))
        for parts in zip(*map(spells, runs), strict=True)
    )
    births = np.concatenate([_births(run) for run in runs])
    stick_slip, sliding, until_birth = (_mean(kind, generator) for kind in (stuck, slid, Spells(slid.duration, births)))
    birth = 1.0 / until_birth[[0, 2, 1]]
    return Residence(stick_slip, sliding, birth, stationary_share(1.0 / stick_slip[[0, 2, 1]], birth))


def _births(run: States) -> np.ndarray:
    """(spells,) whether the next spell after each one of sliding is stick-slip."""
    following = np.append(run.sliding[1:, 0], math.inf)
    begun = run.stick_slip[:, 0]
    return np.searchsorted(begun, run.sliding[:, 1]) < np.searchsorted(begun, following)


def _mean(kind: Spells, generator: np.random.Generator) -> np.ndarray:
    """(value, low, high) of the time of spells over their ends."""
    count = kind.duration.size
    if not kind.duration.sum() > 0.0:
        return np.full(3, math.nan)
    if np.count_nonzero(kind.ended) < FEWEST_SPELLS:
        return mean_lifetime(kind)
    counts = np.vstack([np.ones(count), generator.multinomial(count, np.full(count, 1.0 / count), REPLICATES)])
    time, ends = counts @ kind.duration, counts @ kind.ended
    low, high = np.quantile(time[1:] / np.maximum(ends[1:], 1), TAILS)
    middle, margin = time[0] / ends[0], float(interval_margin(count))
    return np.array([middle, middle * (low / middle) ** margin, middle * (high / middle) ** margin])


def stationary_share(death: np.ndarray, birth: np.ndarray) -> np.ndarray:
    """(value, low, high) [-] of birth / (birth + death), NaN where both are 0 or one that counts is unknown.

    death, birth : (3,) [-] value, low and high of independent rates

    On the scale of log(birth / death) the half-widths of both intervals add as squares (G. Y. Zou & A. Donner, Stat.
    Med. 27 (2008) 1693). Without a death or without a birth the ends are those of the worst rates.
    """
    if birth[0] > 0.0 and death[0] > 0.0:
        odds = math.log(birth[0] / death[0])
        low, high = (
            math.hypot(math.log(birth[i] / birth[0]), math.log(death[j] / death[0])) for i, j in ((1, 2), (2, 1))
        )
        return 1.0 / (1.0 + np.exp(-np.array([odds, odds - low, odds + high])))
    pairs = zip(birth, death[[0, 2, 1]], strict=True)
    return np.array([_part(births, deaths) for births, deaths in pairs])


def _part(birth: float, death: float) -> float:
    """birth / (birth + death); NaN where both are 0."""
    if (birth == 0.0) != (death == 0.0):
        return float(death == 0.0)
    return birth / (birth + death) if birth + death > 0.0 else math.nan


def states_of_answer(measured: Residence, theory: Residence | None, omega: float) -> dict[str, Any]:
    """Time in each state and rates, for answer.json: [value, low, high], null where unknown, by runs and by theory.

    omega : [rad/s] natural frequency, which makes seconds of natural periods
    """
    period = 2.0 * math.pi / omega

    def rows(durations: Residence) -> dict[str, list[float | None]]:
        parts = {
            "share_of_time": durations.share,
            "mean_stick_slip_s": period * durations.stick_slip,
            "mean_sliding_s": period * durations.sliding,
            "death_per_s": durations.death / period,
            "birth_per_s": durations.birth / period,
        }
        return {name: [float(x) if math.isfinite(x) else None for x in values] for name, values in parts.items()}

    by_theory = None if theory is None else {name: value for name, (value, _, _) in rows(theory).items()}
    return rows(measured) | {"by_theory": by_theory}
