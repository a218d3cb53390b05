"""Friction paths of any length by recursion, node after node.

Let r be the Gaussian correlation that gives mu_S the correlation x = exp(-s / L): a smooth function with r(0) = 0 and
r(1) = 1. So a polynomial r = sum_i b_i x^i of low degree p, without a constant, approximates it well. The process at
equidistant nodes is then p first-order recursions that share their noise e, one normal number a node:

    z_k = sum_i v_i,    v_i <- rho_i v_i + c_i e,    rho_i = exp(-i spacing / L),    i = 1, ..., p.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError, ParameterError, real
from roughslip.friction.process import PIECE_NODES, FrictionProcess, Realisation
from roughslip.probability import Translation

MOST_TERMS = 8  # largest p; the weights b grow by some five a term, and rounding with them
CORRELATION_TOLERANCE = 1e-4  # p is large enough where the autocorrelation errs by no more than this,
INCREMENT_TOLERANCE = 1e-3  # and the mean square of an increment, at every lag, by no more than this share of it
CORRELATION_LIMIT = 0.01  # larger errors of the autocorrelation are refused
LONGEST_RATE = 30.0  # largest p spacing / L: exp(-30) is rounding against one
FIT_NODES, CHECK_NODES = 64, 2001  # values of x at which r is fitted and checked
SPACINGS = (1e-6, 10.0)  # range of spacing / L; nodes at the longest have the correlation 5e-5
FURTHEST_LAG, MOST_LAGS = 30.0, 100_000  # the built recursion is checked up to so many L, and at so many nodes at most
APART = 1e-6  # least distance of a zero of the spectrum from the unit circle, as a share of 1 - rho_1


@dataclass(frozen=True, eq=False)
class Recursion:
    """What paths of one process at one spacing have in common.

    spacing : [m] distance of the nodes
    decay, gain : (p,) [-] rho_i and c_i
    start : (p, p) [-] lower triangular; start @ (p independent normal numbers) is a stationary state v
    translation : from z to mu_S
    correlation_error : [-] largest deviation of the autocorrelation of mu_S from exp(-s / L) at any lag
    increment_error : [-] the same of E[(mu_S(s + h) - mu_S(s))^2], relative to 2 variance (1 - exp(-h / L))
    """

    spacing: float
    decay: np.ndarray
    gain: np.ndarray
    start: np.ndarray
    translation: Translation
    correlation_error: float
    increment_error: float

    def realisation(self, seed: Sequence[int]) -> Realisation:
        """The path of a seed, without end."""
        return Realisation(partial(self._pieces, tuple(seed)))

    def _pieces(self, seed: tuple[int, ...]) -> Iterator[np.ndarray]:
        generator = np.random.default_rng(seed)
        state = self.start @ generator.standard_normal(self.decay.size)
        while True:
            piece = generator.standard_normal(PIECE_NODES)
            _advance(state, piece, self.decay, self.gain, self.translation.normal, self.translation.values)
            yield piece


@compiled()
def _advance(
    state: np.ndarray, noise: np.ndarray, decay: np.ndarray, gain: np.ndarray, normal: np.ndarray, friction: np.ndarray
) -> None:
    """mu_S in place of the noise that leads from each node to the next; the state moves on."""
    for k in range(noise.size):
        z, e = 0.0, noise[k]
        for i in range(state.size):
            z += state[i]
            state[i] = decay[i] * state[i] + gain[i] * e
        noise[k] = interpolated(z, normal, friction)


@compiled()
def interpolated(x: float, normal: np.ndarray, values: np.ndarray) -> float:
    """Linear interpolation in a table of equidistant normal scores, constant beyond it: bit-equal to np.interp."""
    last = normal.size - 1
    if x <= normal[0]:
        return values[0]
    if x >= normal[last]:
        return values[last]
    j = min(int((x - normal[0]) * (last / (normal[last] - normal[0]))), last - 1)
    if x < normal[j]:  # where the quotient was rounded up to a node
        j -= 1
    slope = (values[j + 1] - values[j]) / (normal[j + 1] - normal[j])
    return slope * (x - normal[j]) + values[j]


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
    ratio = real("the spacing", spacing_m) / process.correlation_length_m
    if not SPACINGS[0] <= ratio <= SPACINGS[1]:
        raise ParameterError(
            f"the spacing of a friction path by recursion must lie in {SPACINGS[0]:g} to {SPACINGS[1]:g} correlation "
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
    gain = _gains(weights, rate, process.smoother)
    at_nodes = np.exp(-ratio * np.arange(1, min(math.ceil(FURTHEST_LAG / ratio), MOST_LAGS) + 1))
    built = _errors(translation, gain * ((1.0 / _sums(rate)) @ gain), at_nodes)
    correlation_error, increment_error = max(correlation_error, built[0]), max(increment_error, built[1])
    if not correlation_error <= CORRELATION_LIMIT:
        raise IllPosedError(
            f"{terms} exponentials leave the autocorrelation {correlation_error:.3f} from the exponential, more "
            f"than {CORRELATION_LIMIT}; draw by waves (ensemble.process: spectral), or {process.smoother}"
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


def _gains(weights: np.ndarray, rate: np.ndarray, smoother: str) -> np.ndarray:
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
            + smoother
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
