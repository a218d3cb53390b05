"""Weierstrass-Mandelbrot surfaces: plane waves of geometrically spaced frequencies with random phases (eq. 1).

    z(x, y) = sum_{j=0}^{J-1} sum_{m=0}^{M-1} a_j cos(2 pi f_j (x cos alpha_m + y sin alpha_m) + phi_jm)

Here f_j = gamma^j / L, a_j is proportional to gamma^(-H j), and alpha_m = pi m / M (M. Ausloos & D. H. Berman, Proc.
R. Soc. Lond. A 400 (1985) 331). M = 1 is eq. (1), with ridges along y; the sum starts at the longest wave, for it
diverges for j to -infinity. With independent uniform phases the field is stationary. A wave is isotropic up to
distances of about M / pi wavelengths.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from scipy.special import j0, ndtr

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, real, whole
from roughslip.grid import Grid
from roughslip.validation import finite, gate, positive

MOST_WAVES = 100_000
STEPS_PER_WAVE = 8  # of the shortest wave, in the search for the 1/e length
PROBABILITY_ERROR = 1e-12  # of the distribution of heights, by truncation of its series
LEAST_PROBABILITY = 1e-9  # below which a quantile is refused: 1e-12 is a thousandth of it
MOST_TERMS = 2**20


@gate
@dataclass(frozen=True)
class WeierstrassMandelbrot:
    """A self-affine surface between two wavelengths: a model to draw on any mesh, and its covariance when called.

    hurst : H = 2 - D for a profile, 3 - D for a surface of fractal dimension D, 0 < H < 1
    rms_height_m : Sq [m]
    longest_wavelength_m, shortest_wavelength_m : L and the least wavelength allowed [m]
    azimuths : M, directions in half a turn; 1 for a profile
    gamma : ratio of successive frequencies > 1
    """

    hurst: float
    rms_height_m: float
    longest_wavelength_m: float
    shortest_wavelength_m: float
    azimuths: int = 1
    gamma: float = 1.5

    def __post_init__(self) -> None:
        if not 0.0 < real("hurst", self.hurst) < 1.0:
            raise ParameterError(f"hurst must lie between 0 and 1, not {self.hurst}")
        for name in ("rms_height_m", "longest_wavelength_m", "shortest_wavelength_m"):
            positive(name, getattr(self, name), "m")
        gamma, azimuths = real("gamma", self.gamma), whole("azimuths", self.azimuths)
        ordered = self.shortest_wavelength_m <= self.longest_wavelength_m
        if not (ordered and math.isfinite(gamma) and gamma > 1.0 and azimuths >= 1):
            raise ParameterError(
                f"longest_wavelength_m = {self.longest_wavelength_m:g} must exceed shortest_wavelength_m = "
                f"{self.shortest_wavelength_m:g}, gamma = {gamma:g} exceed 1 and azimuths = {azimuths} be 1 or more"
            )
        if self.variables > MOST_WAVES:
            raise ParameterError(
                f"{self.variables} waves, more than {MOST_WAVES}: use a larger gamma or fewer azimuths, or a narrower "
                "band",
                scene_keys="roughness.wavelengths_m",
            )

    @property
    def variables(self) -> int:
        """Number J M of waves, of phases and of Gaussian variables."""
        return self._frequency_count * self.azimuths

    @property
    def _frequency_count(self) -> int:
        octaves = math.log(self.longest_wavelength_m / self.shortest_wavelength_m) / math.log(self.gamma)
        return math.floor(octaves + 1e-9) + 1

    @property
    def frequencies(self) -> np.ndarray:
        """f_j : (J,) [1/m], ascending."""
        return self.gamma ** np.arange(self._frequency_count) / self.longest_wavelength_m

    @property
    def amplitudes(self) -> np.ndarray:
        """a_j : (J,) [m] of a wave, with M sum_j a_j^2 / 2 = Sq^2."""
        shape = self.gamma ** (-self.hurst * np.arange(self._frequency_count))
        return self.rms_height_m * shape * math.sqrt(2.0 / (self.azimuths * float(np.sum(shape**2))))

    def waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """k_x, k_y [1/m], a [m], each (J M,): wave vectors and amplitudes, longest waves first."""
        azimuth = math.pi * np.arange(self.azimuths) / self.azimuths
        k = 2.0 * math.pi * self.frequencies
        kx, ky = np.outer(k, np.cos(azimuth)).ravel(), np.outer(k, np.sin(azimuth)).ravel()
        return kx, ky, self.amplitudes.repeat(self.azimuths)

    def __call__(self, x: np.ndarray | float, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] = sum a^2 cos(k . r) / 2, covariance of heights r = (x, y) [m] apart."""
        total = np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))
        for kx, ky, a in zip(*self.waves(), strict=True):
            total += 0.5 * a**2 * np.cos(kx * np.asarray(x) + ky * np.asarray(y))
        return total

    @gate
    def correlation_length(self, azimuth: float = 0.0) -> float:
        """Shortest distance [m] along `azimuth` [rad] from x at which the autocorrelation is 1/e.

        Raises IllPosedError where it does not fall so far within the longest wavelength, as along ridges.
        """
        along, across = math.cos(azimuth), math.sin(azimuth)
        wanted = self.rms_height_m**2 / math.e

        def excess(r: float | np.ndarray) -> np.ndarray:
            return self(r * along, r * across) - wanted

        step = self.shortest_wavelength_m / STEPS_PER_WAVE
        distances = step * np.arange(math.ceil(self.longest_wavelength_m / step) + 1)
        below = np.flatnonzero(excess(distances) <= 0.0)
        if below.size == 0:
            raise IllPosedError(
                f"along {azimuth:.3g} rad the autocorrelation stays above 1/e: choose another azimuth, or more of them"
            )
        return float(scipy.optimize.brentq(excess, distances[below[0] - 1], distances[below[0]], xtol=1e-12 * step))

    @cached_property
    def lengths_m(self) -> tuple[float, float]:
        """[m] 1/e lengths along x and y."""
        return self.correlation_length(0.0), self.correlation_length(math.pi / 2)

    @property
    def mirror_symmetric(self) -> bool:
        """Not known: waves may run in any set of directions."""
        return False

    @gate
    def sampler(self, grid: Grid) -> Callable[[np.random.Generator], np.ndarray]:
        """A function that draws heights (nx, ny) [m], from one standard normal variable a wave, its phase 2 pi Phi(xi).

        z = Re sum_t a_t e^(i phi_t) e^(i k_x x) e^(i k_y y) is a product of matrices of inner dimension 2 T: 4 T
        operations a node and no transcendental one. Raises ParameterError where the mesh aliases a wave.
        """
        kx, ky, amplitudes = self.waves()
        for n, spacing, k in ((grid.nx, grid.dx, kx), (grid.ny, grid.dy, ky)):
            if n > 1 and np.max(np.abs(k)) * spacing >= math.pi * (1.0 - 1e-12):
                raise ParameterError(
                    f"waves of {2e6 * math.pi / np.max(np.abs(k)):.3g} µm alias on cells of {1e6 * spacing:.3g} µm: "
                    "lengthen the shortest wavelength or use a finer mesh",
                    scene_keys="roughness.wavelengths_m, strip.cell_m",
                )
        x = np.outer(grid.x(), kx)
        along, across = np.hstack((np.cos(x), -np.sin(x))), np.exp(1j * np.outer(ky, grid.y()))

        def sample(generator: np.random.Generator) -> np.ndarray:
            phases = np.exp(2j * math.pi * ndtr(generator.standard_normal(self.variables)))
            waves = (amplitudes * phases)[:, None] * across
            return along @ np.concatenate((waves.real, waves.imag))

        return sample

    @gate
    def heights(self, field: np.ndarray) -> np.ndarray:
        """The field itself."""
        return field

    @gate
    def plane_height(self, percentile: float | np.ndarray) -> np.ndarray:
        """h_p [m] from the exact law of a sum of cosines."""
        return quantile(1.0 - np.asarray(percentile, dtype=float) / 100.0, self.amplitudes, self.azimuths)


