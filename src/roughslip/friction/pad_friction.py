"""The friction coefficient of the pad that bears a load, from the statistics of one of its windows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from roughslip.friction.paths import Paths, path_sampler
from roughslip.friction.process import (
    PAPER_SHAPES,
    CorrelationShape,
    FrictionProcess,
    Marginal,
    autocorrelation_at,
    average_beta,
)
from roughslip.probability import BetaDistribution, QuantileDistribution
from roughslip.validation import gate, positive

Pad = tuple[float, float, CorrelationShape | None]


def independent_pad(windows: float, length_m: float) -> Pad:
    """A pad of windows that do not depend on each other."""
    return float(windows), length_m, None


@gate
@dataclass(frozen=True, eq=False)
class Friction:
    """The friction coefficient along the slipped distance, by the statistics of one window.

    mean, deviation : of the coefficient; the mean is that of the pad
    length_m : [m] correlation length
    marginal : the two shapes of a Beta distribution, or quantiles of the coefficient at equally spaced probabilities
    windows : that bear the load in parallel
    pad : of so many windows and a correlation length of one: how many independent ones scatter alike, at least 1, the
        length [m] of the pad, and the shape of its autocorrelation, exponential without one; by default all independent
    multiplies : whether scatter multiplies the mean curve, mu_D (1 + mu_S), or is added, mu_D + mu_S
    """

    mean: float
    deviation: float
    length_m: float
    marginal: tuple[float, float] | np.ndarray = PAPER_SHAPES
    windows: float = 1.0
    pad: Callable[[float, float], Pad] | None = None
    multiplies: bool = False

    def __post_init__(self) -> None:
        positive("Friction.mean", self.mean)

    @property
    def unit(self) -> float:
        """What mu_S is measured in: the mean friction coefficient where it multiplies, else 1."""
        return self.mean if self.multiplies else 1.0

    @cached_property
    def _of_pad(self) -> Pad:
        return (self.pad or independent_pad)(self.windows, self.length_m)

    @property
    def pad_deviation(self) -> float:
        """Standard deviation of the coefficient of all windows together."""
        return self.deviation / math.sqrt(self._of_pad[0])

    @property
    def path_deviation(self) -> float:
        """Standard deviation of mu_S."""
        return self.pad_deviation / self.unit

    @cached_property
    def process(self) -> FrictionProcess:
        """The stochastic part mu_S.

        The paper scales Beta(2.1, 5) by the least and the largest value of its sample, and these depend on its size.
        Here the marginal has mean and standard deviation of the windows. That of several windows is the mean of as many
        Beta variables as there are independent ones.
        """
        moments = self.mean / self.unit, self.deviation / self.unit
        independent, length, shape = self._of_pad
        marginal: Marginal
        if isinstance(self.marginal, tuple):
            marginal = average_beta(BetaDistribution.of_moments(*self.marginal, *moments), independent)
        else:
            marginal = QuantileDistribution(self.marginal, *moments)
        return FrictionProcess(marginal, length, shape)

    @property
    def correlation_length_m(self) -> float:
        """[m] of mu_S, the friction of all windows together."""
        return self._of_pad[1]

    @gate
    def autocorrelation(self, s: np.ndarray) -> np.ndarray:
        """Autocorrelation of mu_S at slipped distances s [m] >= 0."""
        _, length, shape = self._of_pad
        return autocorrelation_at(s, length, shape)

    @gate
    def paths(self, nodes_per_length: int, length_m: float = math.inf, method: str = "recursion") -> Paths:
        """Paths of mu_S; arguments and errors as of `path_sampler`."""
        return path_sampler(self.process, self.correlation_length_m / nodes_per_length, length_m, method)

    @gate
    def changed(self, *, mean: float, windows: float, length_m: float) -> Friction:
        """With another mean, the scatter in proportion; other windows; another correlation length of one."""
        deviation = self.deviation * (mean / self.mean)
        return replace(self, mean=mean, deviation=deviation, windows=windows, length_m=length_m)
