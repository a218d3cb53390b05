"""Friction of the pad that bears a load, and its paths: without end, or the paper's waves of random phase.

These take one Fourier transform over a period, which draws a whole path of a given length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from roughslip import fft
from roughslip.errors import IllPosedError, ParameterError, whole
from roughslip.friction.endless import CORRELATION_LIMIT, SHAPE_LIMIT, inverse, moving_average, recursion, spectrum_of
from roughslip.friction.process import (
    PAPER_SHAPES,
    SMOOTHER,
    CorrelationShape,
    FrictionProcess,
    Paths,
    average_beta,
)
from roughslip.probability import BetaDistribution
from roughslip.validation import gate, not_negative, positive

GUARD_LENGTHS = 10.0  # correlation lengths by which the period exceeds the path: exp(-10) is what wraps round
SHORTEST_PERIOD = 300.0  # correlation lengths; the random-phase sum has the excess kurtosis -3 L / period
MOST_NODES = 2**26


@dataclass(frozen=True, eq=False)
class Spectrum(Paths):
    """Whole paths, as waves of random phase, which repeat themselves after their period.

    nodes : number of nodes of a path
    period_nodes : number of nodes of the period of the Gaussian sum
    amplitude : (period_nodes // 2 + 1,) root mean square of the discrete Fourier transform of a Gaussian sample, at the
        two frequencies without a phase times sqrt(2)
    """

    nodes: int
    period_nodes: int
    amplitude: np.ndarray

    def pieces(self, seed: tuple[int, ...]) -> Iterator[np.ndarray]:
        """The path : (nodes,) of a seed, whole: mu_S [-] at the slipped distances 0, spacing, 2 spacing, ... Then the
        rest of the period, and the period again, for a motion that slips farther.

        The Gaussian sum z = sum_k sqrt(2 variance_k) |w_k| cos(2 pi k j / period_nodes + arg w_k) comes by FFT.
        The w_k are exp(i phase) of independent uniform phases. Then mu_S is the quantile of the marginal at the
        probability of z, less the mean of the marginal.
        """
        wave = np.exp(1j * np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, self.amplitude.size))
        gaussian = inverse(self.amplitude * wave, self.period_nodes)
        yield (path := self.translation.apply(gaussian[: self.nodes]))
        rest = self.translation.apply(gaussian[self.nodes :])
        while True:
            yield rest
            yield path


def spectral_representation(process: FrictionProcess, spacing_m: float, length_m: float) -> Spectrum:
    """Spectrum for paths of at least length_m with nodes at 0, spacing_m, ..., waves of random phase.

    The one-sided discrete spectrum is the transform of the covariance wrapped round the period, so that the
    autocorrelation holds at the nodes without truncation; where it is negative it is cut. The sum is Gaussian up to an
    excess kurtosis of -0.01. Raises ParameterError for a spacing or length out of range, IllPosedError where the
    marginal does not let the autocorrelation come within 0.01 of the exponential, or 0.05 of a shape.

    Method: M. Shinozuka & G. Deodatis, Appl. Mech. Rev. 44 (1991) 191-204.
    """
    for name, value in (("spacing", spacing_m), ("length", length_m)):
        positive(f"{name}_m", value, "m")
    nodes = max(math.ceil(length_m / spacing_m - 1e-9), 1) + 1
    correlation_m = process.correlation_length_m
    wanted_period = max(length_m + GUARD_LENGTHS * correlation_m, SHORTEST_PERIOD * correlation_m) / spacing_m
    if not wanted_period < MOST_NODES:
        raise ParameterError(
            f"a path by Fourier transform needs more than {MOST_NODES} nodes; use a wider spacing, or the recursion, "
            f"which goes piece by piece"
        )
    period = 2 * fft.good_size(math.ceil(0.5 * wanted_period) + 1, True)
    translation = process.translation()
    covariance = translation.gaussian_correlation(process.autocorrelation(np.arange(period // 2 + 1) * spacing_m))
    spectrum = spectrum_of(covariance)
    share = np.full(spectrum.size, 2.0 / period)  # one-sided: every frequency but the first and the last twice
    share[[0, -1]] = 1.0 / period
    variance = share * spectrum
    variance /= np.sum(variance)

    reached = translation.series(inverse(variance / share + 0j, period)[:nodes])
    error = float(np.max(np.abs(reached - process.autocorrelation(np.arange(nodes) * spacing_m))))
    tolerance = CORRELATION_LIMIT if process.shape is None else SHAPE_LIMIT
    if not error <= tolerance:
        raise IllPosedError(
            f"the autocorrelation of the marginal misses the one wanted by {error:.3f}, more than {tolerance}: a "
            f"translated Gaussian process cannot have both; {SMOOTHER}"
        )
    amplitude = np.sqrt(2.0 * variance) * period / 2.0
    amplitude[[0, -1]] *= 2.0
    return Spectrum(float(spacing_m), translation, error, nodes, period, amplitude)


METHODS = ("recursion", "spectral")


@gate
def path_sampler(
    process: FrictionProcess, spacing_m: float, length_m: float = math.inf, method: str = "recursion"
) -> Paths:
    """Paths with nodes at 0, spacing_m, ... that reach to length_m or further.

    method : recursion has no end and keeps a piece at a time; spectral draws the whole path at once, as the paper does.
        Both have the same marginal and autocorrelation. Where the process has a correlation shape, which no recursion
        has, a moving average takes the place of the recursion.

    Raises ParameterError and IllPosedError as they do.
    """
    positive("spacing_m", spacing_m, "m")
    if not length_m > 0.0:
        raise ParameterError(f"length_m must be positive, not {length_m} m")
    if method == "recursion":
        return recursion(process, spacing_m) if process.shape is None else moving_average(process, spacing_m)
    if method == "spectral":
        return spectral_representation(process, spacing_m, length_m)
    raise ParameterError(f"friction paths are drawn by one of {', '.join(METHODS)}, not {method!r}")


@gate
def sample_path(
    process: FrictionProcess, *, spacing_m: float, nodes: int, seed: Sequence[int], method: str = "recursion"
) -> np.ndarray:
    """One path at n nodes: mu_S : (nodes,) [-] at the slipped distances 0, spacing_m, ..., (nodes - 1) spacing_m.

    process : marginal and correlation length
    spacing_m, nodes : distance of the nodes [m] and their number, at least 2
    seed : numbers, which give one path each
    method : as of `path_sampler`, and its errors

    By recursion, the beginning of the path without end that `path_sampler` gives for this seed.
    """
    if whole("nodes", nodes) < 2:
        raise ParameterError(f"a friction path has at least 2 nodes, not {nodes}")
    paths, values = path_sampler(process, spacing_m, (nodes - 1) * spacing_m, method), [np.empty(0)]
    pieces = iter(paths.realisation(seed))
    while sum(map(len, values)) < nodes:
        values.append(next(pieces))
    return np.concatenate(values)[:nodes]


Pad = tuple[float, float, CorrelationShape | None]


@gate
@dataclass(frozen=True, eq=False)
class Friction:
    """The friction coefficient along the slipped distance, by the statistics of one window.

    mean, deviation : of the coefficient; the mean is that of the pad
    length_m : [m] correlation length
    marginal : the two shapes of a Beta distribution
    windows : that bear the load in parallel
    pad : of so many windows and a correlation length of one: how many independent ones scatter alike, at least 1, the
        length [m] of the pad, and the shape of its autocorrelation, exponential without one; by default all independent
    multiplies : whether scatter multiplies the mean curve, mu_D (1 + mu_S), or is added, mu_D + mu_S
    """

    mean: float
    deviation: float
    length_m: float
    marginal: tuple[float, float] = PAPER_SHAPES
    windows: float = 1.0
    pad: Callable[[float, float], Pad] | None = None
    multiplies: bool = False

    def __post_init__(self) -> None:
        positive("mean", self.mean)
        if not_negative("deviation", self.deviation):  # else the length says nothing
            positive("length_m", self.length_m, "m")

    @property
    def unit(self) -> float:
        """What mu_S is measured in: the mean friction coefficient where it multiplies, else 1."""
        return self.mean if self.multiplies else 1.0

    @cached_property
    def _of_pad(self) -> Pad:
        one = float(self.windows), self.length_m, None
        return one if self.pad is None else self.pad(self.windows, self.length_m)

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
        marginal = average_beta(BetaDistribution.of_moments(*self.marginal, *moments), independent)
        return FrictionProcess(marginal, length, shape)

    @property
    def correlation_length_m(self) -> float:
        """[m] of mu_S, the friction of all windows together."""
        return self._of_pad[1]

    @gate
    def autocorrelation(self, s: np.ndarray) -> np.ndarray:
        """Autocorrelation of mu_S at slipped distances s [m] >= 0."""
        return self.process.autocorrelation(s)

    @gate
    def paths(self, nodes_per_length: int, length_m: float = math.inf, method: str = "recursion") -> Paths:
        """Paths of mu_S; arguments and errors as of `path_sampler`."""
        return path_sampler(self.process, self.correlation_length_m / nodes_per_length, length_m, method)

    @gate
    def changed(self, *, mean: float, windows: float, length_m: float) -> Friction:
        """With another mean, the scatter in proportion; other windows; another correlation length of one."""
        deviation = self.deviation * (mean / self.mean)
        return replace(self, mean=mean, deviation=deviation, windows=windows, length_m=length_m)
