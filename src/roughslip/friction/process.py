"""Stationary random friction along the belt: Beta marginal, exponential autocorrelation.

A Gaussian process by spectral representation, translated to the Beta marginal. Its correlation is chosen so that the
translated one is exponential.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.special import betainccinv, betaincinv, ndtr

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError

GUARD_LENGTHS = 10.0  # correlation lengths by which the period exceeds the path: exp(-10) is what wraps round
SHORTEST_PERIOD = 300.0  # correlation lengths; the random-phase sum has the excess kurtosis -3 L / period
MOST_NODES = 2**26
TABLE_EDGE, TABLE_NODES = 8.5, 2**12 + 1  # normal quantiles; beyond the edge lies a probability of 2e-17
MOST_TERMS = 200  # of the Hermite series
LEFT_OUT = 1e-4  # share of the variance that the Hermite series may leave out
CORRELATION_TOLERANCE = 0.01


@dataclass(frozen=True)
class FrictionProcess:
    """mu_S = lower + (upper - lower) Beta(a, b) less its mean, with the autocorrelation exp(-s / L).

    a, b : [-] shapes > 0
    lower, upper : [-] ends of the support of mu; equal ones stand for no scatter
    correlation_length_m : [m] L > 0
    """

    a: float
    b: float
    lower: float
    upper: float
    correlation_length_m: float

    def __post_init__(self) -> None:
        for name in ("a", "b", "correlation_length_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"FrictionProcess.{name} must be finite and positive, not {value}")
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower <= self.upper):
            raise ParameterError(f"the support of mu must be finite and in order, not {self.lower} to {self.upper}")

    @property
    def mean(self) -> float:
        """Mean of mu [-], which mu_S lacks."""
        return self.lower + (self.upper - self.lower) * self.a / (self.a + self.b)

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of mu and of mu_S [-]."""
        total = self.a + self.b
        return (self.upper - self.lower) * math.sqrt(self.a * self.b / (total + 1.0)) / total


@dataclass(frozen=True)
class Spectrum:
    """What samples of one process at one spacing have in common.

    spacing : [m] distance of the nodes
    nodes : number of nodes of a path
    period_nodes : number of nodes of the period of the Gaussian sum
    amplitude : (period_nodes // 2 + 1,) modulus of the discrete Fourier transform of a Gaussian sample
    normal, friction : (table,) [-] standard normal quantiles and mu_S there
    table_error : [-] bound of the error of mu_S by linear interpolation in the table
    clipped : [-] share of the spectrum that was negative and set to zero
    correlation_error : [-] largest deviation of the autocorrelation of mu_S from exp(-s / L) at the nodes of a path
    """

    spacing: float
    nodes: int
    period_nodes: int
    amplitude: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    table_error: float
    clipped: float
    correlation_error: float


def _standard_table(a: float, b: float) -> tuple[np.ndarray, np.ndarray]:
    """Normal quantiles z and the Beta quantile on (0, 1) less its mean, each tail from its own probability."""
    z = np.linspace(-TABLE_EDGE, TABLE_EDGE, TABLE_NODES)
    beta = np.where(z < 0.0, betaincinv(a, b, ndtr(np.minimum(z, 0.0))), betainccinv(a, b, ndtr(-np.maximum(z, 0.0))))
    return z, beta - a / (a + b)


