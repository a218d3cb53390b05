"""Stage cycles: the motion without scatter, an ensemble of friction paths at every damping, and their sums."""

from collections.abc import Callable

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.oscillator.cycles import Row, count_difference, counts_of, reattachment_statistics, row_of
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import Motion, Trajectory, simulate, trajectory
from roughslip.oscillator.path import KeptPath
from roughslip.probability.estimate import student_95, wilson_interval
from roughslip.scene.part import Scene
from roughslip.study.deterministic import without_scatter
from roughslip.study.from_scene import Stream
from roughslip.study.from_scene.machine import (
    DISCARDED_PERIODS,
    DRAWN_PERIODS,
    damping_ratios,
    friction_of,
    friction_paths,
    machine_of,
)
from roughslip.study.job import Job

DRAWN = 12  # trajectories at most, a bundle that the eye can still part
HISTOGRAM_BINS = 48
CLOSING_PERIODS = 10.0
SHARE = "share of the time in stick-slip, of all that is stick-slip or sliding"
Variables = dict[str, store.Variable]


def work(scene: Scene, job: Job) -> None:
    """Write all three. Names of the motion without scatter begin with `deterministic_`."""
    plain, runs = without_scatter(scene, job), with_scatter(scene, job)
    store.write(job.output, plain | runs | summed_up(scene, job, plain, runs), job.key)


def with_scatter(scene: Scene, job: Job) -> Variables:
    """Return counts of each run at every damping, and at the scene's own its reattachments and a few trajectories."""
    ensemble, statistics = scene.ensemble, job.optional("friction")
    friction, own = friction_of(scene, statistics), machine_of(scene, statistics)
    paths, periods = friction_paths(scene, friction), ensemble.duration_periods
    dampings = np.array(damping_ratios(scene, own, friction))
    machines = [own.changed({"damping": ratio}) for ratio in dampings.tolist()]
    rows: list[Row] = []
    places, last, drawn, taken = [], [], [], range(ensemble.realisations)
    for number in taken:
        path = KeptPath(paths.realisation([scene.seed, Stream.PROCESS, number]))

        def motion_of(machine: Machine, path: KeptPath = path) -> Motion:
            return simulate(machine.oscillator, machine.law, path, paths.spacing, periods, machine.options)

        motions = [motion_of(machine) for machine in machines]
        rows += map(row_of, machines, motions)
        nominal = motions[machines.index(own)] if own in machines else motion_of(own)
        places.append(nominal.reattachments(DISCARDED_PERIODS))
        last.append(nominal.last_cycle)
        if number < DRAWN:
            until = DISCARDED_PERIODS + DRAWN_PERIODS
            drawn.append(trajectory(own.oscillator, own.law, path, paths.spacing, until, own.options))
        job.progress(number + 1, len(taken))
    whole = counts_of(rows, (len(taken), dampings.size), {"damping": dampings})
    job.count(
        runs=whole.cycles.size, cycles=whole.cycles.sum(), steps=whole.steps, negative_friction_cut=whole.cuts.sum()
    )
    owners, run, event = np.repeat(taken, [len(place) for place in places]), ("runs",), ("event",)
    title = "natural periods until the last cycle at the scene's own damping"
    variables = store.variables_of(whole) | {
        "realisation": store.Variable(run, np.array(taken), "1", "number of the run"),
        "nominal_last_cycle": store.Variable(run, np.array(last), "1", title),
        "reattachment": store.Variable(event, np.concatenate(places), "m", "X at the start of stick"),
        "reattachment_realisation": store.Variable(event, owners, "1", "its realisation"),
    }
    return variables | trajectories(drawn)


def trajectories(drawn: list[Trajectory]) -> Variables:
    """Those that are drawn, without the periods that are discarded."""
    shown = drawn[0].time >= 2 * np.pi * DISCARDED_PERIODS
    variables = {"time": store.Variable(("time",), drawn[0].time[shown], "1", "tau = omega t")}
    for name, title in (("position", "X"), ("velocity", "X' = dX/dtau")):
        values = np.array([getattr(trajectory, name)[shown] for trajectory in drawn])
        variables[name] = store.Variable(("drawn", "time"), values, "m", f"{title} of the runs that are drawn")
    return variables


