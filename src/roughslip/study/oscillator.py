"""Realisations of the friction process, each run at every damping ratio of the scene."""

import math
from typing import NamedTuple

import numpy as np

from roughslip import store
from roughslip.oscillator.counts import Counts
from roughslip.oscillator.counts import ensemble as ensemble_counts
from roughslip.oscillator.motion import Trajectory, simulate, trajectory
from roughslip.oscillator.path import KeptPath
from roughslip.scene.types import Scene
from roughslip.study import skip_reasons
from roughslip.study.from_scene.machine import (
    DISCARDED_PERIODS,
    DRAWN_PERIODS,
    damping_ratios,
    friction_of,
    friction_paths,
    machine_of,
    path_length,
)
from roughslip.study.from_scene.streams import Stream
from roughslip.study.job import Job

DRAWN = 12  # trajectories at most, a bundle that the eye can still part


class Run(NamedTuple):
    """The runs on one friction path.

    counts : at every damping ratio
    reattachment, last_cycle, sticks : [m], [natural periods] and number of sticks at the scene's own damping
    drawn : the trajectory there, where it is drawn
    unread : nodes of the path that no run read
    """

    counts: Counts
    reattachment: np.ndarray
    last_cycle: float
    sticks: int
    drawn: Trajectory | None
    unread: int


def runs_of(scene: Scene, job: Job, taken: range) -> list[Run]:
    """The runs on each friction path, by its number."""
    ensemble, statistics = scene.ensemble, job.optional("friction")
    friction, own = friction_of(scene, statistics), machine_of(scene, statistics)
    belt, law, options, periods = own.oscillator, own.law, own.options, ensemble.duration_periods
    dampings = damping_ratios(scene, own, friction)
    until, paths = DISCARDED_PERIODS + DRAWN_PERIODS, friction_paths(scene, friction)
    needed = math.ceil(path_length(belt, periods) / paths.spacing) + 1
    runs = []
    for row, number in enumerate(taken):
        path = KeptPath(paths.realisation([scene.seed, Stream.PROCESS, number]))
        counts = ensemble_counts(own, [path], paths.spacing, periods, over={"damping": dampings})
        nominal = simulate(belt, law, path, paths.spacing, periods, options)
        is_drawn = number < DRAWN
        drawn = trajectory(belt, law, path, paths.spacing, until, options) if is_drawn else None
        places, sticks = nominal.reattachments(DISCARDED_PERIODS), nominal.cycles + nominal.micro_slips
        runs.append(Run(counts, places, nominal.last_cycle, sticks, drawn, max(needed - path.nodes, 0)))
        job.progress(row + 1, len(taken))
    return runs


def with_scatter(scene: Scene, job: Job, taken: range) -> dict[str, store.Variable]:
    """Return counts per realisation and damping, reattachment points at the scene's damping, a few trajectories."""
    runs = runs_of(scene, job, taken)
    variables, drawn = table(runs, taken), [run.drawn for run in runs if run.drawn is not None]
    cycles, micro_slips, cut = (
        int(np.sum(variables[name].values)) for name in ("cycles", "micro_slips", "negative_friction")
    )
    count = len(taken) * runs[0].counts.cycles.size
    steps = sum(run.counts.steps for run in runs)
    job.count(runs=count, cycles=cycles, steps=steps, negative_friction_cut=cut)
    sticks, unread = (sum(getattr(run, name) for run in runs) for name in ("sticks", "unread"))
    skipped = {skip_reasons.STICK: cycles + micro_slips + sticks, skip_reasons.KEPT: count + len(drawn)}
    job.skip(skipped | {skip_reasons.UNREAD: unread})
    return variables | trajectories(drawn)


def table(runs: list[Run], taken: range) -> dict[str, store.Variable]:
    """Counts at every damping ratio, and what the runs at the scene's own damping show."""
    cycles, micro_slips, cuts, last_cycle, stick_slip = (
        np.concatenate([getattr(run.counts, name) for run in runs])
        for name in ("cycles", "micro_slips", "cuts", "last_cycle", "stick_slip")
    )
    nominal, places = np.array([run.last_cycle for run in runs]), [run.reattachment for run in runs]
    owners = np.repeat(taken, [len(place) for place in places])
    each, event = ("realisation", "damping"), ("event",)
    cut = "steps and sticks at which negative friction was cut to zero"
    return {
        "damping_ratio": store.Variable(each[1:], runs[0].counts.over["damping"], "1", "damping ratio D"),
        "realisation": store.Variable(each[:1], np.array(taken), "1", "number of the run"),
        "cycles": store.Variable(each, cycles.astype(np.int32), "1", "cycles M_S"),
        "micro_slips": store.Variable(each, micro_slips.astype(np.int32), "1", "reattachments without a cycle"),
        "negative_friction": store.Variable(each, cuts, "1", cut),
        "last_cycle": store.Variable(each, last_cycle, "1", "natural periods until the last cycle, 0 for none"),
        "stick_slip": store.Variable(each, stick_slip, "1", "share of the time in either state that is stick-slip"),
        "nominal_last_cycle": store.Variable(each[:1], nominal, "1", "the same at the scene's own damping"),
        "reattachment": store.Variable(event, np.concatenate(places), "m", "X at the start of stick"),
        "reattachment_realisation": store.Variable(event, owners, "1", "its realisation"),
    }


def trajectories(drawn: list[Trajectory]) -> dict[str, store.Variable]:
    """Those that are drawn, without the periods that are discarded."""
    if not drawn:
        return {}
    shown = drawn[0].time >= 2 * np.pi * DISCARDED_PERIODS
    variables = {"time": store.Variable(("time",), drawn[0].time[shown], "1", "tau = omega t")}
    for name, title in (("position", "X"), ("velocity", "X' = dX/dtau")):
        values = np.array([getattr(trajectory, name)[shown] for trajectory in drawn])
        variables[name] = store.Variable(("drawn", "time"), values, "m", title)
    return variables
