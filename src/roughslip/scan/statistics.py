"""What the surface of a scan is like: moments of its heights, autocorrelation, spectrum.

Every statistic comes with a 95 % interval from leaving out one sub-area of the scan at a time (`sub_areas`). Statistics
of heights are those of the measured points. The power spectrum is averaged over rings of wave vectors:

    C(q) = |sum_x w(x) z(x) exp(-i q x)|^2 dx dy / sum_x w(x)^2    [m^4],    int C(q) d^2q / (2 pi)^2 = Sq^2

(Jacobs, Junge and Pastewka, Surface Topography: Metrology and Properties 5, 2017, 013001) with a Hann window w, whose
side lobes fall faster than any self-affine spectrum. Sub-areas are transformed one by one and averaged (Welch, IEEE
Transactions on Audio and Electroacoustics 15, 1967, without overlap), then averaged over rings of |q|.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.fft

from roughslip.grid import Grid
from roughslip.probability import Estimate
from roughslip.results import described, result
from roughslip.scan.autocorrelation import Autocorrelation, autocorrelation, sub_areas_for
from roughslip.scan.jackknife import SubAreas, leave_one_out
from roughslip.scan.topography import Topography
from roughslip.validation import gate

RINGS_PER_OCTAVE = 4
ROLL_OFF = 4.0  # over the shorter 1/e length: above it a finite correlation no longer bends the spectrum
HIGHEST = 0.25  # of the highest wavenumber of the scan: blur, noise and most of the aliasing lie above

LEAKAGE = 1e-5  # share of the highest power of a ring below which a spectrum may be the window's side lobes


@result
class Spectrum:
    """Radially averaged power spectrum of a scan."""

    wavenumber: np.ndarray = described("q, the mean of each ring", "1/m", "R")
    power: Estimate = described("power C(q), with interval", "m^4", "R")
    rows: np.ndarray = described("C(q) of all sub-areas, then without each: what fits are repeated on", "m^4", "rows R")


@result
class ScanStatistics:
    """Statistics of a scan, each with its interval."""

    sub_areas: SubAreas = described("what the intervals are made from; ask it whether it is `sufficient`")
    rms_height: Estimate = described("rms height Sq", "m")
    skewness: Estimate = described("skewness Ssk")
    kurtosis: Estimate = described("kurtosis Sku, 3 for Gaussian heights")
    autocorrelation: Autocorrelation = described("autocorrelation of heights")
    spectrum: Spectrum = described("power spectrum of heights")


@gate
def scan_statistics(scan: Topography, parts: SubAreas | None = None) -> ScanStatistics:
    """All statistics of a scan whose form is removed.

    parts : sub-areas, such as those of another scan of the same mesh; its own where not given

    Raises IllPosedError where its correlation is too long for it.
    """
    parts = sub_areas_for(scan) if parts is None else parts
    moments = _moments(scan, parts)
    kurtosis = parts.interval(moments[:, 2])  # at least 1 + Ssk^2 (Pearson)
    return ScanStatistics(
        sub_areas=parts,
        rms_height=parts.interval(moments[:, 0], positive=True),
        skewness=parts.interval(moments[:, 1]),
        kurtosis=Estimate(kurtosis.value, np.maximum(kurtosis.low, 1.0 + moments[0, 1] ** 2), kurtosis.high),
        autocorrelation=autocorrelation(scan, parts),
        spectrum=spectrum(scan, parts),
    )


def _moments(scan: Topography, parts: SubAreas) -> np.ndarray:
    """(1 + B, 3) Sq [m], Ssk and Sku of all measured heights, then without each sub-area."""
    scale = float(np.std(scan.heights[scan.measured]))
    z = np.where(scan.measured, scan.heights - np.mean(scan.heights[scan.measured]), 0.0) / scale
    powers = np.stack([parts.sums(scan.measured * z**k) for k in range(5)], axis=-1)

    def central(totals: np.ndarray) -> np.ndarray:
        m1, m2, m3, m4 = totals[1:] / totals[0]
        variance = m2 - m1**2
        third = m3 - 3.0 * m1 * m2 + 2.0 * m1**3
        fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1**2 * m2 - 3.0 * m1**4
        return np.array([scale * math.sqrt(variance), third / variance**1.5, fourth / variance**2])

    return leave_one_out(powers, central)


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
    first, last = 2.0 * math.pi / (min(qx.size * grid.dx, qy.size * grid.dy)), math.pi / max(grid.dx, grid.dy)
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
    return Spectrum(over.wavenumber, parts.interval(rows, positive=True), rows)


def _hann(points: int) -> np.ndarray:
    return np.asarray(np.sin(math.pi * (np.arange(points) + 0.5) / points) ** 2)
