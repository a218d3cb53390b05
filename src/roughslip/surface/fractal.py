"""Weierstrass-Mandelbrot surfaces: plane waves of geometrically spaced frequencies with random phases (eq. 1).

    z(x, y) = sum_{j=0}^{J-1} sum_{m=0}^{M-1} a_j cos(2 pi f_j (x cos alpha_m + y sin alpha_m) + phi_jm)

Here f_j = gamma^j / L, a_j is proportional to gamma^(-H j), and alpha_m = pi m / M (M. Ausloos & D. H. Berman, Proc.
R. Soc. Lond. A 400 (1985) 331). M = 1 is eq. (1), with ridges along y; the sum starts at the longest wave, for it
diverges for j to -infinity. With independent uniform phases the field is stationary. A wave is isotropic up to
distances of about M / pi wavelengths.
"""

from __future__ import annotations

import math
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
MOST_STEPS = 2**20  # of that search
PROBABILITY_ERROR = 1e-12  # of the distribution of heights, by truncation of its series
LEAST_PROBABILITY = 1e-9  # below which a quantile is refused: 1e-12 is a thousandth of it
MOST_TERMS = 2**20


@gate
@dataclass(frozen=True)
class WeierstrassMandelbrot:
    """A self-affine surface between two wavelengths.

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
        if not 0.0 < real("the Hurst exponent", self.hurst) < 1.0:
            raise ParameterError(f"the Hurst exponent must lie between 0 and 1, not {self.hurst}")
        for name in ("rms_height_m", "longest_wavelength_m", "shortest_wavelength_m"):
            positive(name, getattr(self, name), "m")
        if self.shortest_wavelength_m > self.longest_wavelength_m:
            raise ParameterError(
                f"the shortest wavelength, {self.shortest_wavelength_m:g} m, exceeds the longest, "
                f"{self.longest_wavelength_m:g} m"
            )
        gamma, azimuths = real("gamma", self.gamma), whole("azimuths", self.azimuths)
        if not (math.isfinite(gamma) and gamma > 1.0 and azimuths >= 1):
            raise ParameterError(f"gamma must exceed 1 and azimuths be 1 or more, not {self.gamma}, {self.azimuths}")
        if self.variables > MOST_WAVES:
            raise ParameterError(
                f"{self.variables} waves, more than {MOST_WAVES}: use a larger gamma or fewer azimuths, or a narrower "
                "band; scene key: roughness.wavelengths_m"
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

        Raises IllPosedError where it does not fall so far within the longest wavelength, as along ridges, and
        ParameterError where more than MOST_STEPS of the search would be needed.
        """
        along, across = math.cos(azimuth), math.sin(azimuth)
        wanted = self.rms_height_m**2 / math.e

        def excess(r: float | np.ndarray) -> np.ndarray:
            return self(r * along, r * across) - wanted

        step = self.shortest_wavelength_m / STEPS_PER_WAVE
        if not self.longest_wavelength_m / step <= MOST_STEPS:
            raise ParameterError(
                f"the band {self.longest_wavelength_m:.3g} m to {self.shortest_wavelength_m:.3g} m is too wide for a "
                "search of its 1/e length: lengthen the shortest wavelength, which hardly changes it; scene key: "
                "roughness.wavelengths_m"
            )
        distances = step * np.arange(math.ceil(self.longest_wavelength_m / step) + 1)
        below = np.flatnonzero(excess(distances) <= 0.0)
        if below.size == 0:
            raise IllPosedError(
                f"along {azimuth:.3g} rad the autocorrelation stays above 1/e: choose another azimuth, or more of them"
            )
        return float(scipy.optimize.brentq(excess, distances[below[0] - 1], distances[below[0]], xtol=1e-12 * step))

    def marginal(self) -> RandomPhaseMarginal:
        """Distribution of a height, the same everywhere; its excess kurtosis tends to -1.5 tanh(H ln gamma) / M."""
        return RandomPhaseMarginal(self.amplitudes, self.azimuths)


