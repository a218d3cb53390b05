"""Stage cycles: the ensemble summed up, cycle counts against damping and the distribution of the reattachment point."""

from collections.abc import Callable

import numpy as np

from roughslip import store
from roughslip.chaos.sampling import wilson_interval
from roughslip.errors import IllPosedError
from roughslip.oscillator.cycles import count_difference, normality, reattachment_statistics
from roughslip.probability.estimate import student_95
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="cycles",
    reads="seed oscillator.damping_ratio ensemble.duration_periods",
    inputs={"deterministic": "deterministic"},
    optional={"allocation": "ensemble_pilot"},
    many={"ensemble": "oscillator"},
    result="oscillator/statistics.nc",
    memory_doubles={"realisations dampings": 24, "realisations periods": 32, "realisations": 800},
)

HISTOGRAM_BINS = 48
CLOSING_PERIODS = 10.0


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
    found = np.full((3, stick_slip.shape[1]), np.nan)
    columns, runs = stick_slip[:, is_known], known[is_known]
    mean = np.nanmean(columns, axis=0)
    half = student_95(runs) * np.nanstd(columns, axis=0, ddof=1) / np.sqrt(runs)
    found[:, is_known] = mean, np.maximum(mean - half, 0.0), np.minimum(mean + half, 1.0)
    return found


NORMALITY = {
    "effective_skewness": "independent events that would give the skewness as well",
    "effective_kurtosis": "independent events that would give the kurtosis as well",
    "jarque_bera": "statistic of Jarque and Bera with these numbers of events",
    "jarque_bera_p": "its p-value under a Gaussian sequence of the same autocorrelation",
    "anderson_darling": "statistic of Anderson and Darling",
    "anderson_darling_p": "its p-value under a Gaussian sequence of the same autocorrelation",
}


def normality_variables(
    place: np.ndarray, owner: np.ndarray, generator: np.random.Generator, warn: Callable[[str], None]
) -> dict[str, store.Variable]:
    """Tests of normality of the reattachment point, and its correlation from one cycle to the next."""
    found, successive = None, np.nan
    try:
        found = normality(place, owner, generator)
        successive = float(found.autocorrelation[1]) if found.autocorrelation.size > 1 else np.nan
    except IllPosedError as error:
        warn(f"{error}; tests of normality are stored as NaN")
    variables = {
        f"normality_{name}": store.Variable((), getattr(found, name, np.nan), "1", title)
        for name, title in NORMALITY.items()
    }
    title = "correlation of the reattachment points of successive cycles"
    return variables | {"successive_correlation": store.Variable((), successive, "1", title)}


def work(job: Job) -> None:
    """Write M_d - E[M_S], micro-slips, moments and histogram of the reattachment point, and what is drawn."""
    plain, duration = store.read(job.arguments.deterministic), job.scene.ensemble.duration_periods
    batches = store.read_all(job.arguments.ensemble)
    with job.usage.core():
        counts = count_difference(plain["cycles"], store.join(batches, "cycles"))
        place, owner = store.join(batches, "reattachment"), store.join(batches, "reattachment_realisation")
        generator = np.random.default_rng([job.scene.seed, geometry.STREAM_BOOTSTRAP])
        statistics = None
        try:
            statistics = reattachment_statistics(place, owner, generator)
        except IllPosedError as error:
            job.usage.warn(f"{error}; the statistics of the reattachment point are stored as NaN")
        tests = normality_variables(place, owner, generator, job.usage.warn)
    events, edges = np.histogram(place, HISTOGRAM_BINS)
    last_cycle, cut = store.join(batches, "last_cycle"), store.join(batches, "negative_friction") > 0
    if cut.any():
        job.usage.warn(
            f"friction would be negative in {np.count_nonzero(cut)} of {cut.size} runs and is cut to zero there: its "
            "mean is then higher and its scatter smaller than asked. See oscillator.negative_friction"
        )
    closing = closing_periods(float(plain["period"]))
    still = np.array([cycling_share(column, duration, closing) for column in last_cycle.T]).T
    share = cycling_share(store.join(batches, "nominal_last_cycle"), duration, closing)
    stick_slip = share_of_time(store.join(batches, "stick_slip"))
    of_damping = {
        "damping_ratio": (plain["damping_ratio"], "damping ratio D"),
        "deterministic_cycles": (plain["cycles"], "cycles M_d without scatter"),
        "mean_cycles": (counts.mean, "mean cycles E[M_S]"),
        "mean_cycles_error": (counts.standard_error, "standard error of E[M_S]"),
        "difference": (counts.difference, "M_d - E[M_S]"),
        "difference_low": (counts.low, "lower end of its 95 % interval"),
        "difference_high": (counts.high, "upper end of its 95 % interval"),
        "mean_micro_slips": (store.join(batches, "micro_slips").mean(axis=0), "mean number of micro-slips"),
    }
    numbers = {
        "events": (len(place), "reattachments that end a cycle"),
        "nominal_damping": (job.scene.oscillator.damping_ratio, "the scene's damping ratio"),
        "realisations": (len(last_cycle), "runs"),
    }
    variables = {name: store.Variable(("damping",), value, "1", title) for name, (value, title) in of_damping.items()}
    variables |= {name: store.Variable((), value, "1", title) for name, (value, title) in numbers.items()}
    for name, unit in (("mean", "m"), ("std", "m"), ("skewness", "1"), ("kurtosis", "1"), ("distance_to_normal", "1")):
        title = f"reattachment point X_gh: {name.replace('_', ' ')}"
        variables |= store.with_interval(
            f"reattachment_{name}", (), getattr(statistics, name, [np.nan] * 3), unit, title
        )
    title = f"share of runs with a cycle in the last {closing:g} natural periods"
    variables |= store.with_interval("still_cycling", ("damping",), still, "1", title)
    variables |= store.with_interval("cycling_share", (), share, "1", f"{title}, at the scene's damping")
    title = "share of the time in stick-slip, of all that is stick-slip or sliding"
    variables |= store.with_interval("stick_slip_share", ("damping",), stick_slip, "1", title)
    density = events / max(events.sum(), 1) / np.diff(edges)
    variables["histogram"] = store.Variable(("bin",), density, "m-1", "density of the reattachment point")
    variables["histogram_edge"] = store.Variable(("edge",), edges, "m", "edges of its bins")
    variables["time"] = plain.variable("time")
    for name in ("position", "velocity"):
        drawn = store.join([batch for batch in batches if name in batch], name)
        variables[name] = store.Variable(("drawn", "time"), drawn, "m", f"{name} of the runs that are drawn")
    for name in ("position", "velocity", "hopf_damping", "existence_limit", "reattachment", "departure"):
        one = plain.variable(name)
        variables[f"deterministic_{name}"] = one._replace(long_name=f"{name} without scatter")
    variables |= {name: plain.variable(name) for name in ("friction_scatter", "friction_percentile") if name in plain}
    if job.arguments.allocation is not None:
        half = float(np.max(counts.high - counts.low)) / 2
        reached = half + float(store.read(job.arguments.allocation)["from_nodes"])
        job.usage.count(cycles_reached=round(reached, 3))
    job.usage.count(events=len(place))
    store.write(job.arguments.output, variables | tests, job.key)


if __name__ == "__main__":
    execute(STAGE, work)
