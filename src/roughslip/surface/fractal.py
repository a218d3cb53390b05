"""Weierstrass-Mandelbrot surfaces: plane waves of geometrically spaced frequencies with random phases (eq. 1).

    z(x, y) = sum_{j=0}^{J-1} sum_{m=0}^{M-1} a_j cos(2 pi f_j (x cos alpha_m + y sin alpha_m) + phi_jm)

Here f_j = gamma^j / L, a_j is proportional to gamma^(-H j), and alpha_m = pi m / M (M. Ausloos & D. H. Berman, Proc.
R. Soc. Lond. A 400 (1985) 331). The constants are those of W. Yan & K. Komvopoulos, J. Appl. Phys. 84 (1998) 3617,
without their term cos phi, which pins z(0, 0) = 0. M = 1 is eq. (1), with ridges along y; the sum starts at the longest
wave, for it diverges for j to -infinity.

With independent uniform phases the field is stationary and everything of second order is a finite sum. By the
Jacobi-Anger expansion the mean over the azimuths is that of an isotropic field, J0(2 pi f r), up to 2 J_2M(2 pi f r).
So a wave is isotropic up to distances of about M / pi wavelengths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy
from scipy.special import ndtr

from roughslip.errors import IllPosedError, ParameterError, real, whole
from roughslip.grid import Grid
from roughslip.surface.random_phases import RandomPhaseMarginal
from roughslip.validation import reals

MOST_WAVES = 100_000
STEPS_PER_WAVE = 8  # of the shortest wave, in the search for the 1/e length
HURST_RANGE = (0.01, 0.99)
MOST_STEPS = 2**20  # of that search
MOST_BINARY_DIGITS = 1000.0  # of G, within those of a double


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
            raise ParameterError(f"the Hurst exponent lies between 0 and 1, not {self.hurst}")
        for name in ("rms_height_m", "longest_wavelength_m", "shortest_wavelength_m"):
            value = real(name, getattr(self, name))
            if not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"{name} must be positive and finite, not {value}")
        if self.shortest_wavelength_m > self.longest_wavelength_m:
            raise ParameterError("the shortest wavelength exceeds the longest")
        gamma, azimuths = real("gamma", self.gamma), whole("azimuths", self.azimuths)
        if not (math.isfinite(gamma) and gamma > 1.0 and azimuths >= 1):
            raise ParameterError(f"gamma must exceed 1 and azimuths be 1 or more, not {self.gamma}, {self.azimuths}")
        if self.variables > MOST_WAVES:
            raise ParameterError(f"more than {MOST_WAVES} waves: use a larger gamma or fewer azimuths")

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

    @property
    def roughness_parameter_m(self) -> float:
        """G [m] of Yan and Komvopoulos: M a_0^2 = L^2 (G / L)^(2 (1 - H)) ln gamma.

        Raises IllPosedError where it is no number of the machine, as for H near 1.
        """
        longest = self.longest_wavelength_m
        scale = float(self.amplitudes[0]) * math.sqrt(self.azimuths / math.log(self.gamma)) / longest
        exponent = math.log2(longest) + math.log2(scale) / (1.0 - self.hurst)
        if not abs(exponent) < MOST_BINARY_DIGITS:
            raise IllPosedError(
                f"the roughness parameter at H = {self.hurst} is near 2^{exponent:.3g} m: use the rms height"
            )
        return longest * scale ** (1.0 / (1.0 - self.hurst))

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

    def structure_function(self, x: np.ndarray | float, y: np.ndarray | float = 0.0) -> np.ndarray:
        """S : (broadcast of x and y) [m^2] = E (z(r) - z(0))^2 = sum 2 a^2 sin^2(k . r / 2)."""
        total = np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))
        for kx, ky, a in zip(*self.waves(), strict=True):
            total += 2.0 * a**2 * np.sin(0.5 * (kx * np.asarray(x) + ky * np.asarray(y))) ** 2
        return total

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
                f"search of its 1/e length: lengthen the shortest wavelength, which hardly changes it"
            )
        distances = step * np.arange(math.ceil(self.longest_wavelength_m / step) + 1)
        below = np.flatnonzero(excess(distances) <= 0.0)
        if below.size == 0:
            raise IllPosedError(f"along {azimuth:.3g} rad the autocorrelation stays above 1/e; choose another azimuth")
        return float(scipy.optimize.brentq(excess, distances[below[0] - 1], distances[below[0]], xtol=1e-12 * step))

    def marginal(self) -> RandomPhaseMarginal:
        """Distribution of a height, the same everywhere; its excess kurtosis tends to -1.5 tanh(H ln gamma) / M."""
        return RandomPhaseMarginal(self.amplitudes, self.azimuths)


def rms_height(roughness_parameter_m: float, law: WeierstrassMandelbrot) -> float:
    """Sq [m] of the band, gamma and H of `law` with the roughness parameter G [m]: the rms height of `law` is not used.

    For small G / L the structure function between the two wavelengths depends on G, H and r alone.
    """
    if not (math.isfinite(real("the roughness parameter G", roughness_parameter_m)) and roughness_parameter_m > 0.0):
        raise ParameterError(f"the roughness parameter G must be positive and finite, not {roughness_parameter_m}")
    return law.rms_height_m * (roughness_parameter_m / law.roughness_parameter_m) ** (1.0 - law.hurst)


def fractal_on(
    grid: Grid,
    hurst: float,
    rms_height_m: float,
    azimuths: int,
    gamma: float = 1.5,
    nodes_per_wave: float = 2.0,
) -> WeierstrassMandelbrot:
    """The law whose longest wave is the longer edge of the mesh and whose shortest exceeds `nodes_per_wave` cells.

    nodes_per_wave : 2 or more; 2 goes to the Nyquist frequency of the wider spacing, which no wave reaches
    Other arguments as in WeierstrassMandelbrot. Raises ParameterError where no wave fits.
    """
    if not (math.isfinite(real("nodes a wave", nodes_per_wave)) and nodes_per_wave >= 2.0):
        raise ParameterError(f"a wave needs two nodes or more, not {nodes_per_wave}")
    axes = [(n * d, d) for n, d in ((grid.nx, grid.dx), (grid.ny, grid.dy)) if n > 1]
    ratio = max(edge for edge, _ in axes) / (nodes_per_wave * max(d for _, d in axes)) if axes else 0.0
    if not (ratio > 1.0 and gamma > 1.0):
        raise ParameterError(f"no wave fits a mesh of {grid.nx} x {grid.ny} cells with gamma = {gamma}")
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
        xi = reals("xi", xi)
        if xi.shape != self.amplitudes.shape or not np.isfinite(xi).all():
            raise ParameterError(f"xi must be {self.amplitudes.size} finite numbers, one a wave, not {xi.shape}")
        waves = (self.amplitudes * np.exp(2j * math.pi * ndtr(xi)))[:, None] * self.across
        return self.along @ np.concatenate((waves.real, waves.imag))


def plane_waves(law: WeierstrassMandelbrot, grid: Grid) -> PlaneWaves:
    """Tables from which samples of the law on the mesh follow. Raises ParameterError where the mesh aliases a wave."""
    kx, ky, amplitudes = law.waves()
    for n, spacing, k in ((grid.nx, grid.dx, kx), (grid.ny, grid.dy, ky)):
        if n > 1 and np.max(np.abs(k)) * spacing >= math.pi * (1.0 - 1e-12):
            raise ParameterError(
                f"waves of {2e6 * math.pi / np.max(np.abs(k)):.3g} um alias on cells of {1e6 * spacing:.3g} um: "
                f"lengthen the shortest wavelength or use a finer mesh"
            )
    x = np.outer(grid.x(), kx)
    return PlaneWaves(grid, amplitudes, np.hstack((np.cos(x), -np.sin(x))), np.exp(1j * np.outer(ky, grid.y())))


def fit_hurst(
    x: np.ndarray, y: np.ndarray | float, structure_m2: np.ndarray, band: WeierstrassMandelbrot
) -> WeierstrassMandelbrot:
    """The waves of `band` whose structure function is nearest to an estimated one.

    x, y : (lags,) [m] lags
    structure_m2 : (lags,) [m^2] mean square of the differences of heights there
    band : gives the wave vectors; its H and Sq are not used

    Least squares in log S, over H within 0.01 ... 0.99; Sq follows from the mean residual. A straight line through
    log S would miss the waves outside the band. Its slope gave H 0.05 to 0.07 too low at 0.8 and 0.03 to 0.09 too
    high at 0.2. Use short lags. Measured on one 512 x 512 surface (M = 16), both axes averaged. With lags up to 1/64 of
    the edge H scattered by 0.002 (H = 0.2) to 0.010 (H = 0.8). With lags up to 1/4 it scattered by 0.016 to 0.034.
    Raises IllPosedError where H ends at its limit.
    """
    x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    if x.ndim != 1 or x.size < 3 or structure_m2.shape != x.shape:
        raise ParameterError("the fit needs rows of three or more lags and as many values of the structure function")
    if not (np.isfinite([x, y, structure_m2]).all() and (structure_m2 > 0.0).all()):
        raise ParameterError("lags must be finite and the structure function positive and finite")
    kx, ky, _ = band.waves()
    squared_sines = np.sin(0.5 * (np.outer(x, kx) + np.outer(y, ky))) ** 2

    def log_ratio(hurst: float) -> np.ndarray:
        return np.log(structure_m2 / (squared_sines @ (2.0 * replace(band, hurst=hurst).waves()[2] ** 2)))

    found = scipy.optimize.minimize_scalar(
        lambda h: float(np.var(log_ratio(h))), bounds=HURST_RANGE, options={"xatol": 1e-7}
    )
    hurst = float(found.x)
    if min(hurst - HURST_RANGE[0], HURST_RANGE[1] - hurst) < 1e-4:
        raise IllPosedError(f"the structure function asks for H = {hurst:.2f}, the end of its range: not self-affine")
    scale = math.exp(0.5 * float(np.mean(log_ratio(hurst))))
    return replace(band, hurst=hurst, rms_height_m=band.rms_height_m * scale)
