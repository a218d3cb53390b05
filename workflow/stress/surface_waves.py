"""The judge of waves of random phase: sums of cosines in long doubles."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from roughslip.errors import IllPosedError, ParameterError, RoughslipError
from roughslip.grid import Grid
from roughslip.surface.fractal import WeierstrassMandelbrot, plane_waves, rms_height
from workflow.stress.outcomes import Verdict, advised, verdict_of

EPS = float(np.finfo(float).eps)
ALIAS = 1e-9  # about the limit of a wave that a mesh carries
WIDE_BAND = 17.0  # octaves, up to which a 1/e length is found
ALL_TERMS, FEW_TERMS = 2.0**20, 2.0**12  # of the series of a distribution


def truncation(law: WeierstrassMandelbrot, terms: float = ALL_TERMS) -> float:
    """What so many terms of the series of the distribution may leave out, by |J0(x)| <= sqrt(2 / (pi x))."""
    a = law.amplitudes
    s = math.pi * terms / (law.azimuths * float(a.sum()))
    factors = np.minimum(2 / (math.pi * a * s), 1.0)
    active = law.azimuths * int(np.count_nonzero(factors < 1))
    return 2 / (math.pi * active) * float(np.prod(factors ** (0.5 * law.azimuths))) if active else 1.0


def _phases(law: WeierstrassMandelbrot, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(waves, n) k . r in long doubles, longest waves first."""
    j, m = np.arange(law.variables // law.azimuths), np.arange(law.azimuths)
    k = 2 * np.longdouble(np.pi) * np.longdouble(law.gamma) ** j / np.longdouble(law.longest_wavelength_m)
    alpha = np.longdouble(np.pi) * m / law.azimuths
    kx, ky = np.outer(k, np.cos(alpha)).ravel(), np.outer(k, np.sin(alpha)).ravel()
    return np.outer(kx, x) + np.outer(ky, y)


def _amplitudes(law: WeierstrassMandelbrot) -> np.ndarray:
    j = np.arange(law.variables // law.azimuths)
    a = np.longdouble(law.gamma) ** (-np.longdouble(law.hurst) * j)
    a *= np.sqrt(2 / (law.azimuths * np.sum(a**2)))
    return np.repeat(a, law.azimuths)


def judge_waves(number: int, law: WeierstrassMandelbrot, grid: Grid) -> Verdict:
    """Covariance, structure function, heights on the mesh, the law of a height, lengths and the roughness parameter."""
    generator = np.random.default_rng([number, 6])
    rms = law.rms_height_m
    r = law.longest_wavelength_m * 10 ** generator.uniform(-3, 1, 20)
    angle = generator.uniform(0, 2 * math.pi, 20)
    x, y = np.append(r * np.cos(angle), 0.0), np.append(r * np.sin(angle), 0.0)
    phases, a = _phases(law, x, y), _amplitudes(law)
    covariance = (0.5 * a**2) @ np.cos(phases)
    structure = (2 * a**2) @ np.sin(0.5 * phases) ** 2
    turned = 32 * EPS * (1 + np.abs(phases).max(axis=0))  # what the rounding of the phases turns a cosine by
    met = {
        "the covariance": (np.max(np.abs(law(x, y) / rms**2 - covariance) / turned), 1.0),
        "the structure function": (np.max(np.abs(law.structure_function(x, y) / rms**2 - structure) / turned), 1.0),
        "the variance": (abs(law(0.0) / rms**2 - 1), 1e-12),
    }
    met |= _roughness(law) | _length(law) | _heights(law, grid, generator) | _distribution(law, generator)
    return verdict_of(met)


def _roughness(law: WeierstrassMandelbrot) -> dict[str, tuple[float, float]]:
    """The roughness parameter there and back, or refused where no double holds it."""
    longest = math.log2(law.longest_wavelength_m)
    scale = 0.5 * math.log2(law.azimuths / math.log(law.gamma)) + math.log2(
        law.rms_height_m * float(_amplitudes(law)[0])
    )
    digits = abs(longest + (scale - longest) / (1 - law.hurst))
    try:
        back = rms_height(law.roughness_parameter_m, law)
    except IllPosedError as error:
        return {"no roughness parameter": (990.0 if advised(error) else math.inf, digits)}
    return {"the roughness parameter": (abs(back / law.rms_height_m - 1), 1e-9)}


def _length(law: WeierstrassMandelbrot) -> dict[str, tuple[float, float]]:
    try:
        length = law.correlation_length()
    except ParameterError as error:
        octaves = math.log2(law.longest_wavelength_m / law.shortest_wavelength_m)
        return {"refused where the band is narrow": (WIDE_BAND if advised(error) else math.inf, octaves)}
    except IllPosedError:
        steps = np.linspace(0.0, law.longest_wavelength_m, 400)
        stays = ((0.5 * _amplitudes(law) ** 2) @ np.cos(_phases(law, steps, 0 * steps))).min() > math.exp(-1)
        return {"no length where it stays above 1/e": (float(not stays), 0)}
    before = np.linspace(0.0, length, 200)
    r = (0.5 * _amplitudes(law) ** 2) @ np.cos(_phases(law, before, 0 * before))
    return {
        "1/e at the length": (abs(r[-1] - math.exp(-1)), 1e-9),
        "not before": (math.exp(-1) - r[:-1].min(), 1e-9),
    }


def _heights(law: WeierstrassMandelbrot, grid: Grid, generator: np.random.Generator) -> dict[str, tuple[float, float]]:
    longest = 2 * math.pi * float(law.frequencies[-1])
    alpha = math.pi * np.arange(law.azimuths) / law.azimuths
    steps = [
        longest * d * float(np.abs(part).max())
        for n, d, part in ((grid.nx, grid.dx, np.cos(alpha)), (grid.ny, grid.dy, np.sin(alpha)))
        if n > 1
    ]
    aliases = max(steps, default=0.0) / math.pi
    try:
        waves = plane_waves(law, grid)
    except RoughslipError as error:
        right = aliases > 1 - ALIAS and advised(error)
        return {"refused where a wave aliases": (float(not right), 0)}
    xi = generator.standard_normal(law.variables)
    found = waves.heights(xi) / law.rms_height_m
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    phases = _phases(law, x, y)
    exact = _amplitudes(law) @ np.cos(phases + (2 * np.longdouble(np.pi) * ndtr(xi))[:, None])
    allowed = 32 * EPS * float(_amplitudes(law).sum()) * (1 + float(np.abs(phases).max()))
    return {
        "aliased waves": (aliases, 1 + ALIAS),
        "the heights": (np.abs(found.ravel() - exact).max(), allowed),
    }


def _distribution(law: WeierstrassMandelbrot, generator: np.random.Generator) -> dict[str, tuple[float, float]]:
    """Variance from the distribution function, kurtosis, and quantiles there and back."""
    marginal, a, rms = law.marginal(), _amplitudes(law), law.rms_height_m
    met = {
        "its excess kurtosis": (abs(marginal.excess_kurtosis + 1.5 * float(np.sum(a**4) / np.sum(a**2) ** 2)), 1e-10),
        "its rms height": (abs(marginal.rms_height_m / rms - 1), 1e-12),
    }
    if truncation(law, FEW_TERMS) > 1e-12:  # a long series: every height would cost milliseconds
        height = rms * float(generator.uniform(0, 1.4))
        both = marginal.cdf(np.array([height, -height]))
        return met | {"symmetric": (abs(both.sum() - 1), 1e-11)}
    p = np.array([1e-6, float(generator.uniform(0.01, 0.99)), 0.5])
    z = marginal.quantile(p)
    heights = np.linspace(-1, 1, 401) * marginal.bound
    f = marginal.cdf(heights)
    by_parts = 2 * np.abs(heights) * np.where(heights > 0, 1 - f, f)
    variance, coarse = (np.trapezoid(by_parts[::s], heights[::s]) / rms**2 for s in (1, 2))
    return met | {
        "the probability of a quantile": (np.max(np.abs(marginal.cdf(z) - p)), 1e-11),
        "the median": (abs(z[2]) / rms, 1e-9),
        "ascending": (np.max(-np.diff(f)), 1e-11),
        "the variance of the distribution": (abs(variance - 1), 4 * abs(variance - coarse) + 1e-8),
    }
