"""Counts of cycles on friction paths, at any values of parameters of a machine, and the time in stick-slip."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from roughslip.errors import ParameterError
from roughslip.oscillator.machine import OF_OSCILLATOR, Machine
from roughslip.oscillator.motion import FrictionPath, simulate
from roughslip.oscillator.states import longest_slip, states_of
from roughslip.results import described, result
from roughslip.validation import finite, gate


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
    rows = [_row(one, path, spacing_m, duration_periods) for path in paths for one in machines]
    shape = (len(paths), *(value.size for value in values.values()))
    columns = zip(*rows, strict=True)
    cycles, micro_slips, last, share, cuts, steps = (np.reshape(column, shape) for column in columns)
    return Counts(cycles, micro_slips, last, share, cuts, int(steps.sum()), values)


def _row(
    machine: Machine, path: FrictionPath, spacing_m: float, periods: float
) -> tuple[int, int, float, float, int, int]:
    """The fields of `Counts` of a motion; the share of stick-slip is NaN where the states are not defined."""
    oscillator, law, share = machine.oscillator, machine.law, math.nan
    motion = simulate(oscillator, law, path, spacing_m, periods, machine.options)
    if oscillator.q == 0.0 and oscillator.V > 0.0:
        share = states_of(motion, longest_slip(oscillator, law)).share()
    counted = motion.cycles, motion.micro_slips, motion.last_cycle, share, motion.cuts
    return *counted, motion.steps
