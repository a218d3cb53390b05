"""Stage lifetimes: how long stick-slip and steady sliding live near the existence limit, at several scatters."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.paths import path_sampler
from roughslip.oscillator.limits import hopf_damping
from roughslip.oscillator.motion import Motion
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import States, run_until_known
from roughslip.oscillator.survival import (
    Spells,
    damping_band,
    first_slip,
    mean_lifetime,
    spells,
    surviving_share,
)
from roughslip.probability.estimate import wilson_interval
from roughslip.scene.declarations import Stage
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="lifetimes",
    reads="seed oscillator survival",
    reads_if_given="ensemble.marginal friction.statistics friction.scatter",
    optional={"friction": "friction friction_under_load"},
    result="oscillator/lifetimes.nc",
    memory_mb=620,
)

NODES = 4  # per correlation length, as in the map
REACH = 4.0  # standard deviations of the limit about it, in which stick-slip lives or dies by chance
LEVELS = (0.9, 0.5, 0.1)  # of the probability of stick-slip, at the edges and in the middle of the band
STARTS = ("from rest on the belt", "from steady sliding")
TIMES = 25  # at which the surviving share is written
TITLES = {
    "survival": "share of the runs whose stick-slip survives",
    "kicked": "share of the runs that stick again, from steady sliding",
    "lifetime": "mean lifetime of stick-slip in natural periods, NaN where no run ended it",
    "waiting": "mean time from steady sliding until the mass sticks, in natural periods, NaN where it never did",
    "survival_curve": "share of the runs whose stick-slip lasts so long",
}


Run = tuple[Motion, float, States]


@dataclass(frozen=True)
class Runs:
    """What the runs at one scatter and damping showed.

    survived : (runs,) whether stick-slip lasted, from rest on the belt, until the horizon of the runs
    shares : (2, runs) of the second half of the run that is stick-slip, by STARTS
    kicked : (runs,) whether the mass stuck again, from steady sliding
    cycling : all spells of stick-slip
    waiting : the slip, from steady sliding, until the mass sticks
    first : the spells of stick-slip that runs from rest on the belt begin with
    sticks : how often the mass stuck in all runs
    """

    survived: np.ndarray
    shares: np.ndarray
    kicked: np.ndarray
    cycling: Spells
    waiting: Spells
    first: Spells
    sticks: int


def joined(parts: Sequence[Spells]) -> Spells:
    """Spells of several runs."""
    return Spells(np.concatenate([part.duration for part in parts]), np.concatenate([part.ended for part in parts]))


def first_spell(departure: float, states: States) -> Spells:
    """The spell of stick-slip that a run begins with at its first departure; of no duration where it slides at once."""
    cycling = spells(states)[0]
    if states.stick_slip.size and states.stick_slip[0, 0] == departure:
        return Spells(cycling.duration[:1], cycling.ended[:1])
    return Spells(np.zeros(1), np.ones(1, dtype=bool))


def summed_up(from_rest: Sequence[Run], from_sliding: Sequence[Run], periods: float) -> Runs:
    """Runs of the same friction paths from rest on the belt and from steady sliding, each as `run_until_known` has it.

    periods : natural periods after the first departure
    """
    both = (from_rest, from_sliding)
    waiting = joined([first_slip(motion) for motion, _, _ in from_sliding])
    share = [[states.share(first + 0.5 * periods, first + periods) for _, first, states in runs] for runs in both]
    return Runs(
        survived=np.array([not np.any(states.sliding[:, 0] < first + periods) for _, first, states in from_rest]),
        shares=np.nan_to_num(np.array(share)),  # micro-slips alone are no stick-slip
        kicked=waiting.ended,
        cycling=joined([spells(states)[0] for runs in both for _, _, states in runs]),
        waiting=waiting,
        first=joined([first_spell(first, states) for _, first, states in from_rest]),
        sticks=sum(motion.cycles + motion.micro_slips for runs in both for motion, _, _ in runs),
    )


def or_nan(ask: Callable[[], np.ndarray], where: str, reasons: list[str]) -> np.ndarray:
    """(3,) what `ask` finds, NaN for what has no bound; all NaN, and one more reason, where it is undetermined."""
    try:
        found = np.reshape(ask(), 3)
        return np.where(np.isfinite(found), found, np.nan)
    except IllPosedError as error:
        reasons.append(f"{where}: {error}")
        return np.full(3, np.nan)


def run_all(job: Job, scene: Scene, dampings: np.ndarray, deviations: np.ndarray) -> list[list[Runs]]:
    """Runs by scatter and damping; the same paths, scaled, serve every point."""
    asked, numbers = scene.survival, mass_on_belt.friction_numbers(scene, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    options = mass_on_belt.motion_options(scene)
    periods, found = asked.duration_periods, []
    together = mass_on_belt.independent_windows(scene, job.arguments.friction) ** 0.5  # the process divides by it
    for number, (deviation, row) in enumerate(zip(deviations, dampings, strict=True)):
        scaled = replace(numbers, standard_deviation=float(deviation) * together)
        process = mass_on_belt.friction_process(scene, scaled, job.arguments.friction)
        paths = path_sampler(process, process.correlation_length_m / NODES)
        seeds = ([scene.seed, geometry.STREAM_SURVIVAL, one] for one in range(asked.realisations))
        kept = [KeptPath(paths.realisation(seed)) for seed in seeds]
        of_scatter = []
        for ratio in row:
            damped = replace(belt, damping_ratio=float(ratio))
            from_rest, from_sliding = (
                [run_until_known(damped, law, path, paths.spacing, periods, options, sliding) for path in kept]
                for sliding in (False, True)
            )
            of_scatter.append(summed_up(from_rest, from_sliding, periods))
        found.append(of_scatter)
        job.usage.progress(number + 1, len(deviations))
    return found


def point_variables(results: list[list[Runs]], dampings: np.ndarray, horizon: float) -> dict[str, store.Variable]:
    """Survival, kicks, lifetimes and waiting times at every point."""
    times, reasons = np.linspace(0.0, horizon, TIMES), list[str]()
    columns: dict[str, list[Any]] = {name: [] for name in TITLES}
    for row, of_scatter in zip(dampings, results, strict=True):
        for ratio, runs in zip(row, of_scatter, strict=True):
            for name, hits in (("survival", runs.survived), ("kicked", runs.kicked)):
                low, high = wilson_interval(int(hits.sum()), hits.size)
                columns[name].append((hits.mean(), low, high))
            for name, part in (("lifetime", runs.cycling), ("waiting", runs.waiting)):
                columns[name].append(or_nan(partial(mean_lifetime, part), f"{name} at D = {ratio:.4g}", reasons))
            columns["survival_curve"].append(surviving_share(runs.first, times))
    for reason in reasons:  # beyond the limit of existence no run shows the motion
        print(f"lifetimes: {reason}; stored as NaN", file=sys.stderr)
    point = ("scatter", "point")
    variables = {"survival_time": store.Variable(("time",), times, "1", "natural periods since the first departure")}
    for name, title in TITLES.items():
        values = np.moveaxis(np.reshape(columns[name], (*dampings.shape, *np.shape(columns[name][0]))), -1, 0)
        variables |= store.with_interval(name, (*point, "time") if values.ndim == 4 else point, values, "1", title)
    return variables


def work(job: Job) -> None:
    """Write survival, mean lifetimes and kicks over scatter and damping, and the band of damping against scatter."""
    scene = job.scene
    asked, numbers = scene.survival, mass_on_belt.friction_numbers(scene, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    factors = np.array(asked.scatter_factors, dtype=np.float64)
    deviation = numbers.standard_deviation / mass_on_belt.independent_windows(scene, job.arguments.friction) ** 0.5
    deviations, horizon = deviation * factors, asked.duration_periods
    generator = np.random.default_rng([scene.seed, geometry.STREAM_BOOTSTRAP])
    with job.usage.core():
        response, scatter = mass_on_belt.response_of_limit(scene, belt, numbers, job.arguments.friction)
        hopf = hopf_damping(belt, law)
        least = np.maximum(np.minimum(response.limit - REACH * (scatter * deviations), hopf), 0.0)
        dampings = np.linspace(least, response.limit + REACH * (scatter * deviations), asked.points, axis=1)
        results = run_all(job, scene, dampings, deviations)
        points = point_variables(results, dampings, horizon)
        band, reasons = np.empty((len(deviations), len(STARTS), len(LEVELS), 3)), list[str]()
        for one, start, level in np.ndindex(band.shape[:3]):
            shares = np.array([runs.shares[start] for runs in results[one]]).T
            find = partial(damping_band, dampings[one], shares, (LEVELS[level],), generator)
            band[one, start, level] = or_nan(
                find, f"band at a deviation of {deviations[one]:.3g}, {STARTS[start]}", reasons
            )
    if reasons:
        job.usage.warn(f"{len(reasons)} of {band[..., 0].size} edges of bands are stored as NaN: {reasons[0]}")
    runs, drawn = 2 * dampings.size * asked.realisations, len(deviations) * asked.realisations
    job.usage.count(runs=runs)
    sticks = sum(one.sticks for of_scatter in results for one in of_scatter)
    job.usage.skip({skip_reasons.STICK: sticks, skip_reasons.KEPT: runs - drawn})
    row, edge = ("scatter",), ("scatter", "start", "level")
    variables = {
        "scatter_factor": store.Variable(row, factors, "1", "multiple of the scene's standard deviation of friction"),
        "friction_deviation": store.Variable(row, deviations, "1", "standard deviation of the friction of all windows"),
        "survival_damping": store.Variable(("scatter", "point"), dampings, "1", "damping ratio D"),
        "band_level": store.Variable(("level",), np.array(LEVELS), "1", "probability of stick-slip"),
        "band_start": store.Variable(("start",), np.array(STARTS), "1", "how the runs begin"),
        "survival_periods": store.Variable((), horizon, "1", "natural periods to survive"),
        "survival_runs": store.Variable((), asked.realisations, "1", "runs at a point, from each start"),
        "survival_limit": store.Variable((), response.limit, "1", "existence limit of the cycle"),
        "survival_hopf": store.Variable((), hopf, "1", "sliding is unstable below"),
        "unit_scatter": store.Variable((), scatter, "1", "std of the limit over that of friction, first order"),
    }
    title = "damping ratio of this probability of stick-slip, the share of the second half of the runs"
    variables |= points | store.with_interval("band", edge, np.moveaxis(band, -1, 0), "1", title)
    store.write(job.arguments.output, variables, job.key)
