"""Statistics of an ensemble of stick-slip motions: cycle counts, and the point where the mass sticks again.

The cycles of one run may depend on each other, and a test of normality that takes dependent events for independent
ones rejects too often. The null hypothesis here is a Gaussian sequence with the autocorrelation rho_k of the runs at a
lag of k cycles. The average of the Hermite polynomial He_m of n such values has the variance m! S_m / n, where S_m is
the sum of rho^m over all pairs of a run, divided by n. Independent values have S_m = 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtr

from roughslip.errors import IllPosedError, ParameterError
from roughslip.probability import Estimate
from roughslip.probability.estimate import SCALE_FREEDOM, interval_margin, student_95
from roughslip.results import described, result
from roughslip.validation import finite, gate

REPLICATES = 1000
FEWEST_REALISATIONS = 8
NO_SCATTER = 1e-12  # of the mean, or of the scatter of all runs: what rounding leaves where there is none
NULLS = 399
FEWEST_EVENTS = 100
MORE_CYCLES = (
    "run longer, more realisations or a lower damping; scene keys: ensemble.duration_periods, ensemble.realisations, "
    "oscillator.damping_ratio"
)
_ONE_POINT = "every run sticks again at the same point, X = {:.6g} m: the friction has no scatter to judge"


@result
class CycleCounts:
    """Difference M_d - E[M_S] of cycle counts over the damping ratios."""

    mean: np.ndarray = described("mean count of a stochastic run")
    standard_error: np.ndarray = described("standard error of that mean")
    difference: np.ndarray = described("M_d - mean")
    low: np.ndarray = described("lower end of its 95 % interval")
    high: np.ndarray = described("upper end of its 95 % interval")


@gate
def count_difference(deterministic: np.ndarray, stochastic: np.ndarray) -> CycleCounts:
    """Compare the counts of independent stochastic runs with the deterministic count.

    deterministic : (dampings,) M_d
    stochastic : (realisations, dampings) M_S; the same realisations of the friction serve every damping ratio, so
        that neighbouring points of the curve err together

    Returns the difference with Student's interval of a mean; where all runs count alike it has no width. Raises
    ParameterError for input that is not finite or does not match, IllPosedError for fewer than FEWEST_REALISATIONS.
    """
    if stochastic.ndim != 2 or deterministic.shape != stochastic.shape[1:]:
        raise ParameterError(f"counts {deterministic.shape} and {stochastic.shape} are not of the same damping ratios")
    finite("deterministic", deterministic)
    finite("stochastic", stochastic)
    realisations = len(stochastic)
    if realisations < FEWEST_REALISATIONS:
        raise IllPosedError(
            f"{realisations} realisations give no interval: run at least {FEWEST_REALISATIONS}; scene key: "
            "ensemble.realisations"
        )
    mean = stochastic.mean(axis=0)
    error = stochastic.std(axis=0, ddof=1) / np.sqrt(realisations)
    difference = deterministic - mean
    half = student_95(realisations) * error
    return CycleCounts(mean, error, difference, difference - half, difference + half)


@result
class Reattachment:
    """Moments of the reattachment point, each with the ends of its 95 % interval: (value, low, high)."""

    mean: np.ndarray = described("mean of the reattachment point", "m", "ends")
    std: np.ndarray = described(
        "its standard deviation over the events, without a correction for their number", "m", "ends"
    )
    skewness: np.ndarray = described("skewness", "1", "ends")
    kurtosis: np.ndarray = described("excess kurtosis over a normal distribution", "1", "ends")
    distance_to_normal: np.ndarray = described(
        "Kolmogorov distance to the normal distribution of the same mean and standard deviation", "1", "ends"
    )
    events: int = described("number of events")
    realisations: int = described("number of runs")


@gate
def reattachment_statistics(
    position: np.ndarray, realisation: np.ndarray, generator: np.random.Generator
) -> Reattachment:
    """Moments of the reattachment point, and its distance from normality.

    position : (events,) [m] X at the start of stick
    realisation : (events,) number of the run of each event
    generator : draws the bootstrap replicates

    Returns the statistics. Cycles of one run depend on each other, so whole runs are resampled (Efron and Tibshirani,
    An Introduction to the Bootstrap, 1993, ch. 8). Intervals of moments are those of
    friction over strips: percentiles widened to Student's, and reflected for the scatter. Raises
    ParameterError for input that is not finite or does not match; IllPosedError where fewer than FEWEST_REALISATIONS
    runs stick again, or where the points of a resampled ensemble do not scatter.
    """
    position = finite("position", position, 1)
    finite("position", position, 1)
    if position.shape != realisation.shape:
        raise ParameterError(f"{position.size} reattachment points need as many realisations, not {realisation.shape}")
    owners, owner = np.unique(realisation, return_inverse=True)
    runs = len(owners)
    if runs < FEWEST_REALISATIONS:
        raise IllPosedError(f"only {runs} runs stick again, of at least {FEWEST_REALISATIONS}: {MORE_CYCLES}")
    centre, scale = position.mean(), position.std()
    if scale <= NO_SCATTER * np.abs(centre):
        raise IllPosedError(_ONE_POINT.format(centre))
    ascending = np.argsort(position, kind="stable")
    values, owner = (position[ascending] - centre) / scale, owner[ascending]
    drawn = generator.multinomial(runs, np.full(runs, 1 / runs), size=REPLICATES)
    counts = np.concatenate([np.ones((1, runs), dtype=np.int64), drawn])  # row 0 is the ensemble itself
    moments = _moments(values, owner, counts)
    distance = _distance_to_normal(values, owner, counts, moments[:, 0], moments[:, 1])
    moments[:, 0] = centre + scale * moments[:, 0]
    moments[:, 1] *= scale
    of_mean, of_scale = float(interval_margin(runs)), float(interval_margin(runs, SCALE_FREEDOM))
    estimates = (
        Estimate.from_rows(moments[:, 0], of_mean),
        Estimate.of_scale(moments[:, 1], of_scale),
        *(Estimate.from_rows(rows, of_scale) for rows in moments[:, 2:].T),
    )
    mean, std, skewness, kurtosis = (np.array([estimate.value, estimate.low, estimate.high]) for estimate in estimates)
    return Reattachment(mean, std, skewness, kurtosis, distance, len(position), runs)


def _moments(values: np.ndarray, owner: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(1 + R, 4) mean, standard deviation, skewness and excess kurtosis of standardised values : (events,), each
    counted as often as counts : (1 + R, runs) says of its owner."""
    powers = values ** np.arange(5)[:, None]
    sums = np.stack([np.bincount(owner, weights=power, minlength=counts.shape[1]) for power in powers])
    n, *totals = np.einsum("ks,rs->kr", sums, counts.astype(np.float64))
    m1, m2, m3, m4 = totals / n
    variance = m2 - m1**2
    if np.any(variance <= NO_SCATTER):
        raise IllPosedError(
            "almost every run sticks again at the same point: run more realisations; scene key: ensemble.realisations"
        )
    third = m3 - 3 * m1 * m2 + 2 * m1**3
    fourth = m4 - 4 * m1 * m3 + 6 * m1**2 * m2 - 3 * m1**4
    return np.stack([m1, np.sqrt(variance), third / variance**1.5, fourth / variance**2 - 3], axis=1)


