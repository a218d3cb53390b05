"""What motions of the oscillator leave out, beside motions that do it all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from roughslip.friction.recursion import PIECE_NODES, recursion
from roughslip.oscillator.motion import Motion, ensemble_counts, simulate
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.periodic import counts_by_period
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.runtime import skip_reasons
from workflow.benchmarks.oscillator import LAW, PROCESS, SEED, STUDY
from workflow.benchmarks.skips_problem import Skip

TOLERANCE = 1e-6  # of the scenes
DAMPING = (0.05, 0.1, 0.17, 0.23, 0.27, 0.3, 0.32, 0.36)
# First passages are told to 1e-12 of tau (oscillator/stick.py), and all cycles depart at one point.
PASSAGE = 1e-9


def skips(periods: float, nodes: int) -> Iterator[Skip]:
    """Every skip of the oscillator over so many natural periods, on a path of so many nodes a correlation length."""
    yield Skip(
        skip_reasons.BY_PERIOD,
        f"{len(DAMPING)}-dampings-{periods:g}-periods",
        0.0,
        lambda: _counted(counts_by_period(STUDY, LAW, periods, DAMPING, TOLERANCE)),
        lambda: _counted(ensemble_counts(STUDY, LAW, None, 0.0, periods, DAMPING, TOLERANCE)),
        _apart,
    )
    yield Skip(
        skip_reasons.STICK,
        f"slow-belt-{periods:g}-periods",
        PASSAGE,
        lambda: _events(_slow("slip", periods)),
        lambda: _events(_slow("belt", periods)),
        lambda one, other: float(np.max(np.abs(one - other)) / np.max(other)),
    )
    paths = recursion(PROCESS, PROCESS.correlation_length_m / nodes)

    def run(path: Any) -> tuple[np.ndarray, int]:
        return _counted(ensemble_counts(STUDY, LAW, path, paths.spacing, periods, DAMPING, TOLERANCE))

    name = f"{len(DAMPING)}-dampings-{periods:g}-periods-{nodes}-nodes"
    yield Skip(
        skip_reasons.KEPT,
        name,
        0.0,
        lambda: run(KeptPath(paths.realisation([SEED, 0]))),
        lambda: run(paths.realisation([SEED, 0])),
        _apart,
    )
    whole = int(np.ceil(mass_on_belt.path_length(STUDY, periods) / paths.spacing)) + 2

    def drawn_before() -> tuple[np.ndarray, int]:
        return run(np.concatenate(list(islice(paths.realisation([SEED, 0]), -(-whole // PIECE_NODES)))))

    yield Skip(
        skip_reasons.UNREAD, name, 0.0, lambda: run(KeptPath(paths.realisation([SEED, 0]))), drawn_before, _apart
    )


def _slow(follows: str, periods: float) -> Motion:
    """On a belt of a tenth of the velocity, on which the mass sticks most of the time. With `belt` the end of stick is
    looked for on the path, here a constant one; with `slip` it has a closed form."""
    slow = replace(STUDY, belt_velocity_m_per_s=0.1 * STUDY.belt_velocity_m_per_s)
    return simulate(slow, LAW, None, 0.0, periods, TOLERANCE, friction_follows=follows)


def _counted(counts: Any) -> tuple[np.ndarray, int]:
    return np.array([counts.cycles, counts.micro_slips]), counts.steps


def _events(motion: Motion) -> tuple[np.ndarray, int]:
    return motion.time, motion.steps


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Counts that differ."""
    return float(np.count_nonzero(one != other))
