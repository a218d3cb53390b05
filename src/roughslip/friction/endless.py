"""Friction paths of any length: by recursion where the autocorrelation is exponential, else by a moving average.

Let r be the Gaussian correlation that gives mu_S its autocorrelation.

**Recursion.** Of the correlation x = exp(-s / L), r is a smooth function with r(0) = 0 and r(1) = 1. So a polynomial
r = sum_i b_i x^i of low degree p, without a constant, approximates it well. The process at equidistant nodes is then p
first-order recursions that share their noise e, one normal number a node:

    z_k = sum_i v_i,    v_i <- rho_i v_i + c_i e,    rho_i = exp(-i spacing / L),    i = 1, ..., p.

**Moving average.** Where r is zero from some lag on, the weights h of

    z_k = sum_j h_j e_(k - j),    e independent and normal,

have the root of the spectrum of r as theirs. They are symmetric, and fall beyond the last lag as 1 / j^2 at least.
Where they are cut, 16 times the last lag apart, the autocorrelation of the mean of a window errs by 1e-3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from roughslip import fft
from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError, ParameterError, real
from roughslip.friction.process import PIECE_NODES, SMOOTHER, FrictionProcess, Paths
from roughslip.probability.translation import Translation
from roughslip.validation import positive

MOST_TERMS = 8  # largest p; the weights b grow by some five a term, and rounding with them
CORRELATION_TOLERANCE = 1e-4  # p is large enough where the autocorrelation errs by no more than this,
INCREMENT_TOLERANCE = 1e-3  # and the mean square of an increment, at every lag, by no more than this share of it
CORRELATION_LIMIT = 0.01  # larger errors of the autocorrelation are refused,
SHAPE_LIMIT = 0.05  # and of that of a shape: of a triangle with a Beta of shapes 0.3 and 3, 0.03 is missed
LONGEST_RATE = 30.0  # largest p spacing / L: exp(-30) is rounding against one
FIT_NODES, CHECK_NODES = 64, 2001  # values of x at which r is fitted and checked
SPACINGS = (1e-6, 10.0)  # range of spacing / L; nodes at the longest have the correlation 5e-5
FURTHEST_LAG, MOST_LAGS = 30.0, 100_000  # the built recursion is checked up to so many L, and at so many nodes at most
SPAN, MOST_WEIGHTS = 16, 2**22  # of the weights, in last lags; and their number
APART = 1e-6  # least distance of a zero of the spectrum from the unit circle, as a share of 1 - rho_1


@dataclass(frozen=True, eq=False)
class Recursion(Paths):
    """Paths without end by recursion.

    decay, gain : (p,) [-] rho_i and c_i
    start : (p, p) [-] lower triangular; start @ (p independent normal numbers) is a stationary state v
    increment_error : [-] as of the correlation, of E[(mu_S(s + h) - mu_S(s))^2] over 2 variance (1 - exp(-h / L))
    """

    decay: np.ndarray
    gain: np.ndarray
    start: np.ndarray
    increment_error: float

    def pieces(self, seed: tuple[int, ...]) -> Iterator[np.ndarray]:
        """Rows of PIECE_NODES."""
        generator = np.random.default_rng(seed)
        state = self.start @ generator.standard_normal(self.decay.size)
        while True:
            piece = generator.standard_normal(PIECE_NODES)
            _advance(state, piece, self.decay, self.gain)
            yield self.translation.apply(piece)


@dataclass(frozen=True, eq=False)
class MovingAverage(Paths):
    """Paths without end by a moving average. weights : (n,) [-] h, of the square sum 1"""

    weights: np.ndarray

    def pieces(self, seed: tuple[int, ...]) -> Iterator[np.ndarray]:
        """Convolution by FFT: of each block, as many sums are left out as would wrap round."""
        generator, before = np.random.default_rng(seed), self.weights.size - 1
        size = fft.good_size(before + max(PIECE_NODES, before), True)
        response = fft.r2c(np.pad(self.weights, (0, size - self.weights.size)))
        noise = generator.standard_normal(size)
        while True:
            yield self.translation.apply(inverse(response * fft.r2c(noise), size)[before:])
            noise = np.concatenate((noise[size - before :], generator.standard_normal(size - before)))


def inverse(spectrum: np.ndarray, period: int) -> np.ndarray:
    """The real series (period,) of a complex spectrum (period // 2 + 1,)."""
    return np.asarray(fft.c2r(spectrum, lastsize=period, forward=False, inorm=2))


def spectrum_of(correlation: np.ndarray) -> np.ndarray:
    """The spectrum (n,) without negative parts, of a correlation (n,) at the lags of half a period."""
    return np.maximum(fft.r2c(np.concatenate((correlation, correlation[-2:0:-1]))).real, 0.0)


@compiled()
def _advance(state: np.ndarray, noise: np.ndarray, decay: np.ndarray, gain: np.ndarray) -> None:
    """z in place of the noise that leads from each node to the next; the state moves on."""
    for k in range(noise.size):
        z, e = 0.0, noise[k]
        for i in range(state.size):
            z += state[i]
            state[i] = decay[i] * state[i] + gain[i] * e
        noise[k] = z


def recursion(process: FrictionProcess, spacing_m: float) -> Recursion:
    """The recursion of a process at a spacing, of the lowest degree that meets both tolerances, else of the highest.

    Exact at the nodes but for the errors returned. Raises ParameterError for a spacing out of range, IllPosedError
    where the autocorrelation misses the exponential by more than 0.01 or no Gaussian process has the correlation
    needed.

    Method: spectral factorization (G. E. P. Box & G. M. Jenkins, Time Series Analysis, 1976, ch. 3) in the variable
    4 sin(w/2)^2, where poles close to one stay apart. The stationary state uses the orthonormal functions of Malmquist
    and Takenaka, a Cholesky factor in closed form (B. Ninness & F. Gustafsson, IEEE Trans. Autom. Control 42 (1997)
    515).
    """
    ratio = real("spacing_m", spacing_m) / process.correlation_length_m
    if not SPACINGS[0] <= ratio <= SPACINGS[1]:
        raise ParameterError(
            f"spacing_m of a path by recursion must lie in {SPACINGS[0]:g} to {SPACINGS[1]:g} correlation "
            f"lengths, not {ratio:.4g}"
        )
    translation = process.translation()
    every = np.linspace(0.0, 1.0, CHECK_NODES)[:-1]  # values of x = exp(-s / L) at which errors are found
    most = min(MOST_TERMS, int(LONGEST_RATE / ratio))
    if most < MOST_TERMS:  # nodes far apart: only x up to that of their first lag matters, and few terms suffice
        every = every * math.exp(-ratio)
    for terms in range(1, most + 1):
        weights = _exponentials(translation, terms)
        correlation_error, increment_error = _errors(translation, weights, every)
        if correlation_error <= CORRELATION_TOLERANCE and increment_error <= INCREMENT_TOLERANCE:
            break
    rate = ratio * np.arange(1, terms + 1)
    gain = _gains(weights, rate)
    at_nodes = np.exp(-ratio * np.arange(1, min(math.ceil(FURTHEST_LAG / ratio), MOST_LAGS) + 1))
    built = _errors(translation, gain * ((1.0 / _sums(rate)) @ gain), at_nodes)
    correlation_error, increment_error = max(correlation_error, built[0]), max(increment_error, built[1])
    if not correlation_error <= CORRELATION_LIMIT:
        raise IllPosedError(
            f"{terms} exponentials leave the autocorrelation {correlation_error:.3f} from the exponential, more "
            f"than {CORRELATION_LIMIT}; draw with the method spectral, or {SMOOTHER}",
            scene_keys="ensemble.process",
        )
    return Recursion(
        spacing=float(spacing_m),
        decay=np.exp(-rate),
        gain=gain,
        start=gain[:, None] * _state_factor(rate),
        translation=translation,
        correlation_error=correlation_error,
        increment_error=increment_error,
    )


def _exponentials(translation: Translation, terms: int) -> np.ndarray:
    """b : (terms,) by least squares of q at Chebyshev nodes of x; q(0) = 1 lets r vanish at long lags."""
    x = 0.5 - 0.5 * np.cos(math.pi * (np.arange(FIT_NODES) + 0.5) / FIT_NODES)
    q = (1.0 - translation.gaussian_correlation(x)) / (1.0 - x)
    powers = x[:, None] ** np.arange(1, terms)
    fitted = np.concatenate(([1.0], np.linalg.lstsq(powers, q - 1.0, rcond=None)[0]))
    return np.append(fitted[:-1] - fitted[1:], fitted[-1])


def _errors(translation: Translation, weights: np.ndarray, x: np.ndarray) -> tuple[float, float]:
    """Largest error of the autocorrelation of mu_S, and relative one of its increments, where it should be x."""
    error = np.abs(translation.series(np.polynomial.Polynomial(np.concatenate(([0.0], weights)))(x)) - x)
    return float(np.max(error)), float(np.max(error / (1.0 - x)))


def _gains(weights: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """c : (p,) of recursions that share their noise, whose sum has the covariance sum_i weights_i exp(-rate_i k).

    The weights b have both signs, so that independent recursions cannot replace these.

    Let y = 4 sin(w/2)^2. A first-order recursion has |1 - rho exp(iw)|^2 = (1 - rho)^2 + rho y. So the numerator of
    the spectrum is a polynomial in y. A root y gives the zero theta within the unit circle, (1 - theta)^2 = -theta y.
    """
    rho, short = np.exp(-rate), -np.expm1(-rate)  # short = 1 - rho
    unit = short[0] ** 2  # of y, so that the coefficients are of order one
    factors = np.stack([short**2 / unit, rho], axis=1)
    numerator = np.zeros(rate.size)
    for i in range(rate.size):
        product = np.array([weights[i] * -math.expm1(-2.0 * rate[i])])
        for j in range(rate.size):
            if j != i:
                product = np.polynomial.polynomial.polymul(product, factors[j])
        numerator += product
    minus_y = -unit * np.polynomial.polynomial.polyroots(numerator).astype(complex)
    shorter = 2.0 * minus_y / (minus_y + np.sqrt(minus_y) * np.sqrt(minus_y + 4.0))  # 1 - theta
    if np.any(np.abs(1.0 - shorter) >= 1.0 - APART * short[0]):
        raise IllPosedError(
            "the spectrum of the Gaussian process is not positive: no process has this correlation with this marginal; "
            + SMOOTHER
        )
    gain = np.empty(rate.size)
    for i in range(rate.size):
        others = np.delete(short, i) - short[i]
        gain[i] = np.prod(shorter - short[i]).real / np.prod(others)
    return gain / math.sqrt(float(gain @ (1.0 / _sums(rate)) @ gain))


def _sums(rate: np.ndarray) -> np.ndarray:
    """1 - rho_i rho_j."""
    return -np.expm1(-(rate[:, None] + rate[None, :]))


def _state_factor(rate: np.ndarray) -> np.ndarray:
    """The Cholesky factor of 1 / (1 - rho_i rho_j)."""
    sums = _sums(rate)
    rho = np.exp(-rate)
    factor = np.zeros_like(sums)
    for i in range(rate.size):
        blaschke = 1.0
        for k in range(i + 1):
            factor[i, k] = blaschke * math.sqrt(sums[k, k]) / sums[i, k]
            blaschke *= (rho[i] - rho[k]) / sums[i, k]
    return factor


def moving_average(process: FrictionProcess, spacing_m: float) -> MovingAverage:
    """The moving average of a process with a correlation shape at a spacing.

    Where no Gaussian process has the autocorrelation with this marginal, it is the nearest by the spectrum without its
    negative parts. Raises ParameterError for a spacing that needs more than 2^22 weights, IllPosedError where it is
    missed by more than 0.05.

    Method: the weights of linear phase (P. J. Brockwell & R. A. Davis, Time Series: Theory and Methods, 2nd ed. 1991,
    ch. 4). The spectrum is that of a period of SPAN last lags.
    """
    positive("spacing_m", spacing_m, "m")
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
    weights = np.roll(inverse(np.sqrt(spectrum_of(covariance)) + 0j, 2 * half), half)
    weights /= math.sqrt(float(weights @ weights))
    squares = np.abs(fft.r2c(np.pad(weights, (0, 2 * half)))) ** 2 + 0j
    reached = inverse(squares, 4 * half)[: half + 1]
    error = float(np.max(np.abs(translation.series(reached) - wanted)))
    if not error <= SHAPE_LIMIT:
        raise IllPosedError(
            f"the autocorrelation of the friction path misses the one wanted by {error:.3f}, more than "
            f"{SHAPE_LIMIT}: no Gaussian process has it with this marginal; {SMOOTHER}"
        )
    return MovingAverage(float(spacing_m), translation, error, weights)
