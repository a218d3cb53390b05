"""From a stage's slice of the scene and the friction statistics to the friction process and its realisations."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.errors import InputError
from roughslip.friction.paths import Paths, prepare
from roughslip.friction.process import PAPER_SHAPES, FrictionProcess, Marginal, average_beta
from roughslip.friction.recursion import Recursion
from roughslip.probability import BetaDistribution, QuantileDistribution
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import mass_on_belt


def friction_process(scene: Scene, numbers: mass_on_belt.FrictionNumbers, statistics: Path | None) -> FrictionProcess:
    """The stochastic part mu_S: the marginal that the scene names, at the mean and standard deviation of the numbers.

    The paper scales Beta(2.1, 5) by the least and the largest value of its sample, and these depend on its size. Here
    Beta(2.1, 5) has the mean and standard deviation of the windows. With several windows in parallel, the marginal is
    that of the mean of as many Beta variables. Where friction follows time, the correlation length of the process is
    the scene's correlation time.
    """
    moments = numbers.mean, numbers.standard_deviation
    kind = scene.ensemble.marginal
    marginal: Marginal
    windows = scene.oscillator.windows_in_parallel
    if kind == "empirical":
        if statistics is None:
            raise InputError("the quantiles of the windows need --friction")
        marginal = QuantileDistribution(store.read(statistics)["quantile"], *moments)
    else:
        shapes = PAPER_SHAPES if kind == "paper" else (numbers.beta_a, numbers.beta_b)
        one = BetaDistribution.of_moments(*shapes, *moments)
        marginal = BetaDistribution(*average_beta(one.a, one.b, one.lower, one.upper, windows))
    correlation_time = scene.oscillator.correlation_time_s  # where friction follows time
    return FrictionProcess(marginal, numbers.correlation_length_m if correlation_time is None else correlation_time)


def friction_paths(scene: Scene, process: FrictionProcess, nodes_per_length: int) -> Paths:
    """Realisations of the process, long enough for every run of the ensemble."""
    ensemble = scene.ensemble
    periods = max(ensemble.duration_periods, ensemble.discarded_periods + mass_on_belt.DRAWN_PERIODS)
    follows = scene.oscillator.friction_follows
    length = mass_on_belt.path_length(mass_on_belt.oscillator(scene), periods, follows)
    spacing = process.correlation_length_m / nodes_per_length
    return prepare(process, spacing, length, ensemble.process)


def path_nodes(paths: Recursion, length_m: float, seed: Sequence[int]) -> np.ndarray:
    """(nodes,) [-] one realisation up to a slipped distance [m], for many runs along the same path."""
    pieces = paths.realisation(seed, int(np.ceil(length_m / paths.spacing)) + 2)
    return next(iter(pieces))