def height_series(amplitudes: np.ndarray, repeats: int) -> tuple[float, np.ndarray, np.ndarray]:
    """The law of a sum of cosines with random phases, `repeats` (M) of each amplitude : (J,) [m].

    Returns b = M sum a_j [m], which no height exceeds, s_k = pi k / b [1/m] and phi(s_k) / (s_k b).

    The characteristic function is phi(s) = prod_j J0(a_j s)^M. The support is |z| <= b. So the density is exactly its
    Fourier series of period 2 b, with values of phi as coefficients. The distribution function follows:

        F(z) = (1 + z / b) / 2 + sum_k phi(pi k / b) sin(pi k z / b) / (pi k).

    Terms beyond K sum to at most 2 / (pi n) prod sqrt(2 / (pi a s_K)), as |J0(x)| <= sqrt(2 / (pi x)). The product is
    over the n waves with pi a s_K > 2. The series ends where that falls below 1e-12. Raises ConvergenceError for fewer
    than four waves.
    """
    bound, terms, error = float(repeats * np.sum(amplitudes)), 16, 1.0
    while error > PROBABILITY_ERROR:
        terms *= 2
        if terms > MOST_TERMS:
            raise ConvergenceError(
                f"the distribution of a sum of {len(amplitudes) * repeats} cosines is not found from its series; use "
                "a longer band, more azimuths or a smaller gamma",
                error,
                MOST_TERMS,
                scene_keys="roughness.wavelengths_m",
            )
        factors = np.minimum(2.0 / (math.pi * amplitudes * (math.pi * terms / bound)), 1.0)
        if active := repeats * np.count_nonzero(factors < 1.0):
            error = 2.0 / (math.pi * active) * math.exp(0.5 * repeats * float(np.sum(np.log(factors))))
    s = math.pi / bound * np.arange(1, terms + 1)
    characteristic = np.ones(terms)
    for amplitude in amplitudes:
        characteristic *= j0(amplitude * s) ** repeats
    return bound, s, characteristic / (s * bound)


def cdf(height: float, series: tuple[float, np.ndarray, np.ndarray]) -> float:
    """F [-], the probability of lying below a height [m], to 1e-12."""
    bound, s, weights = series
    z = min(max(height, -bound), bound)
    return min(max(0.5 * (1.0 + z / bound) + float(np.sum(weights * np.sin(s * z))), 0.0), 1.0)


def quantile(probability: np.ndarray, amplitudes: np.ndarray, repeats: int) -> np.ndarray:
    """z : (as probability) [m] height of a sum of cosines below which that share of the ensemble lies.

    Raises ParameterError for probabilities outside 1e-9 ... 1 - 1e-9.
    """
    p = finite("probabilities", probability)
    if not np.all((p >= LEAST_PROBABILITY) & (p <= 1.0 - LEAST_PROBABILITY)):
        raise ParameterError(f"probabilities must lie in {LEAST_PROBABILITY} ... 1 - {LEAST_PROBABILITY}")
    series = height_series(amplitudes, repeats)
    b = series[0]
    roots = [
        scipy.optimize.brentq(lambda z, share=share: cdf(z, series) - share, -b, b, xtol=1e-14 * b)
        for share in p.ravel()
    ]
    return np.array(roots).reshape(p.shape)
