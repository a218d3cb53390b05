"""Limits, limit cycle and counts of the oscillator without scatter (mu_S = 0)."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.friction.paths import Friction
from roughslip.oscillator.cycles import Counts
from roughslip.oscillator.cycles import ensemble as ensemble_counts
from roughslip.oscillator.equation import SCATTERS, Oscillator
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import LimitCycle, departure_point, existence_limit, hopf_damping, limit_cycle
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import Trajectory, trajectory
from roughslip.scene.part import Scene
from roughslip.study.from_scene.machine import (
    DISCARDED_PERIODS,
    DRAWN_PERIODS,
    MEDIAN,
    damping_ratios,
    friction_of,
    is_record,
    is_under_load,
    machine_of,
    own_windows,
    response_of_limit,
    statistics_of,
)
from roughslip.study.job import Job

MISSED = 2.0  # factor between the windows of a scene and those of its load, above which it warns

LIMITS = {
    "hopf_damping": ("1", "damping ratio below which steady sliding is unstable"),
    "existence_limit": ("1", "damping ratio above which the stick-slip cycle does not exist"),
}


def where_it_exists(
    find: Callable[[Oscillator, FrictionLaw], Any], belt: Oscillator, law: FrictionLaw, job: Job
) -> Any:
    """What `find` finds; None where the oscillator has no such cycle or limit, with a warning where it is not found."""
    try:
        return find(belt, law)
    except IllPosedError:
        return None
    except ConvergenceError as error:
        job.warn(f"{error.in_scene}; stored as NaN")
        return None


def without_scatter(scene: Scene, job: Job) -> dict[str, store.Variable]:
    """Return the limits in damping, the cycle at the scene's damping, and the counts over its list of dampings."""
    ensemble, statistics = scene.ensemble, job.optional("friction")
    friction, machine = friction_of(scene, statistics), machine_of(scene, statistics)
    belt, law = machine.oscillator, machine.law
    limits, cycle = (np.nan, np.nan), None
    if belt.excitation_force_n == 0:
        limits = hopf_damping(belt, law), where_it_exists(existence_limit, belt, law, job)
        cycle = where_it_exists(limit_cycle, belt, law, job)
    duration, dampings = ensemble.duration_periods, damping_ratios(scene, machine, friction)
    counts = ensemble_counts(machine, [None], duration_periods=duration, over={"damping": dampings})
    drawn = trajectory(belt, law, None, 0.0, DISCARDED_PERIODS + DRAWN_PERIODS, machine.options)
    loading = departure_point(belt, law) / belt.V / (2 * np.pi) if belt.V > 0 else math.inf
    if belt.q == 0.0 and loading >= duration:
        job.warn(
            f"the mass first leaves the belt after {loading:.4g} natural periods, and the runs of figure 5 last "
            f"{duration:g}: they show neither stick-slip nor sliding. Raise ensemble.duration_periods"
        )
    job.count(runs=counts.cycles.size + 1, cycles=int(counts.cycles.sum()))
    return of_motion(limits, cycle, counts, drawn) | of_friction(job, machine, friction)


def of_motion(
    limits: tuple[float | None, float | None], cycle: LimitCycle | None, counts: Counts, drawn: Trajectory
) -> dict[str, store.Variable]:
    """Limits, cycle and counts, and the trajectory without the periods that are discarded."""
    variables = {
        f"deterministic_{name}": store.Variable((), np.nan if value is None else value, *title)
        for (name, title), value in zip(LIMITS.items(), limits, strict=True)
    }
    variables |= store.variables_of(cycle or LimitCycle(*[np.nan] * 5), "deterministic_")
    shown = drawn.time >= 2 * np.pi * DISCARDED_PERIODS
    return variables | {
        "damping_ratio": store.Variable(("damping",), counts.over["damping"], "1", "damping ratio D"),
        "deterministic_cycles": store.Variable(("damping",), counts.cycles[0], "1", "cycles M_d"),
        "time": store.Variable(("time",), drawn.time[shown], "1", "tau = omega t"),
        "deterministic_position": store.Variable(("time",), drawn.position[shown], "m", "X without scatter"),
        "deterministic_velocity": store.Variable(("time",), drawn.velocity[shown], "m", "X' = dX/dtau without scatter"),
    }


def of_friction(job: Job, machine: Machine, friction: Friction) -> dict[str, store.Variable]:
    """The scatter of the friction, and where it is that of windows how that of the load's windows moves the limit."""
    result = statistics_of(job.scene, job.optional("friction"))
    title = "standard deviation of the coefficient of all windows in parallel"
    variables = {"friction_scatter": store.Variable((), friction.pad_deviation, "1", title)}
    if result is None or is_record(result) or is_under_load(result):
        return variables
    warn_of_load(job, result, friction.pad_deviation)
    title = "what the same scatter, {}, moves the limit by with the autocorrelation of the load's pad, over that here"
    for kind, moved in load_responses(result, machine, friction).items():
        variables[f"load_response_{kind}"] = store.Variable((), moved, "1", title.format(kind))
    variables["friction_percentile"] = store.Variable((), MEDIAN, "percent", "penetration of the windows")
    return variables


def load_responses(result: store.Result, machine: Machine, friction: Friction) -> dict[str, float]:
    """What each kind of scatter moves the limit of existence by with the autocorrelation of the pad under the force.

    To first order, over what the scene's kind of scatter, as large, moves it by with that of its windows. NaN without
    a limit, as with excitation.
    """
    pad = replace(friction, windows=max(float(own_windows(result)["load_windows"]), 1.0))
    try:
        own = response_of_limit(machine, friction)[1]
        return {
            kind: response_of_limit(machine, replace(pad, multiplies=kind == "multiplicative"))[1] / own
            for kind in SCATTERS
        }
    except (IllPosedError, ConvergenceError, ParameterError):
        return dict.fromkeys(SCATTERS, math.nan)


def warn_of_load(job: Job, statistics: store.Result, scatter: float) -> None:
    """Warns where the scene's windows are far from those that bear its force at its penetration."""
    section = job.scene.oscillator
    names = ("load_windows_low", "load_windows", "load_windows_high", "load_std")
    own = own_windows(statistics)
    low, needed, high, std = (float(own[name]) for name in names)
    force, given = section.normal_force_n, section.windows_in_parallel
    if max(needed / given, given / needed) > MISSED:
        job.warn(
            f"{force:g} N on oscillator.windows_in_parallel = {given}: at percentile {MEDIAN:g} a window bears "
            f"{force / needed:.3g} N, so the force needs {needed:.4g} windows ({low:.4g} to {high:.4g}). Their "
            f"friction would scatter by {std:.2g} in place of {scatter:.2g}; give load, or other windows or penetration"
        )