def _hermite_weights(z: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Shares w_n, n = 1, 2, ..., of the variance of g(z) in the Hermite polynomials: corr g = sum w_n corr^n."""
    measure = np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi) * (z[1] - z[0])
    variance = float(np.sum(measure * values**2) - np.sum(measure * values) ** 2)
    before, now = np.ones_like(z), z.copy()
    weights: list[float] = []
    for n in range(1, MOST_TERMS + 1):
        weights.append(float(np.sum(measure * values * now)) ** 2 / variance)
        if sum(weights) > 1.0 - 1e-9:
            break
        before, now = now, (z * now - math.sqrt(n) * before) / math.sqrt(n + 1.0)
    if not sum(weights) > 1.0 - LEFT_OUT:
        raise IllPosedError(
            f"the Hermite series of the Beta marginal leaves out {1.0 - sum(weights):.1e} of its variance after "
            f"{MOST_TERMS} terms: it is too close to two points; use larger shapes a, b"
        )
    return np.array(weights) / sum(weights)


def _gaussian_correlation(target: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The rho with sum w_n rho^n = target in [0, 1]: Newton, the sum being increasing and convex."""
    series = np.polynomial.Polynomial(np.concatenate(([0.0], weights)))
    slope = series.deriv()
    rho = np.minimum(target / weights[0], 1.0)
    residual = math.inf
    for _ in range(100):
        excess = series(rho) - target
        residual = float(np.max(np.abs(excess)))
        if residual < 1e-14:
            return rho
        rho = np.clip(rho - excess / np.maximum(slope(rho), 1e-300), 0.0, 1.0)
    raise ConvergenceError("the Gaussian correlation was not found; use larger shapes a, b", residual, 100)


def prepare(process: FrictionProcess, spacing_m: float, length_m: float) -> Spectrum:
    """Spectrum and translation for paths of at least length_m with nodes at 0, spacing_m, ...

    The one-sided discrete spectrum is the transform of the covariance wrapped round the period, so that the exponential
    holds at the nodes without truncation. Raises ParameterError for a spacing or length out of range, IllPosedError
    where the marginal does not let the autocorrelation come within 0.01 of the exponential.

    Method: M. Shinozuka & G. Deodatis, Appl. Mech. Rev. 44 (1991) 191-204, sum of cosines with random phases;
    M. Grigoriu, J. Eng. Mech. 110 (1984) 610-620, translation; its correlation by Hermite series.
    """
    for name, value in (("spacing", spacing_m), ("length", length_m)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"the {name} of a friction path must be finite and positive, not {value} m")
    correlation_length = process.correlation_length_m
    nodes = max(math.ceil(length_m / spacing_m - 1e-9), 1) + 1
    period = max(length_m + GUARD_LENGTHS * correlation_length, SHORTEST_PERIOD * correlation_length)
    if not period / spacing_m < MOST_NODES:
        raise ParameterError(
            f"a path of {length_m:.4g} m at {spacing_m:.4g} m needs more than {MOST_NODES} nodes; use a wider spacing"
        )
    period_nodes = 2 * next_fast_len(math.ceil(0.5 * period / spacing_m) + 1, real=True)

    z, beta = _standard_table(process.a, process.b)
    weights = _hermite_weights(z, beta)
    lag = np.arange(period_nodes // 2 + 1) * spacing_m
    target = np.exp(-lag / correlation_length)
    covariance = _gaussian_correlation(target, weights)
    spectrum = rfft(np.concatenate((covariance, covariance[-2:0:-1]))).real
    share = np.full(spectrum.size, 2.0 / period_nodes)  # one-sided: every frequency but the first and the last twice
    share[[0, -1]] = 1.0 / period_nodes
    clipped = float(np.sum(share * np.maximum(-spectrum, 0.0)))
    variance = share * np.maximum(spectrum, 0.0)
    variance /= np.sum(variance)

    gaussian = irfft(variance / share, n=period_nodes)[:nodes]
    reached = np.polynomial.Polynomial(np.concatenate(([0.0], weights)))(gaussian)
    wanted = np.exp(-np.arange(nodes) * spacing_m / correlation_length)
    correlation_error = float(np.max(np.abs(reached - wanted)))
    if not correlation_error <= CORRELATION_TOLERANCE:
        raise IllPosedError(
            f"the autocorrelation of the Beta marginal misses the exponential by {correlation_error:.3f}, more than "
            f"{CORRELATION_TOLERANCE}: a translated Gaussian process cannot have both; use larger shapes a, b"
        )
    scale = process.upper - process.lower
    amplitude = np.sqrt(2.0 * variance) * period_nodes / 2.0
    amplitude[[0, -1]] *= 2.0
    return Spectrum(
        spacing=float(spacing_m),
        nodes=nodes,
        period_nodes=period_nodes,
        amplitude=amplitude,
        normal=z,
        friction=scale * beta,
        table_error=scale * float(np.max(np.abs(np.diff(beta, 2)))) / 8.0,
        clipped=clipped,
        correlation_error=correlation_error,
    )


def sample(spectrum: Spectrum, generator: np.random.Generator) -> np.ndarray:
    """One path: (nodes,) [-] mu_S at the slipped distances 0, spacing, 2 spacing, ..., of mean zero in the ensemble.

    z = sum_k sqrt(2 variance_k) cos(2 pi k j / period_nodes + phase_k) with independent uniform phases, by FFT, then
    the Beta quantile of the probability of z.
    """
    phase = generator.uniform(0.0, 2.0 * math.pi, spectrum.amplitude.size)
    z = irfft(spectrum.amplitude * np.exp(1j * phase), n=spectrum.period_nodes)[: spectrum.nodes]
    return np.interp(z, spectrum.normal, spectrum.friction)
