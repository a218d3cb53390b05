"""Friction paths of any length and any autocorrelation by a moving average of white noise, piece after piece.

Let r be the Gaussian correlation that gives mu_S its autocorrelation, zero from some lag on. The weights h of

    z_k = sum_j h_j e_(k - j),    e independent and normal,

have the root of the spectrum of r as theirs. They are symmetric, and fall beyond the last lag as 1 / j^2 at least.
Where they are cut, 16 times the last lag apart, the autocorrelation of the mean of a window errs by 1e-3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from roughslip import fft
from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.process import PIECE_NODES, FrictionProcess, Realisation
from roughslip.probability import Translation
from roughslip.validation import positive

SPAN = 16  # of the weights, in last lags
MOST_WEIGHTS = 2**22
CORRELATION_LIMIT = 0.05  # of a triangle with a Beta of shapes 0.3 and 3, far from normal, 0.03 is missed


@dataclass(frozen=True, eq=False)
class MovingAverage:
    """What paths of one process at one spacing have in common.

    spacing : [m] distance of the nodes
    weights : (n,) [-] h, of the square sum 1
    translation : from z to mu_S
    correlation_error : [-] largest deviation of the autocorrelation of mu_S from that of the process at any lag
    """

    spacing: float
    weights: np.ndarray
    translation: Translation
    correlation_error: float

    def realisation(self, seed: Sequence[int]) -> Realisation:
        """The path of a seed, without end."""
        return Realisation(partial(self._blocks, tuple(seed)))

    def _blocks(self, seed: tuple[int, ...]) -> Iterator[np.ndarray]:
        """Convolution by FFT: of each block, as many sums are left out as would wrap round."""
        generator, before = np.random.default_rng(seed), self.weights.size - 1
        size = fft.good_size(before + max(PIECE_NODES, before), True)
        response = fft.r2c(np.pad(self.weights, (0, size - self.weights.size)))
        noise = generator.standard_normal(size)
        while True:
            sums = fft.c2r(response * fft.r2c(noise), lastsize=size, forward=False, inorm=2)[before:]
            yield self.translation.apply(sums)
            noise = np.concatenate((noise[size - before :], generator.standard_normal(size - before)))


def moving_average(process: FrictionProcess, spacing_m: float) -> MovingAverage:
    """The moving average of a process with a correlation shape at a spacing.

    Where no Gaussian process has the autocorrelation with this marginal, it is the nearest by the spectrum without its
    negative parts. Raises ParameterError for a spacing that needs more than 2^22 weights, IllPosedError where it is
    missed by more than 0.05.

    Method: the weights of linear phase (P. J. Brockwell & R. A. Davis, Time Series: Theory and Methods, 2nd ed. 1991,
    ch. 4). The spectrum is that of a period of SPAN last lags.
    """
    positive("the spacing of a friction path", spacing_m, "m")
    assert process.shape is not None
    last = process.correlation_length_m * process.shape.lags[-1] / spacing_m
    if not SPAN * last < MOST_WEIGHTS:
        raise ParameterError(
            f"a friction path needs a spacing of at least {spacing_m * SPAN * last / MOST_WEIGHTS:.3g} m, not "
            f"{spacing_m:.3g} m: its autocorrelation reaches to {last * spacing_m:.3g} m"
        )
    half = max(SPAN * math.ceil(last) // 2, SPAN)
    translation, lags = process.translation(), spacing_m * np.arange(half + 1)
    wanted = process.autocorrelation(lags)
    covariance = translation.gaussian_correlation(wanted)
    spectrum = fft.r2c(np.concatenate((covariance, covariance[-2:0:-1]))).real
    roots = np.sqrt(np.maximum(spectrum, 0.0)) + 0j
    weights = np.roll(np.asarray(fft.c2r(roots, lastsize=2 * half, forward=False, inorm=2)), half)
    weights /= math.sqrt(float(weights @ weights))
    squares = np.abs(fft.r2c(np.pad(weights, (0, 2 * half)))) ** 2 + 0j
    reached = np.asarray(fft.c2r(squares, lastsize=4 * half, forward=False, inorm=2))[: half + 1]
    error = float(np.max(np.abs(translation.series(reached) - wanted)))
    if not error <= CORRELATION_LIMIT:
        raise IllPosedError(
            f"the autocorrelation of the friction path misses the one wanted by {error:.3f}, more than "
            f"{CORRELATION_LIMIT}: no Gaussian process has it with this marginal; {process.smoother}"
        )
    return MovingAverage(float(spacing_m), weights, translation, error)