@gate
def fractal_on(
    grid: Grid, hurst: float, rms_height_m: float, azimuths: int, gamma: float = 1.5
) -> WeierstrassMandelbrot:
    """The law whose longest wave is the longer edge of the mesh and whose shortest exceeds two of its wider cells.

    Arguments as in WeierstrassMandelbrot. Raises ParameterError where no wave fits.
    """
    axes = [(n * d, d) for n, d in ((grid.nx, grid.dx), (grid.ny, grid.dy)) if n > 1]
    ratio = max(edge for edge, _ in axes) / (2.0 * max(d for _, d in axes)) if axes else 0.0
    if not (ratio > 1.0 and gamma > 1.0):
        raise ParameterError(
            f"no wave fits a mesh of {grid.nx} x {grid.ny} cells with gamma = {gamma}: take more than two cells along "
            "an axis, and a gamma above 1"
        )
    longest = max(edge for edge, _ in axes)
    frequencies = math.ceil(math.log(ratio) / math.log(gamma) - 1e-9)
    return WeierstrassMandelbrot(hurst, rms_height_m, longest, longest / gamma ** (frequencies - 1), azimuths, gamma)


@dataclass(frozen=True, eq=False)
class PlaneWaves:
    """The waves of a law on the nodes of a mesh: z = Re sum_t a_t e^(i phi_t) e^(i k_x x) e^(i k_y y).

    grid : the mesh
    amplitudes : (T,) [m]
    along : (nx, 2 T) cos(k_x x) and -sin(k_x x)
    across : (T, ny) exp(i k_y y)
    """

    grid: Grid
    amplitudes: np.ndarray
    along: np.ndarray
    across: np.ndarray

    def heights(self, xi: np.ndarray) -> np.ndarray:
        """z : (nx, ny) [m] of one sample xi : (T,) of standard normal variables, the phases being 2 pi Phi(xi).

        A product of matrices of inner dimension 2 T: 4 T operations a node and no transcendental one.
        """
        xi = finite("xi", xi)
        if xi.shape != self.amplitudes.shape:
            raise ParameterError(f"xi must be {self.amplitudes.size} numbers, one a wave, not {xi.shape}")
        waves = (self.amplitudes * np.exp(2j * math.pi * ndtr(xi)))[:, None] * self.across
        return self.along @ np.concatenate((waves.real, waves.imag))


def plane_waves(law: WeierstrassMandelbrot, grid: Grid) -> PlaneWaves:
    """Tables from which samples of the law on the mesh follow. Raises ParameterError where the mesh aliases a wave."""
    kx, ky, amplitudes = law.waves()
    for n, spacing, k in ((grid.nx, grid.dx, kx), (grid.ny, grid.dy, ky)):
        if n > 1 and np.max(np.abs(k)) * spacing >= math.pi * (1.0 - 1e-12):
            raise ParameterError(
                f"waves of {2e6 * math.pi / np.max(np.abs(k)):.3g} µm alias on cells of {1e6 * spacing:.3g} µm: "
                "lengthen the shortest wavelength or use a finer mesh; scene keys: "
                "roughness.wavelengths_m, strip.cell_m"
            )
    x = np.outer(grid.x(), kx)
    return PlaneWaves(grid, amplitudes, np.hstack((np.cos(x), -np.sin(x))), np.exp(1j * np.outer(ky, grid.y())))


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

    @cached_property
    def _series(self) -> tuple[np.ndarray, np.ndarray]:
        """s_k = pi k / b [1/m] and phi(s_k)."""
        terms = 32
        while self._truncation(math.pi * terms / self.bound) > PROBABILITY_ERROR:
            terms *= 2
            if terms > MOST_TERMS:
                raise ConvergenceError(
                    f"the distribution of a sum of {len(self.amplitudes) * self.repeats} cosines is not found from "
                    "its series; use more frequencies or azimuths; scene key: "
                    "roughness.wavelengths_m",
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
        z = np.clip(finite("heights", height), -self.bound, self.bound)
        s, characteristic = self._series
        weights = characteristic / (s * self.bound)
        # a height at a time: no bit depends on how many heights are asked for together
        terms = np.array([float(np.sum(weights * np.sin(s * height))) for height in z.ravel()]).reshape(z.shape)
        return np.clip(0.5 * (1.0 + z / self.bound) + terms, 0.0, 1.0)

    def quantile(self, probability: float | np.ndarray) -> np.ndarray:
        """z : (as probability) [m] height below which that share of the ensemble lies.

        Raises ParameterError for probabilities outside 1e-9 ... 1 - 1e-9.
        """
        p = finite("probabilities", probability)
        if not np.all((p >= LEAST_PROBABILITY) & (p <= 1.0 - LEAST_PROBABILITY)):
            raise ParameterError(f"probabilities must lie in {LEAST_PROBABILITY} ... 1 - {LEAST_PROBABILITY}")
        b = self.bound
        roots = [
            scipy.optimize.brentq(lambda z, share=share: float(self.cdf(z)) - share, -b, b, xtol=1e-14 * b)
            for share in p.ravel()
        ]
        return np.array(roots).reshape(p.shape)
