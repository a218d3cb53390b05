"""Power spectrum of a scan, radially averaged, with its slope, and the fractal dimension of the surface.

    C(q) = |sum_x w(x) z(x) exp(-i q x)|^2 dx dy / sum_x w(x)^2    [m^4],    int C(q) d^2q / (2 pi)^2 = Sq^2

(Jacobs, Junge and Pastewka, Surface Topography: Metrology and Properties 5, 2017, 013001) with a Hann window w, whose
side lobes fall faster than any self-affine spectrum. Sub-areas are transformed one by one and averaged (Welch, IEEE
Transactions on Audio and Electroacoustics 15, 1967, without overlap), then averaged over rings of |q|.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.fft

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.probability import Estimate
from roughslip.scan.jackknife import SubAreas, leave_one_out
from roughslip.scan.topography import Topography
from roughslip.short_repr import short_repr

RINGS_PER_OCTAVE = 4
LOWEST = 6.0  # fundamental wavenumbers of a sub-area below which the window mixes the spectrum too much to fit a slope
# The power law is fitted above this over the shorter 1/e length, where a finite correlation no longer bends it.
ROLL_OFF = 4.0
HIGHEST = 0.25
"""Share of the highest wavenumber of the scan below which the power law is fitted: blur, noise and most of the aliasing
lie above."""

NARROWEST_BAND = 2.0

LEAKAGE = 1e-5  # share of the highest power of a ring below which a spectrum may be the window's side lobes


@short_repr
@dataclass(frozen=True)
class Spectrum:
    """Radially averaged power spectrum of a scan.

    wavenumber : (R,) [1/m] q, the mean of each ring
    power : (R,) [m^4] C(q), with interval
    modes : (R,) wavenumbers in each ring of one sub-area
    rows : (1 + B, R) [m^4] C(q) of all sub-areas, then without each: what fits are repeated on
    """

    wavenumber: np.ndarray
    power: Estimate
    modes: np.ndarray
    rows: np.ndarray


@dataclass(frozen=True)
class Rings:
    """The wave vectors of a sub-area, sorted into rings of |q|.

    Rings are a quarter of an octave wide, but no narrower than the lowest wavenumber. Only some of narrower rings would
    hold wave vectors along the axes, and the spectrum of a surface with a lay would oscillate from ring to ring.

    wave_x : (px, 1), wave_y : (1, py) [1/m] of the transform of a sub-area, all signs
    ring : (px, py) the number of its ring, -1 outside of all
    wavenumber : (R,) [1/m] mean |q| of each ring
    modes : (R,) wave vectors in each
    """

    wave_x: np.ndarray
    wave_y: np.ndarray
    ring: np.ndarray
    wavenumber: np.ndarray
    modes: np.ndarray

    def mean(self, field: np.ndarray) -> np.ndarray:
        """(R,) mean over each ring of a field (px, py)."""
        inside = self.ring >= 0
        return np.bincount(self.ring[inside], field[inside], minlength=len(self.modes)) / self.modes

    def expected(self, density: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        """(R,) [m^4] of a spectral density S(q_x, q_y) [m^4], mixed as the window mixes it.

        A Hann window takes two thirds of a wavenumber and a sixth of either neighbour. What leaks further is left out:
        above LEAKAGE of the highest power the mean over samples is met within 15 %.
        """
        field = np.broadcast_to(density(self.wave_x, self.wave_y), self.ring.shape)
        for axis in (0, 1):
            field = 2.0 / 3.0 * field + (np.roll(field, 1, axis) + np.roll(field, -1, axis)) / 6.0
        return self.mean(field)


def rings(grid: Grid, parts: SubAreas) -> Rings:
    """From half the lowest wavenumber of a sub-area to the highest that all directions have."""
    qx, qy = (
        2.0 * math.pi * scipy.fft.fftfreq(n // b, step)
        for n, b, step in zip(grid.shape, parts.counts, (grid.dx, grid.dy), strict=True)
    )
    q = np.hypot(qx[:, None], qy[None, :])
    first, last = _fundamental(grid, parts), math.pi / max(grid.dx, grid.dy)
    edges = [0.5 * first]
    while edges[-1] < last:
        edges.append(max(edges[-1] + first, edges[-1] * 2.0 ** (1.0 / RINGS_PER_OCTAVE)))
    edges[-1] = last  # the last ring is cut short
    ring = np.searchsorted(edges, q, side="right") - 1
    ring[ring == len(edges) - 1] = -1
    modes = np.bincount(ring[ring >= 0], minlength=len(edges) - 1)
    full = np.flatnonzero(modes)
    ring = np.where(ring >= 0, np.searchsorted(full, ring), -1)
    wavenumber = np.bincount(ring[ring >= 0], q[ring >= 0]) / modes[full]
    return Rings(qx[:, None], qy[None, :], ring, wavenumber, modes[full])


def spectrum(scan: Topography, parts: SubAreas) -> Spectrum:
    """Radially averaged spectrum over `rings`."""
    over = rings(scan.grid, parts)
    part_x, part_y = over.ring.shape
    window = np.outer(_hann(part_x), _hann(part_y))
    powers = []
    for part in parts.slices():
        z = scan.heights[part][:part_x, :part_y]
        transform = scipy.fft.fft2(window * (z - np.sum(window * z) / np.sum(window)))
        powers.append(over.mean(np.abs(transform) ** 2) * scan.dx * scan.dy / np.sum(window**2))
    rows = leave_one_out(np.stack(powers), np.asarray)
    rows[0] /= parts.number
    rows[1:] /= parts.number - 1
    return Spectrum(over.wavenumber, parts.interval(rows, positive=True), over.modes, rows)


def self_affine_band(scan: Topography, parts: SubAreas) -> tuple[float, float] | None:
    """Wavenumbers [1/m] between which the scan could show a power law; None where they span less than an octave."""
    low = max(LOWEST * _fundamental(scan.grid, parts), ROLL_OFF / min(parts.extent))
    high = HIGHEST * math.pi / max(scan.dx, scan.dy)
    return (low, high) if high >= NARROWEST_BAND * low else None


def fractal_dimension(powers: Spectrum, parts: SubAreas, band: tuple[float, float]) -> Estimate | None:
    """D = 4 + slope / 2 from the slope of the spectrum in a band; None outside 2 to 3: no power law of a fractal.

    A Hurst exponent H gives C ~ q^(-2 - 2H) and D = 3 - H. Rings are weighted by the wavenumbers in them, and the
    interval is cut to 2 to 3. The structure function, the other common way, mixes all
    wavelengths, so that a surface without the shortest ones looks smoother to it: D was low by 0.07 at H = 0.3.
    """
    inside = (powers.wavenumber >= band[0]) & (powers.wavenumber <= band[1])
    if inside.sum() < 2:
        raise IllPosedError(
            f"fewer than two rings of the spectrum lie between {band[0]:.3g} and {band[1]:.3g} 1/m: take a larger scan"
        )
    x, weight = np.log(powers.wavenumber[inside]), powers.modes[inside]
    x = x - np.average(x, weights=weight)
    slope = parts.interval(np.log(powers.rows[:, inside]) @ (weight * x) / np.sum(weight * x**2))
    value, low, high = (4.0 + 0.5 * end for end in (slope.value, slope.low, slope.high))
    return Estimate(value, np.maximum(low, 2.0), np.minimum(high, 3.0)) if 2.0 <= value <= 3.0 else None


def _fundamental(grid: Grid, parts: SubAreas) -> float:
    """Lowest wavenumber [1/m] that a sub-area has on both axes: that of its shorter edge."""
    edges = (grid.nx // parts.counts[0] * grid.dx, grid.ny // parts.counts[1] * grid.dy)
    return 2.0 * math.pi / min(edges)


def _hann(points: int) -> np.ndarray:
    return np.asarray(np.sin(math.pi * (np.arange(points) + 0.5) / points) ** 2)
