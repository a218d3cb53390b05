"""Distribution of a sum of cosines with independent uniform phases, z = sum_t a_t cos(phi_t)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from scipy.special import j0, ndtr

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.validation import reals

PROBABILITY_ERROR = 1e-12  # of the cumulative distribution, by truncation of its series
LEAST_PROBABILITY = 1e-9  # below which a quantile is refused: 1e-12 is a thousandth of it
MOST_TERMS = 2**20


@dataclass(frozen=True, eq=False)
class RandomPhaseMarginal:
    """Heights of zero mean that are sums of J M cosines, M of each of J amplitudes.

    amplitudes : (J,) [m] a_j > 0
    repeats : M, the number of cosines of each amplitude

    The characteristic function is phi(s) = prod_j J0(a_j s)^M. The support is |z| <= b = M sum a_j. So the density is
    exactly its Fourier series of period 2 b, with values of phi as coefficients. The distribution function follows:

        F(z) = (1 + z / b) / 2 + sum_k phi(pi k / b) sin(pi k z / b) / (pi k).

    Terms beyond K sum to at most 2 / (pi n) prod sqrt(2 / (pi a s_K)), as |J0(x)| <= sqrt(2 / (pi x)). The product is
    over the n waves with pi a s_K > 2. The series ends where that falls below 1e-12.

    Raises ParameterError for amplitudes that are not positive, ConvergenceError for fewer than four waves.
    """

    amplitudes: np.ndarray
    repeats: int = 1

    def __post_init__(self) -> None:
        a = np.asarray(self.amplitudes, dtype=float)
        if a.ndim != 1 or a.size == 0 or not (np.isfinite(a).all() and (a > 0.0).all()) or self.repeats < 1:
            raise ParameterError("a sum of cosines needs a row of positive, finite amplitudes and one or more of each")

    @property
    def bound(self) -> float:
        """b [m], which no height exceeds."""
        return float(self.repeats * np.sum(self.amplitudes))

    @property
    def rms_height_m(self) -> float:
        """Sq [m]: the variance is sum a^2 / 2."""
        return math.sqrt(0.5 * self.repeats * float(np.sum(self.amplitudes**2)))

    @property
    def excess_kurtosis(self) -> float:
        """-(3/2) sum a^4 / (sum a^2)^2, since the fourth cumulant of a cos(phi) is -(3/8) a^4; the skewness is zero."""
        squares = self.amplitudes**2
        return -1.5 * float(np.sum(squares**2) / np.sum(squares) ** 2) / self.repeats

    @cached_property
    def _series(self) -> tuple[np.ndarray, np.ndarray]:
        """s_k = pi k / b [1/m] and phi(s_k)."""
        terms = 32
        while self._truncation(math.pi * terms / self.bound) > PROBABILITY_ERROR:
            terms *= 2
            if terms > MOST_TERMS:
                raise ConvergenceError(
                    "the distribution of a sum of so few cosines is not found from its series; use more frequencies or "
                    "azimuths",
                    self._truncation(math.pi * MOST_TERMS / self.bound),
                    MOST_TERMS,
                )
        s = math.pi / self.bound * np.arange(1, terms + 1)
        characteristic = np.ones(terms)
        for amplitude in self.amplitudes:
            characteristic *= j0(amplitude * s) ** self.repeats
        return s, characteristic

    def _truncation(self, s: float) -> float:
        factors = np.minimum(2.0 / (math.pi * self.amplitudes * s), 1.0)
        active = self.repeats * np.count_nonzero(factors < 1.0)
        if active == 0:
            return 1.0
        return 2.0 / (math.pi * active) * math.exp(0.5 * self.repeats * float(np.sum(np.log(factors))))

    def cdf(self, height: float | np.ndarray) -> np.ndarray:
        """F : (as height) [-] probability of lying below `height` [m], to 1e-12."""
        z = np.clip(_finite(height, "heights"), -self.bound, self.bound)
        s, characteristic = self._series
        terms = _sums_of_sines(z.ravel(), s, characteristic / (s * self.bound)).reshape(z.shape)
        return np.clip(0.5 * (1.0 + z / self.bound) + terms, 0.0, 1.0)

    def quantile(self, probability: float | np.ndarray) -> np.ndarray:
        """z : (as probability) [m] height below which that share of the ensemble lies.

        Raises ParameterError for probabilities outside 1e-9 ... 1 - 1e-9.
        """
        p = _finite(probability, "probabilities")
        if not np.all((p >= LEAST_PROBABILITY) & (p <= 1.0 - LEAST_PROBABILITY)):
            raise ParameterError(f"probabilities must lie in {LEAST_PROBABILITY} ... 1 - {LEAST_PROBABILITY}")
        b = self.bound
        roots = [
            scipy.optimize.brentq(lambda z, share=share: float(self.cdf(z)) - share, -b, b, xtol=1e-14 * b)
            for share in p.ravel()
        ]
        return np.array(roots).reshape(p.shape)

    def gaussian_distance(self) -> float:
        """Kolmogorov distance from the normal distribution of the same Sq, on 1001 heights within six Sq."""
        score = np.linspace(-6.0, 6.0, 1001)
        return float(np.max(np.abs(self.cdf(self.rms_height_m * score) - ndtr(score))))


def _finite(values: float | np.ndarray, name: str) -> np.ndarray:
    array = reals(name, values)
    if not np.isfinite(array).all():
        raise ParameterError(f"{name} must be finite")
    return array


def _sums_of_sines(z: np.ndarray, s: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """sum_k w_k sin(s_k z) a height at a time: no bit depends on how many heights are asked for together."""
    return np.array([float(np.sum(weights * np.sin(s * height))) for height in z])