def summed_up(scene: Scene, job: Job, plain: Variables, runs: Variables) -> Variables:
    """Return M_d - E[M_S], time in stick-slip, moments and histogram of the reattachment point."""
    cycles, micro_slips, place, cuts = (runs[name].values for name in ("cycles", "micro_slips", "reattachment", "cuts"))
    counts = count_difference(plain["deterministic_cycles"].values, cycles)
    returns = count_difference(np.zeros(cycles.shape[1]), -(cycles + micro_slips))
    if np.any(cuts):
        job.warn(
            f"friction would be negative in {np.count_nonzero(cuts)} of {cuts.size} runs and is cut to zero there: its "
            "mean is then higher and its scatter smaller than asked"
        )
    events, edges = np.histogram(place, HISTOGRAM_BINS)
    density = events / max(events.sum(), 1) / np.diff(edges)
    job.count(events=len(place))
    numbers = {
        "events": (len(place), "reattachments that end a cycle"),
        "nominal_damping": (scene.oscillator.damping_ratio, "damping ratio of the reattachments"),
        "realisations": (len(cycles), "runs"),
    }
    variables = {name: store.Variable((), value, "1", title) for name, (value, title) in numbers.items()} | {
        "mean_cycles": store.Variable(("damping",), counts.mean, "1", "mean cycles E[M_S]"),
        "histogram": store.Variable(("bin",), density, "m-1", "density of the reattachment point"),
        "histogram_edge": store.Variable(("edge",), edges, "m", "edges of its bins"),
    }
    duration, period = (
        scene.ensemble.duration_periods,
        float(plain["deterministic_period"].values),
    )  # in tau, NaN without one
    closing = float(np.nanmax([CLOSING_PERIODS, 2 * period / (2 * np.pi)]))
    still = np.array([cycling_share(column, duration, closing) for column in runs["last_cycle"].values.T]).T
    closed = f"share of runs with a cycle in the last {closing:g} natural periods"
    for name, values, title in (
        ("difference", (counts.difference, counts.low, counts.high), "M_d - E[M_S]"),
        ("returns", (returns.difference, returns.low, returns.high), "mean number of reattachments, with micro-slips"),
        ("still_cycling", still, closed),
        ("stick_slip_share", share_of_time(runs["stick_slip"].values), SHARE),
    ):
        variables |= store.with_interval(name, ("damping",), values, "1", title)
    share = cycling_share(runs["nominal_last_cycle"].values, duration, closing)
    variables |= store.with_interval("cycling_share", (), share, "1", f"{closed}, at the nominal damping")
    generator = np.random.default_rng([scene.seed, Stream.BOOTSTRAP])
    return variables | of_reattachment(place, runs["reattachment_realisation"].values, generator, job.warn)


def of_reattachment(
    place: np.ndarray, owner: np.ndarray, generator: np.random.Generator, warn: Callable[[str], None]
) -> Variables:
    """Moments of the point of reattachment. place : (events,) [m]; owner : (events,) the run of each"""
    statistics = None
    try:
        statistics = reattachment_statistics(place, owner, generator)
    except IllPosedError as error:
        if place.size:  # without a cycle there is nothing to have statistics of
            warn(f"{error.in_scene}; the statistics of the reattachment point are stored as NaN")
    variables: Variables = {}
    for name, unit in (("mean", "m"), ("std", "m"), ("skewness", "1"), ("kurtosis", "1"), ("distance_to_normal", "1")):
        title = f"reattachment point X_gh: {name.replace('_', ' ')}"
        ends = getattr(statistics, name, [np.nan] * 3)
        variables |= store.with_interval(f"reattachment_{name}", (), ends, unit, title)
    return variables


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
