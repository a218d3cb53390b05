"""Ensembles of stick-slip motions: cycle counts at any parameters, and the point where the mass sticks again."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from scipy.special import ndtr

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.machine import OF_OSCILLATOR, Machine
from roughslip.oscillator.motion import FrictionPath, Motion, simulate
from roughslip.oscillator.states import longest_slip, states_of
from roughslip.probability import Estimate
from roughslip.probability.estimate import SCALE_FREEDOM, interval_margin, student_95
from roughslip.results import described, result
from roughslip.validation import finite, gate

REPLICATES = 1000
FEWEST_REALISATIONS = 8
NO_SCATTER = 1e-12  # of the mean, or of the scatter of all runs: what rounding leaves where there is none
MORE_CYCLES = "run longer, more realisations or a lower damping"
CYCLES_KEYS = "ensemble.duration_periods, ensemble.realisations, oscillator.damping_ratio"


@result
class Counts:
    """Counts of motions, of each path at each value; with two parameters over (runs, values, values), and so on."""

    cycles: np.ndarray = described("number of cycles", "1", "runs over")
    micro_slips: np.ndarray = described("number of micro-slips", "1", "runs over")
    last_cycle: np.ndarray = described(
        "natural periods until the last cycle ends, 0 where there is none", "1", "runs over"
    )
    stick_slip: np.ndarray = described(
        "share of the time in either state that is stick-slip; NaN where the run reaches no state, and with excitation",
        "1",
        "runs over",
    )
    cuts: np.ndarray = described("cuts of negative friction, as in Motion", "1", "runs over")
    steps: int = described("steps in all, as in Motion")
    over: Mapping[str, np.ndarray] = described(
        "values of each parameter, by its name, which is a coordinate of the Dataset"
    )


@gate
def ensemble(
    machine: Machine,
    paths: Sequence[FrictionPath],
    spacing_m: float = math.nan,
    duration_periods: float = 100.0,
    *,
    over: Mapping[str, Sequence[float] | np.ndarray],
) -> Counts:
    """Counts of motions on each friction path while parameters of the machine take other values.

    paths : each as in `simulate`, None for the motion without scatter; an iterable must start again for each value
    over : values by parameter of the oscillator, as of `Machine.changed`: damping [-], belt_velocity [m/s], mass [kg],
        stiffness [N/m], load [N]; of several parameters, all combinations

    Other arguments and errors as in `simulate`, and ParameterError for another parameter.
    """
    unknown = ", ".join(sorted(over.keys() - {*OF_OSCILLATOR}))
    if not paths:
        raise ParameterError("paths must hold a path at least, or None for the motion without scatter")
    if unknown or not over:
        raise ParameterError(f"over must have values of {', '.join(OF_OSCILLATOR)}, not of {unknown or 'nothing'}")
    values = {name: np.atleast_1d(finite(name, value)) for name, value in over.items()}
    for name, row in values.items():
        if row.ndim != 1 or row.size == 0:
            raise ParameterError(f"over must have a row of values of {name}, not the shape {row.shape}")
    changes = [dict(zip(values, map(float, each), strict=True)) for each in itertools.product(*values.values())]
    machines = [machine.changed(change) for change in changes]
    rows = [
        row_of(one, simulate(one.oscillator, one.law, path, spacing_m, duration_periods, one.options))
        for path in paths
        for one in machines
    ]
    return counts_of(rows, (len(paths), *(value.size for value in values.values())), values)


Row = tuple[int, int, float, float, int, int]


def row_of(machine: Machine, motion: Motion) -> Row:
    """The fields of `Counts` of a motion; the share of stick-slip is NaN where the longest slip of a cycle is."""
    longest = _longest_slip(machine.oscillator, machine.law)
    share = math.nan if math.isnan(longest) else states_of(motion, longest).share()
    return motion.cycles, motion.micro_slips, motion.last_cycle, share, motion.cuts, motion.steps


@lru_cache(maxsize=4096)
def _longest_slip(oscillator: Oscillator, law: FrictionLaw) -> float:
    """`longest_slip`; NaN with excitation or a belt at rest, and where slip is too stiff to follow without scatter."""
    if oscillator.q != 0.0 or oscillator.V <= 0.0:
        return math.nan
    try:
        return longest_slip(oscillator, law)
    except ConvergenceError:
        return math.nan


def counts_of(rows: Sequence[Row], shape: tuple[int, ...], over: Mapping[str, np.ndarray]) -> Counts:
    """The counts of all motions, those of a path one after another. shape : (paths, values, ...)"""
    cycles, micro_slips, last, share, cuts, steps = (np.reshape(row, shape) for row in zip(*rows, strict=True))
    return Counts(cycles, micro_slips, last, share, cuts, int(steps.sum()), over)


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
        raise ParameterError(f"stochastic {stochastic.shape} does not match deterministic {deterministic.shape}")
    finite("deterministic", deterministic)
    finite("stochastic", stochastic)
    realisations = len(stochastic)
    if realisations < FEWEST_REALISATIONS:
        raise IllPosedError(
            f"stochastic has {realisations} realisations, which give no interval: run at least {FEWEST_REALISATIONS}",
            scene_keys="ensemble.realisations",
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
    if position.shape != realisation.shape:
        raise ParameterError(f"{position.size} reattachment points need as many realisations, not {realisation.shape}")
    owners, owner = np.unique(realisation, return_inverse=True)
    runs = len(owners)
    if runs < FEWEST_REALISATIONS:
        few = f"only {runs} runs stick again, of at least {FEWEST_REALISATIONS}"
        raise IllPosedError(f"{few}: {MORE_CYCLES}", CYCLES_KEYS)
    centre, scale = position.mean(), position.std()
    if scale <= NO_SCATTER * np.abs(centre):
        raise IllPosedError(f"every run sticks again at the same point, X = {centre:.6g} m: friction has no scatter")
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
            "almost every run sticks again at the same point: run more realisations", scene_keys="ensemble.realisations"
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
