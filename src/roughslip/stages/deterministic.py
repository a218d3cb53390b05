"""Stage deterministic: limits, limit cycle and counts of the oscillator without scatter (mu_S = 0).

And how far mass and belt velocity may move until cycle or stability are others.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_law import FrictionLaw
from roughslip.oscillator.limits import counts_by_period, existence_limit, hopf_damping, limit_cycle
from roughslip.oscillator.motion import MotionOptions, ensemble_counts, trajectory
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.result_tables.oscillator_ranges import range_variables
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="deterministic",
    reads="oscillator ensemble numerics.oscillator_tolerance",
    reads_if_given="friction.statistics",
    optional={"friction": "friction"},
    result="oscillator/deterministic.nc",
    memory_mb=520,
)


def where_it_exists(find: Callable[[Oscillator, FrictionLaw], Any], belt: Oscillator, law: FrictionLaw) -> Any:
    """What `find` finds; None, and a line in the log, where an oscillator has no such cycle or limit."""
    try:
        return find(belt, law)
    except (IllPosedError, ConvergenceError) as error:
        print(f"deterministic: {error}; stored as NaN", file=sys.stderr)
        return None


def work(job: Job) -> None:
    """Write the limits in damping, the cycle at the scene's damping, and the counts over its list of dampings."""
    scene = job.scene
    ensemble, tolerance = scene.ensemble, scene.numerics.oscillator_tolerance
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    by_period = ensemble.count_by_period
    with job.usage.core():
        limits = {"hopf_damping": np.nan, "existence_limit": np.nan}
        cycle = {"departure": np.nan, "reattachment": np.nan, "period": np.nan, "slipped_distance": np.nan}
        if belt.excitation_force_n == 0:
            limits["hopf_damping"] = hopf_damping(belt, law)
            if (limit := where_it_exists(existence_limit, belt, law)) is not None:
                limits["existence_limit"] = limit
            if (found := where_it_exists(limit_cycle, belt, law)) is not None:
                cycle = {name: getattr(found, name) for name in cycle}
        options = MotionOptions(tolerance, integrator=scene.oscillator.integrator)
        duration, dampings = ensemble.duration_periods, ensemble.damping_ratios
        if by_period:
            counts = counts_by_period(belt, law, duration, dampings, options)
        else:
            counts = ensemble_counts(belt, law, None, 0.0, duration, dampings, options)
        periods = ensemble.discarded_periods + mass_on_belt.DRAWN_PERIODS
        drawn = trajectory(belt, law, None, 0.0, periods, options)
        ranges = range_variables(belt, law, dampings)
    kept = drawn.time >= 2 * np.pi * ensemble.discarded_periods
    job.usage.count(runs=len(counts.cycles) + 1, cycles=int(counts.cycles.sum()))
    sticks = 0 if by_period else np.sum(counts.cycles + counts.micro_slips)
    spared = round(duration * len(counts.cycles) - counts.periods)
    job.usage.skip({skip_reasons.STICK: sticks, skip_reasons.BY_PERIOD: spared})
    titles = {
        "hopf_damping": ("1", "damping ratio below which steady sliding is unstable"),
        "existence_limit": ("1", "damping ratio above which the stick-slip cycle does not exist"),
        "departure": ("m", "X at the end of stick"),
        "reattachment": ("m", "X at the start of stick"),
        "period": ("1", "period of the cycle in tau"),
        "slipped_distance": ("m", "slipped distance of a cycle"),
    }
    variables = {name: store.Variable((), value, *titles[name]) for name, value in {**limits, **cycle}.items()}
    variables |= ranges | {
        "damping_ratio": store.Variable(("damping",), counts.damping_ratios, "1", "damping ratio D"),
        "cycles": store.Variable(("damping",), counts.cycles, "1", "cycles M_d"),
        "time": store.Variable(("time",), drawn.time[kept], "1", "tau = omega t"),
        "position": store.Variable(("time",), drawn.position[kept], "m", "X"),
        "velocity": store.Variable(("time",), drawn.velocity[kept], "m", "X' = dX/dtau"),
    }
    for name in ("mean", "standard_deviation", "correlation_length_m", "beta_a", "beta_b"):
        unit = "m" if name.endswith("_m") else "1"
        variables[f"friction_{name}"] = store.Variable((), getattr(numbers, name), unit, f"friction: {name}")
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute(STAGE, work)
