"""Friction paths: one interface to the recursion, the moving average, and the paper's waves of random phase.

These take one Fourier transform over a period, which draws a whole path of a given length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roughslip import fft
from roughslip.errors import IllPosedError, ParameterError, whole
from roughslip.friction.moving_average import CORRELATION_LIMIT, MovingAverage, moving_average
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import Recursion, recursion
from roughslip.probability import Translation
from roughslip.validation import gate, positive

GUARD_LENGTHS = 10.0  # correlation lengths by which the period exceeds the path: exp(-10) is what wraps round
SHORTEST_PERIOD = 300.0  # correlation lengths; the random-phase sum has the excess kurtosis -3 L / period
MOST_NODES = 2**26
CORRELATION_TOLERANCE = 0.01


@dataclass(frozen=True, eq=False)
class Spectrum:
    """What samples of one process at one spacing have in common.

    spacing : [m] distance of the nodes
    nodes : number of nodes of a path
    period_nodes : number of nodes of the period of the Gaussian sum
    amplitude : (period_nodes // 2 + 1,) root mean square of the discrete Fourier transform of a Gaussian sample, at the
        two frequencies without a phase times sqrt(2)
    translation : from the Gaussian sum to mu_S
    correlation_error : [-] largest deviation of the autocorrelation of mu_S from that of the process at the nodes
    """

    spacing: float
    nodes: int
    period_nodes: int
    amplitude: np.ndarray
    translation: Translation
    correlation_error: float

    def realisation(self, seed: Sequence[int]) -> list[np.ndarray]:
        """The path : (nodes,) of a seed, whole: mu_S [-] at the slipped distances 0, spacing, 2 spacing, ...

        The Gaussian sum z = sum_k sqrt(2 variance_k) |w_k| cos(2 pi k j / period_nodes + arg w_k) comes by FFT.
        The w_k are exp(i phase) of independent uniform phases. Then mu_S is the quantile of the marginal at the
        probability of z, less the mean of the marginal.
        """
        wave = np.exp(1j * np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, self.amplitude.size))
        return [self.translation.apply(_inverse(self.amplitude * wave, self.period_nodes)[: self.nodes])]


def spectral_representation(process: FrictionProcess, spacing_m: float, length_m: float) -> Spectrum:
    """Spectrum for paths of at least length_m with nodes at 0, spacing_m, ..., waves of random phase.

    The one-sided discrete spectrum is the transform of the covariance wrapped round the period, so that the
    autocorrelation holds at the nodes without truncation; where it is negative it is cut. The sum is Gaussian up to an
    excess kurtosis of -0.01. Raises ParameterError for a spacing or length out of range, IllPosedError where the
    marginal does not let the autocorrelation come within 0.01 of the exponential, or 0.05 of a shape.

    Method: M. Shinozuka & G. Deodatis, Appl. Mech. Rev. 44 (1991) 191-204.
    """
    for name, value in (("spacing", spacing_m), ("length", length_m)):
        positive(f"the {name} of a friction path", value, "m")
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
    spectrum = fft.r2c(np.concatenate((covariance, covariance[-2:0:-1]))).real
    share = np.full(spectrum.size, 2.0 / period)  # one-sided: every frequency but the first and the last twice
    share[[0, -1]] = 1.0 / period
    variance = share * np.maximum(spectrum, 0.0)
    variance /= np.sum(variance)

    reached = translation.series(_inverse(variance / share + 0j, period)[:nodes])
    error = float(np.max(np.abs(reached - process.autocorrelation(np.arange(nodes) * spacing_m))))
    tolerance = CORRELATION_TOLERANCE if process.shape is None else CORRELATION_LIMIT
    if not error <= tolerance:
        raise IllPosedError(
            f"the autocorrelation of the marginal misses the one wanted by {error:.3f}, more than {tolerance}: a "
            f"translated Gaussian process cannot have both; {process.smoother}"
        )
    amplitude = np.sqrt(2.0 * variance) * period / 2.0
    amplitude[[0, -1]] *= 2.0
    return Spectrum(float(spacing_m), nodes, period, amplitude, translation, error)


def _inverse(spectrum: np.ndarray, period: int) -> np.ndarray:
    """The real series (period,) of a complex spectrum (period // 2 + 1,)."""
    return np.asarray(fft.c2r(spectrum, lastsize=period, forward=False, inorm=2))


METHODS = ("recursion", "spectral")
Paths = Recursion | MovingAverage | Spectrum  # of one process at one spacing


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
    if whole("the nodes of a friction path", nodes) < 2:
        raise ParameterError(f"a friction path has at least 2 nodes, not {nodes}")
    paths, values = path_sampler(process, spacing_m, (nodes - 1) * spacing_m, method), [np.empty(0)]
    pieces = iter(paths.realisation(seed))
    while sum(map(len, values)) < nodes:
        values.append(next(pieces))
    return np.concatenate(values)[:nodes]
