"""What an ensemble of runs sums up to: counts against damping, time in stick-slip, the point of reattachment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.oscillator.cycles import count_difference, reattachment_statistics
from roughslip.probability.estimate import student_95, wilson_interval

STORED = (
    *("cycles", "micro_slips", "last_cycle", "stick_slip", "nominal_last_cycle"),
    *("reattachment", "reattachment_realisation"),
)
"""Names under which stage oscillator stores the fields of Runs."""


class Runs(NamedTuple):
    """Counts of the runs, and their points of reattachment.

    cycles, micro_slips, last_cycle, stick_slip : (runs, dampings) as in `oscillator.counts.Counts`
    nominal_last_cycle : (runs,) at the nominal damping
    place, owner : (events,) [m] point of reattachment there, and the run of each
    """

    cycles: np.ndarray
    micro_slips: np.ndarray
    last_cycle: np.ndarray
    stick_slip: np.ndarray
    nominal_last_cycle: np.ndarray
    place: np.ndarray
    owner: np.ndarray


CLOSING_PERIODS = 10.0
SHARE = "share of the time in stick-slip, of all that is stick-slip or sliding"


def closing_periods(period: float) -> float:
    """Natural periods at the end of a run in which one that cycles shows a cycle. period : in tau, NaN without one."""
    return float(np.nanmax([CLOSING_PERIODS, 2 * period / (2 * np.pi)]))


def cycling_share(last_cycle: np.ndarray, duration_periods: float, closing: float) -> tuple[float, float, float]:
    """Share of the runs with a cycle in the closing periods, with its 95 % interval.

    last_cycle : (runs,) natural periods until the last cycle, 0 for a run without one
    closing : [natural periods] CLOSING_PERIODS, or two cycles where these take longer
    """
    runs = len(last_cycle)
    cycling = int(np.count_nonzero(last_cycle > max(duration_periods - closing, 0.0)))
    low, high = wilson_interval(cycling, runs)
    return cycling / runs, float(low), float(high)


def share_of_time(stick_slip: np.ndarray) -> np.ndarray:
    """(3, dampings) mean share of the time in stick-slip with Student's 95 % interval, cut at 0 and 1.

    stick_slip : (runs, dampings) of each run, NaN where it reaches no state; all NaN where fewer than two runs do
    """
    known = np.count_nonzero(~np.isnan(stick_slip), axis=0)
    is_known = known > 1
    interval = np.full((3, stick_slip.shape[1]), np.nan)
    columns, runs = stick_slip[:, is_known], known[is_known]
    mean = np.nanmean(columns, axis=0)
    half = student_95(runs) * np.nanstd(columns, axis=0, ddof=1) / np.sqrt(runs)
    interval[:, is_known] = mean, np.maximum(mean - half, 0.0), np.minimum(mean + half, 1.0)
    return interval


def ensemble_variables(
    plain: Mapping[str, np.ndarray],
    runs: Runs,
    nominal: tuple[float, float],
    generator: np.random.Generator,
    warn: Callable[[str], None],
) -> dict[str, store.Variable]:
    """Everything that verdicts on the motion read, from the runs and from the motion without scatter.

    plain : damping_ratio and cycles (dampings,), period in tau, hopf_damping, existence_limit, without scatter
    nominal : duration of a run [natural periods], and the damping ratio of the reattachments
    generator : draws the bootstrap replicates; warn : is given what is stored as NaN
    """
    duration, damping = nominal
    counts = count_difference(plain["cycles"], runs.cycles)
    returns = count_difference(np.zeros(len(plain["cycles"])), -(runs.cycles + runs.micro_slips))
    statistics = None
    try:
        statistics = reattachment_statistics(runs.place, runs.owner, generator)
    except IllPosedError as error:
        warn(f"{error}; the statistics of the reattachment point are stored as NaN")
    of_damping = {
        "damping_ratio": (plain["damping_ratio"], "damping ratio D"),
        "deterministic_cycles": (plain["cycles"], "cycles M_d without scatter"),
        "mean_cycles": (counts.mean, "mean cycles E[M_S]"),
        "mean_cycles_error": (counts.standard_error, "standard error of E[M_S]"),
        "difference": (counts.difference, "M_d - E[M_S]"),
        "difference_low": (counts.low, "lower end of its 95 % interval"),
        "difference_high": (counts.high, "upper end of its 95 % interval"),
        "mean_micro_slips": (runs.micro_slips.mean(axis=0), "mean number of micro-slips"),
    }
    numbers = {
        "events": (len(runs.place), "reattachments that end a cycle"),
        "nominal_damping": (damping, "damping ratio of the reattachments"),
        "realisations": (len(runs.cycles), "runs"),
        "deterministic_hopf_damping": (plain["hopf_damping"], "hopf_damping without scatter"),
        "deterministic_existence_limit": (plain["existence_limit"], "existence_limit without scatter"),
    }
    variables = {name: store.Variable(("damping",), value, "1", title) for name, (value, title) in of_damping.items()}
    variables |= {name: store.Variable((), value, "1", title) for name, (value, title) in numbers.items()}
    for name, unit in (("mean", "m"), ("std", "m"), ("skewness", "1"), ("kurtosis", "1"), ("distance_to_normal", "1")):
        title = f"reattachment point X_gh: {name.replace('_', ' ')}"
        ends = getattr(statistics, name, [np.nan] * 3)
        variables |= store.with_interval(f"reattachment_{name}", (), ends, unit, title)
    closing = closing_periods(float(plain["period"]))
    still = np.array([cycling_share(column, duration, closing) for column in runs.last_cycle.T]).T
    share = cycling_share(runs.nominal_last_cycle, duration, closing)
    closed = f"share of runs with a cycle in the last {closing:g} natural periods"
    ends = np.array([returns.difference, returns.low, returns.high])
    for name, values, title in (
        ("returns", ends, "mean number of reattachments, micro-slips among them"),
        ("still_cycling", still, closed),
        ("stick_slip_share", share_of_time(runs.stick_slip), SHARE),
    ):
        variables |= store.with_interval(name, ("damping",), values, "1", title)
    return variables | store.with_interval("cycling_share", (), share, "1", f"{closed}, at the nominal damping")
