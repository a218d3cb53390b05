"""Power spectrum of a scan, radially averaged, with its slope, and the fractal dimension of the surface.

    C(q) = |sum_x w(x) z(x) exp(-i q x)|^2 dx dy / sum_x w(x)^2    [m^4],    int C(q) d^2q / (2 pi)^2 = Sq^2

(Jacobs, Junge and Pastewka, Surface Topography: Metrology and Properties 5, 2017, 013001) with a Hann window w, whose
side lobes fall faster than any self-affine spectrum. Sub-areas are transformed one by one and averaged (Welch, IEEE
Transactions on Audio and Electroacoustics 15, 1967, without overlap), then averaged over rings of |q|.

A self-affine surface of Hurst exponent H has C ~ q^(-2 - 2H), structure function S(r) = <(z(x + r) - z(x))^2> ~ r^(2H)
and fractal dimension D = 3 - H. The dimension to use is that of the spectrum, fitted below a quarter of the highest
wavenumber: what optics blur, what noise adds and most of what sampling folds back lie above. The structure function
mixes all wavelengths, so that a surface without the shortest ones looks smoother to it (measured: D low by 0.07, 0.03
and 0.01 at H = 0.3, 0.5 and 0.8 where a spectrum ends at the highest wavenumber of the scan); it serves as a check. It
is the one to use where heights are exact at points, or the spectrum is a few lines (Weierstrass-Mandelbrot). It is
taken of second differences,

    V(r) = <(z(x + r) - 2 z(x) + z(x - r))^2> = 4 S(r) - S(2r) ~ r^(2H),

which trends do not enter (Istas and Lang, Annales de l'Institut Henri Poincare B 33, 1997, 407).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft

from roughslip.errors import IllPosedError, ParameterError
from roughslip.surface.sub_areas import Estimate, SubAreas, leave_one_out
from roughslip.surface.topography import Topography

RINGS_PER_OCTAVE = 4
LOWEST = 6.0
"""Fundamental wavenumbers of a sub-area below which the window mixes the spectrum too much to fit a slope."""

ROLL_OFF = 4.0
"""The power law is fitted above this over the shorter 1/e length, where a finite correlation no longer bends it."""

HIGHEST = 0.25
"""Share of the highest wavenumber of the scan below which the power law is fitted."""

NARROWEST_BAND = 2.0


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
class FractalDimension:
    """Fractal dimension of a surface, 2 to 3 where it is self-affine; any value is reported.

    dimension : D = 4 + slope / 2 from the spectrum: the one to use
    slope : of ln C against ln q
    band : [1/m] wavenumbers between which the slope is fitted
    from_structure : D = 3 - H from second differences over distances pi / band
    """

    dimension: Estimate
    slope: Estimate
    band: tuple[float, float]
    from_structure: Estimate


def spectrum(scan: Topography, parts: SubAreas) -> Spectrum:
    """Radially averaged spectrum from the lowest wavenumber of a sub-area to the highest that all directions have."""
    part_x, part_y = (n // b for n, b in zip(scan.grid.shape, parts.counts, strict=True))
    window = np.outer(_hann(part_x), _hann(part_y))
    qx = 2.0 * math.pi * scipy.fft.fftfreq(part_x, scan.dx)[:, None]
    qy = 2.0 * math.pi * scipy.fft.rfftfreq(part_y, scan.dy)[None, :]
    # the transform of real heights is even: columns but those of q_y = 0 and the highest stand for two
    twice = np.where((qy > 0.0) & (qy < math.pi / scan.dy * (1.0 - 1e-9)), 2.0, 1.0) * np.ones_like(qx)
    q = np.hypot(qx, qy)
    first, last = _fundamental(scan, parts), math.pi / max(scan.dx, scan.dy)
    edges = np.geomspace(0.7 * first, last, max(2, round(RINGS_PER_OCTAVE * math.log2(last / first)) + 1))
    ring = np.searchsorted(edges, q.ravel(), side="right") - 1
    inside = (ring >= 0) & (ring < len(edges) - 1)

    def over_rings(field: np.ndarray) -> np.ndarray:
        return np.bincount(ring[inside], (twice * field).ravel()[inside], minlength=len(edges) - 1)

    modes = over_rings(np.ones_like(q))
    full = modes > 0
    powers = []
    for part in parts.slices():
        z = scan.heights[part][:part_x, :part_y]
        transform = scipy.fft.rfft2(window * (z - np.sum(window * z) / np.sum(window)))
        power = np.abs(transform) ** 2 * scan.dx * scan.dy / np.sum(window**2)
        powers.append(over_rings(power)[full] / modes[full])
    rows = leave_one_out(np.stack(powers), np.asarray)
    rows[0] /= parts.number
    rows[1:] /= parts.number - 1
    return Spectrum(over_rings(q)[full] / modes[full], parts.interval(rows, positive=True), modes[full], rows)


def power_law(found: Spectrum, parts: SubAreas, band: tuple[float, float]) -> Estimate:
    """Slope of ln C against ln q between two wavenumbers [1/m], rings weighted by the wavenumbers in them."""
    inside = (found.wavenumber >= band[0]) & (found.wavenumber <= band[1])
    if inside.sum() < 2:
        raise IllPosedError(f"fewer than two rings of the spectrum lie between {band[0]:.3g} and {band[1]:.3g} 1/m")
    x, weight = np.log(found.wavenumber[inside]), found.modes[inside]
    x = x - np.average(x, weights=weight)
    return parts.interval(np.log(found.rows[:, inside]) @ (weight * x) / np.sum(weight * x**2))


def self_affine_band(scan: Topography, parts: SubAreas) -> tuple[float, float] | None:
    """Wavenumbers [1/m] between which the scan could show a power law; None where they span less than an octave."""
    low = max(LOWEST * _fundamental(scan, parts), ROLL_OFF / min(parts.extent))
    high = HIGHEST * math.pi / max(scan.dx, scan.dy)
    return (low, high) if high >= NARROWEST_BAND * low else None


def fractal_dimension(
    scan: Topography, parts: SubAreas, found: Spectrum, band: tuple[float, float]
) -> FractalDimension:
    """Fractal dimension from the slope of the spectrum in a band, and from second differences over the same scales."""
    slope = power_law(found, parts, band)
    dimension = Estimate(*(4.0 + 0.5 * end for end in (slope.value, slope.low, slope.high)))
    return FractalDimension(dimension, slope, band, _dimension_of_differences(scan, parts, band))


def _dimension_of_differences(scan: Topography, parts: SubAreas, band: tuple[float, float]) -> Estimate:
    """D = 3 - H from the slope 2H of ln V against ln r, one slope for both axes, each with a level of its own.

    A second difference over r sees wavenumbers about pi / r most. Distances double, weighted by 1 / r^2 as the number
    of independent differences falls.
    """
    sums, logarithms, weights, axes = [], [], [], []
    for axis, step in enumerate((scan.dx, scan.dy)):
        shortest = max(1, round(math.pi / band[1] / step))
        longest = min(math.pi / band[0] / step, 0.25 * scan.grid.shape[axis])
        for k in range(1 + max(1, math.floor(math.log2(max(longest / shortest, 1.0))))):
            lag = shortest * 2**k
            squares, count = _second_differences(scan, axis, lag)
            sums.append(np.stack([parts.sums(squares), parts.sums(count)], axis=-1))
            logarithms.append(math.log(lag * step))
            weights.append(4.0**-k)
            axes.append(axis)
    x, weight = np.array(logarithms), np.array(weights)
    for axis in (0, 1):
        own = np.array(axes) == axis
        x[own] -= np.average(x[own], weights=weight[own])

    def dimension(totals: np.ndarray) -> np.ndarray:
        y = np.log(totals[:, 0] / totals[:, 1])
        return np.asarray(3.0 - 0.5 * np.sum(weight * x * y) / np.sum(weight * x**2))

    return parts.interval(leave_one_out(np.stack(sums, axis=1), dimension))


def _second_differences(scan: Topography, axis: int, lag: int) -> tuple[np.ndarray, np.ndarray]:
    """(nx, ny) squares of second differences over `lag` points along an axis, at their middles; 1 where measured."""
    n = scan.grid.shape[axis]
    if 2 * lag >= n:
        raise ParameterError(f"a second difference over {lag} points does not fit into {n}")
    z, exists = np.moveaxis(scan.heights, axis, 0), np.moveaxis(scan.measured, axis, 0)
    square, count = np.zeros(z.shape), np.zeros(z.shape)
    count[lag:-lag] = exists[2 * lag :] & exists[lag:-lag] & exists[: -2 * lag]
    square[lag:-lag] = count[lag:-lag] * (z[2 * lag :] - 2.0 * z[lag:-lag] + z[: -2 * lag]) ** 2
    return np.moveaxis(square, 0, axis), np.moveaxis(count, 0, axis)


def _fundamental(scan: Topography, parts: SubAreas) -> float:
    """Lowest wavenumber [1/m] that a sub-area has on both axes: that of its shorter edge."""
    edges = (scan.grid.nx // parts.counts[0] * scan.dx, scan.grid.ny // parts.counts[1] * scan.dy)
    return 2.0 * math.pi / min(edges)


def _hann(points: int) -> np.ndarray:
    return np.asarray(np.sin(math.pi * (np.arange(points) + 0.5) / points) ** 2)
