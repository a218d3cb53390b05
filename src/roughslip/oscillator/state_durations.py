"""How long stick-slip and steady sliding last, how often each ends, and the share of time in stick-slip, by long runs.

Stick-slip ends in steady sliding, at the rate `death`. Sliding ends in stick, and stick-slip begins there or the mass
slides again; stick-slip is born at the rate `birth` in the time of sliding. So in the long run

    share of stick-slip = birth / (birth + death)

of the time in either state, whichever state the runs begin in. The friction path loses its correlation within a cycle,
and all cycles begin at the departure point. So durations are close to exponential; the end of a run censors them.
`trough_chain` has the theory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtri

from roughslip.oscillator.states import States
from roughslip.probability.estimate import TAILS, interval_margin
from roughslip.validation import gate

STATES = ("stick_slip", "sliding")
REPLICATES, FEWEST_ENDS = 400, 8


@dataclass(frozen=True)
class Durations:
    """How long the states last and how often they end, each (value, low, high); by theory without interval.

    stick_slip, sliding : (3,) [natural periods] mean duration; infinite where none ends
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
def durations(runs: Sequence[States], generator: np.random.Generator) -> Durations:
    """Durations and rates of the states in long runs, with 95 % intervals.

    A mean is the whole time in a state over the number of times that it ended, or that stick-slip was born in it.
    Whole durations are resampled; with fewer than FEWEST_ENDS ends the interval is that of exponential ones
    (`exponential_mean`). The mean of a state that no run shows is NaN.
    """
    stuck, slid = (np.concatenate([np.diff(getattr(run, state))[:, 0] for run in runs]) for state in STATES)
    stuck_ended, slid_ended = (np.concatenate([getattr(run, f"{state}_ended") for run in runs]) for state in STATES)
    births = np.concatenate([_births(run) for run in runs])
    stick_slip, sliding, until_birth = (
        _mean(*one, generator) for one in ((stuck, stuck_ended), (slid, slid_ended), (slid, births))
    )
    birth = 1.0 / until_birth[[0, 2, 1]]
    return Durations(stick_slip, sliding, birth, stationary_share(1.0 / stick_slip[[0, 2, 1]], birth))


def _births(run: States) -> np.ndarray:
    """(times in sliding,) whether the next state after each one is stick-slip."""
    following = np.append(run.sliding[1:, 0], math.inf)
    begun = run.stick_slip[:, 0]
    return np.searchsorted(begun, run.sliding[:, 1]) < np.searchsorted(begun, following)


def _mean(duration: np.ndarray, ended: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """(value, low, high) of the time over its ends."""
    count = duration.size
    if not duration.sum() > 0.0:
        return np.full(3, math.nan)
    if np.count_nonzero(ended) < FEWEST_ENDS:
        return exponential_mean(float(duration.sum()), int(np.count_nonzero(ended)))
    counts = np.vstack([np.ones(count), generator.multinomial(count, np.full(count, 1.0 / count), REPLICATES)])
    time, ends = counts @ duration, counts @ ended
    low, high = np.quantile(time[1:] / np.maximum(ends[1:], 1), TAILS)
    middle, margin = time[0] / ends[0], float(interval_margin(count))
    return np.array([middle, middle * (low / middle) ** margin, middle * (high / middle) ** margin])


def exponential_mean(total: float, ended: int) -> np.ndarray:
    """(value, low, high) of the mean of exponential durations, with its 95 % interval.

    total, ended : their sum, and how many of them ended before the run was over

    The likelihood of censored durations is largest at total time over ends (B. Epstein & M. Sobel, J. Am. Stat. Assoc.
    48 (1953) 486); twice the total time over the mean is chi-square with two degrees of freedom more than twice the
    ends below, as many above (D. R. Cox, Biometrika 40 (1953) 354). Without an end the mean has a lower bound alone,
    and value and upper end are infinite.
    """
    low = 2.0 * total / float(chdtri(2 * ended + 2, TAILS[0]))
    if ended == 0:
        return np.array([math.inf, low, math.inf])
    return np.array([total / ended, low, 2.0 * total / float(chdtri(2 * ended, TAILS[1]))])


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


def states_of_answer(measured: Durations, theory: Durations | None, omega: float) -> dict[str, Any]:
    """Time in each state and rates, for answer.json: [value, low, high], null where unknown, by runs and by theory.

    omega : [rad/s] natural frequency, which makes seconds of natural periods
    """
    period = 2.0 * math.pi / omega

    def rows(found: Durations) -> dict[str, list[float | None]]:
        parts = {
            "share_of_time": found.share,
            "mean_stick_slip_s": period * found.stick_slip,
            "mean_sliding_s": period * found.sliding,
            "death_per_s": found.death / period,
            "birth_per_s": found.birth / period,
        }
        return {name: [float(x) if math.isfinite(x) else None for x in values] for name, values in parts.items()}

    by_theory = None if theory is None else {name: value for name, (value, _, _) in rows(theory).items()}
    return rows(measured) | {"by_theory": by_theory}