def _distance_to_normal(
    values: np.ndarray, owner: np.ndarray, counts: np.ndarray, mean: np.ndarray, std: np.ndarray
) -> np.ndarray:
    """(value, low, high) of sup |F - Phi((. - mean) / std)| for ascending values : (events,).

    Noise can only raise a distance, so that percentiles of its replicates lie too high. By the triangle inequality the
    truth is within the distance that F - Phi has moved, of which the replicates give the 95 % quantile (Bickel and
    Krieger, J. Am. Stat. Assoc. 84 (1989) 95), cut at 0. Conservative for a distance above 0; on normal places of 8 to
    40 runs it held 0 in 92 to 95 % of the trials.
    """

    def departure(row: int) -> np.ndarray:
        """(2, events) F - Phi before and after the step at each value."""
        reached = np.cumsum(counts[row][owner])
        steps = np.stack([np.concatenate([[0], reached[:-1]]), reached]) / reached[-1]
        return steps - ndtr((values - mean[row]) / std[row])

    ensemble = departure(0)
    moved = [np.max(np.abs(departure(row) - ensemble)) for row in range(1, len(counts))]
    value, radius = np.max(np.abs(ensemble)), np.quantile(moved, 0.95)
    return np.array([value, max(value - radius, 0.0), value + radius])


@dataclass(frozen=True)
class Normality:
    """Tests of normality of dependent events.

    autocorrelation : (lags,) [-] rho_k of successive events of a run, from k = 0 on
    effective_skewness : equivalent number of independent events for the skewness, n / S_3
    effective_kurtosis : the same for the kurtosis, n / S_4
    jarque_bera : statistic with these numbers in place of n
    jarque_bera_p : its p-value
    anderson_darling : statistic
    anderson_darling_p : share of Gaussian ensembles that reach it
    """

    autocorrelation: np.ndarray
    effective_skewness: float
    effective_kurtosis: float
    jarque_bera: float
    jarque_bera_p: float
    anderson_darling: float
    anderson_darling_p: float


