"""Whether the reattachment point is normal, when the cycles of a run may hang together.

A test that takes dependent events for independent ones rejects too often. Here the null hypothesis is a Gaussian
sequence with the autocorrelation rho_k that the runs show, k cycles apart: the average of the Hermite polynomial He_m
of n such values has the variance m! S_m / n with S_m = sum of rho^m over all pairs of a run, over n, where independent
values have S_m = 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from roughslip.errors import IllPosedError, ParameterError

NULLS = 399
FEWEST_EVENTS = 100


@dataclass(frozen=True)
class Normality:
    """Tests of normality of dependent events.

    autocorrelation : (lags,) [-] rho_k of successive events of a run, k = 0, 1, ...
    effective_skewness, effective_kurtosis : independent events that would tell these as well, n / S_3 and n / S_4
    jarque_bera, jarque_bera_p : [-] statistic with these numbers in place of n, and its p-value
    anderson_darling, anderson_darling_p : [-] statistic, and the share of drawn Gaussian ensembles that reach it
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
    realisation : (events,) whose event it is
    generator : draws the ensembles of the Anderson-Darling test

    Raises ParameterError for input that is not finite or does not match, IllPosedError for fewer than FEWEST_EVENTS
    events or for events at one place.

    Method: I. N. Lobato & C. Velasco (Econometric Theory 20 (2004) 671) for skewness and kurtosis of one sequence, here
    of many, which is the test of C. M. Jarque & A. K. Bera for independent events; the statistic of T. W. Anderson & D.
    A. Darling (J. Am. Stat. Assoc. 49 (1954) 765) of the standardised events, which has no tables for dependent ones,
    against NULLS ensembles of the same numbers of events a run.
    """
    if position.ndim != 1 or position.shape != realisation.shape or not np.isfinite(position).all():
        raise ParameterError("reattachment points must be finite, each with its realisation")
    n = position.size
    if n < FEWEST_EVENTS:
        raise IllPosedError(f"{n} events are too few for a test of normality: run at least {FEWEST_EVENTS} cycles")
    centred = position - position.mean()
    deviation = math.sqrt(float(np.mean(centred**2)))
    if not deviation > 1e-12 * abs(float(position.mean())):
        raise IllPosedError("every run sticks again at the same place: the friction has no scatter")
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
    """A^2 of values against the normal law of their own mean and standard deviation."""
    n = values.size
    z = np.sort((values - values.mean()) / values.std())
    odd = 2.0 * np.arange(1, n + 1) - 1.0
    return float(-n - np.sum(odd * (log_ndtr(z) + log_ndtr(-z[::-1]))) / n)