def normality(position: np.ndarray, realisation: np.ndarray, generator: np.random.Generator) -> Normality:
    """Test the hypothesis that the events are a Gaussian sequence of their own mean, variance and autocorrelation.

    position : (events,) [m] in their order in time within each run
    realisation : (events,) number of the run of each event
    generator : draws the ensembles of the Anderson-Darling test

    Raises ParameterError for input that is not finite or does not match, IllPosedError for fewer than FEWEST_EVENTS
    events or for events at one point.

    Method: I. N. Lobato & C. Velasco (Econometric Theory 20 (2004) 671) for skewness and kurtosis of one sequence, here
    of many, which is the test of C. M. Jarque & A. K. Bera for independent events; the statistic of T. W. Anderson & D.
    A. Darling (J. Am. Stat. Assoc. 49 (1954) 765) of the standardised events, which has no tables for dependent ones,
    against NULLS ensembles of the same numbers of events a run.
    """
    finite("position", position, 1)
    if position.shape != realisation.shape:
        raise ParameterError(f"{position.size} reattachment points need as many realisations, not {realisation.shape}")
    n = position.size
    if n < FEWEST_EVENTS:
        raise IllPosedError(
            f"{n} reattachments are too few for a test of normality, of at least {FEWEST_EVENTS}: {MORE_CYCLES}"
        )
    centred = position - position.mean()
    deviation = math.sqrt(float(np.mean(centred**2)))
    if not deviation > 1e-12 * abs(float(position.mean())):
        raise IllPosedError(_ONE_POINT.format(float(position.mean())))
    values = centred / deviation
    _, owner, lengths = np.unique(realisation, return_inverse=True, return_counts=True)
    by_run = np.argsort(owner, kind="stable")
    inside = np.arange(lengths.max()) < lengths[:, None]
    rows = np.zeros(inside.shape)
    rows[inside] = values[by_run]
    correlation = _autocorrelation(rows)
    pairs = np.array([np.sum(np.maximum(lengths - k, 0)) for k in range(correlation.size)], dtype=np.float64)
    pairs[1:] *= 2.0
    third, fourth = (n**2 / float(pairs @ correlation**power) for power in (3, 4))
    skewness, excess = float(np.mean(values**3)), float(np.mean(values**4)) - 3.0
    statistic = third * skewness**2 / 6.0 + fourth * excess**2 / 24.0
    distance = anderson_darling(values)
    drawn = [anderson_darling(sequence[inside]) for sequence in _gaussian(correlation, len(lengths), generator)]
    return Normality(
        autocorrelation=correlation,
        effective_skewness=third,
        effective_kurtosis=fourth,
        jarque_bera=statistic,
        jarque_bera_p=math.exp(-0.5 * statistic),
        anderson_darling=distance,
        anderson_darling_p=(1 + int(np.count_nonzero(np.array(drawn) >= distance))) / (NULLS + 1),
    )


def _autocorrelation(rows: np.ndarray) -> np.ndarray:
    """(lags,) of sequences in rows : (runs, longest), zero where one has ended; positive semidefinite by its form."""
    spectrum = np.abs(np.fft.rfft(rows, 2 * rows.shape[1], axis=1)) ** 2
    covariance = np.fft.irfft(spectrum.sum(axis=0))[: rows.shape[1]]
    return covariance / covariance[0]


def _gaussian(correlation: np.ndarray, runs: int, generator: np.random.Generator) -> Iterator[np.ndarray]:
    """Yields (runs, lags) Gaussian sequences of an autocorrelation, NULLS times."""
    lag = np.abs(np.subtract.outer(np.arange(correlation.size), np.arange(correlation.size)))
    eigenvalue, vector = np.linalg.eigh(correlation[lag])
    factor = vector * np.sqrt(np.maximum(eigenvalue, 0.0))
    for _ in range(NULLS):
        yield np.einsum("rj,ij->ri", generator.standard_normal((runs, correlation.size)), factor, optimize=True)


def anderson_darling(values: np.ndarray) -> float:
    """A^2 of values against the normal distribution of their own mean and standard deviation."""
    n = values.size
    z = np.sort((values - values.mean()) / values.std())
    odd = 2.0 * np.arange(1, n + 1) - 1.0
    return float(-n - np.sum(odd * (log_ndtr(z) + log_ndtr(-z[::-1]))) / n)
