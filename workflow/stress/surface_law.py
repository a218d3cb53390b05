"""Random laws of heights: translations to other marginals, with their correlation, and waves of random phase.

The judge: scipy's distributions, double integrals over two normal variables, sums of cosines in long doubles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import ndtr

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, RoughslipError
from roughslip.grid import Grid
from roughslip.surface.fractal import WeierstrassMandelbrot, plane_waves, rms_height
from roughslip.surface.marginal import Marginal, from_moments
from roughslip.surface.translation import Translation, corrected_correlation, nearest_correlation, translate
from workflow.benchmarks.measure import case
from workflow.stress.drawing import one_of, power
from workflow.stress.outcomes import Verdict, advised, verdict_of
from workflow.stress.pairs import left_out, pair_correlation

EPS = float(np.finfo(float).eps)
KINDS = ("translation", "torus", "waves")
FAMILIES = ("gaussian", "beta", "weibull", "lognormal")
SCORES = np.linspace(-5.0, 5.0, 41)
LEFT_OUT, HERMITE_TERMS = 1e-4, 120
ALIAS = 1e-9  # about the limit of a wave that a mesh carries
WIDE_BAND = 17.0  # octaves, up to which a 1/e length is found
ALL_TERMS, FEW_TERMS = 2.0**20, 2.0**12  # of the series of a distribution


@dataclass(frozen=True)
class Problem:
    """One law of heights. number, kind : which one, of KINDS; marginal or waves, on the mesh : what is judged."""

    number: int
    kind: str
    marginal: Marginal
    waves: WeierstrassMandelbrot
    grid: Grid


def random_problem(seed: int, number: int) -> Problem:
    """The problem of this number."""
    generator = np.random.default_rng([seed, number])
    kind = one_of(generator, KINDS, (0.4, 0.2, 0.4))
    longest = power(generator, -12, 3)
    count, gamma = int(generator.integers(1, 16)), 1.0 + power(generator, -2, 1)
    waves = WeierstrassMandelbrot(
        one_of(generator, (1e-3, 0.5, 0.999, float(generator.uniform(0.01, 0.99)))),
        power(generator, -12, 3),
        longest,
        longest / gamma ** (count - 1),
        one_of(generator, (1, 2, int(generator.integers(1, 20)))),
        gamma,
    )
    nx, ny = (round(24 ** generator.random()) for _ in range(2))
    cell = waves.shortest_wavelength_m * power(generator, -2, 0.3)
    grid = Grid(nx, ny, cell, cell * power(generator, -0.5, 0.5))
    return Problem(number, kind, _marginal(generator), waves, grid)


def _marginal(generator: np.random.Generator) -> Marginal:
    family = one_of(generator, FAMILIES, (0.1, 0.4, 0.25, 0.25))
    extreme = generator.random() < 0.2
    shapes: tuple[float, ...] = ()
    if family == "beta":
        shapes = tuple(power(generator, -1.6, 4) if extreme else power(generator, -0.3, 1.5) for _ in range(2))
    elif family == "weibull":
        shapes = (power(generator, math.log10(0.2), math.log10(50.0)),)
    elif family == "lognormal":
        shapes = (power(generator, math.log10(0.02), math.log10(1.5)),)
    return Marginal(family, power(generator, -12, 3), shapes, bool(generator.random() < 0.5))


def case_of(problem: Problem) -> str:
    if problem.kind == "waves":
        law = problem.waves
        told = {
            "azimuths": law.azimuths,
            "waves": law.variables,
            "gamma": f"{law.gamma:.4g}",
            "hurst": f"{law.hurst:.3g}",
            "longest": f"{law.longest_wavelength_m:.3g}",
            "rms": f"{law.rms_height_m:.3g}",
        }
    else:
        law_ = problem.marginal
        told = {
            "kernel": law_.family,
            "shapes": ",".join(f"{shape:.4g}" for shape in law_.shapes) or "none",
            "mirrored": law_.mirrored,
            "rms": f"{law_.rms_height_m:.3g}",
        }
    return case(number=problem.number, entry=problem.kind, **told, tolerance=1)


def judged(problem: Problem) -> Verdict:
    """The law taken through everything that it offers."""
    if problem.kind == "waves":
        return judge_waves(problem)
    translation = translate(problem.marginal)
    if problem.kind == "torus":
        return judge_torus(problem, translation)
    return judge_translation(problem, translation)


def honest(problem: Problem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: a series that the judge cannot sum either."""
    if not advised(error):
        return False
    if problem.kind == "waves":
        return isinstance(error, ConvergenceError) and truncation(problem.waves) > 1e-12
    return isinstance(error, IllPosedError) and left_out(problem.marginal.from_gaussian, HERMITE_TERMS) > 0.5 * LEFT_OUT


# Translation.


def frozen(marginal: Marginal) -> stats.distributions.rv_frozen:
    """The plain law, of scipy."""
    match marginal.family:
        case "beta":
            return stats.beta(*marginal.shapes)
        case "weibull":
            return stats.weibull_min(*marginal.shapes)
        case "lognormal":
            return stats.lognorm(*marginal.shapes)
        case _:
            return stats.norm()


def judge_translation(problem: Problem, translation: Translation) -> Verdict:
    """Quantiles there and back, moments, the table, and the correlation there and back."""
    marginal, generator = problem.marginal, np.random.default_rng([problem.number, 4])
    law, sign = frozen(marginal), -1.0 if marginal.mirrored else 1.0
    rms, mean, std = marginal.rms_height_m, float(law.mean()), float(law.std())
    p = ndtr(SCORES)
    z = marginal.quantile(p) / rms
    if not np.isfinite(z).all():
        return Verdict(math.inf, ("quantiles are not finite",))
    # a height is rounded beside the mean that it has lost
    moved = 8 * EPS * (np.abs(z) + mean / std)
    ends = np.stack([law.cdf(mean + std * sign * (z + step)) for step in (-moved, moved)])
    ends = 1.0 - ends if marginal.mirrored else ends
    back = marginal.cdf(rms * z)
    skewness, excess = (float(m) for m in law.stats("sk"))
    low, high = ends.min(axis=0) - 1e-11, ends.max(axis=0) + 1e-11
    rho = generator.uniform(-1, 1, 3) ** 3
    rho[2] = 1 - 0.1 * abs(rho[2])
    exact, error = pair_correlation(lambda g: marginal.from_gaussian(g) / rms, rho)
    told = translation.correlation(rho)
    series = 2 * abs(translation.left_out) + HERMITE_TERMS * translation.quadrature_error + 1e-9
    inside = generator.uniform(-6, 6, 50)
    wanted = np.append(generator.uniform(max(translation.least_correlation, -1), 1, 4), [0.0, 1.0])
    inverse = translation.correlation(translation.gaussian_correlation(wanted))
    off = np.abs(translation.apply(inside) - marginal.from_gaussian(inside))
    met = {
        "the probability of a quantile, from below": (np.max(low - p), 1e-13),
        "the probability of a quantile, from above": (np.max(p - high), 1e-13),
        "the quantile of a probability": (np.max(np.maximum(low - back, back - high)), 1e-13),
        "ascending": (np.max(-np.diff(z)), 0),
        "skewness": (abs(marginal.skewness - sign * skewness), 1e-6 * (1 + abs(skewness))),
        "excess kurtosis": (abs(marginal.excess_kurtosis - excess), 1e-5 * (1 + abs(excess))),
        "heights of the table": (np.max(off), translation.table_error_m * (1 + 1e-9) + 1e-13 * np.max(np.abs(z)) * rms),
        "the correlation": (np.max(np.abs(told - exact)), series + error),
        "the correlation there and back": (np.max(np.abs(inverse - wanted)), 1e-11),
        "the least correlation": (np.max(translation.least_correlation - told), 1e-12),
    }
    met |= _refitted(marginal)
    return verdict_of(met)


def _refitted(marginal: Marginal) -> dict[str, tuple[float, float]]:
    """The law of the moments of a law is that law, where they tell it."""
    if marginal.family == "gaussian" or (
        marginal.family == "beta" and not 0.1 < min(marginal.shapes) <= max(marginal.shapes) < 100
    ):
        return {}
    if marginal.family == "weibull" and abs(marginal.skewness) < 0.01:
        return {}
    try:
        again = from_moments(marginal.family, marginal.rms_height_m, marginal.skewness, marginal.excess_kurtosis)
    except IllPosedError:  # a Weibull law of the skewness of the other side, a shape at its limit
        return {}
    scores = np.array([-2.0, -0.5, 0.3, 1.7])
    off = np.abs(again.from_gaussian(scores) - marginal.from_gaussian(scores)) / marginal.rms_height_m
    other = marginal.family == "weibull" and marginal.mirrored != again.mirrored
    return {} if other else {"the law of its moments": (np.max(off), 1e-6)}


def judge_torus(problem: Problem, translation: Translation) -> Verdict:
    """The nearest correlation on a torus, and that it is refused where it is not the one wanted, there alone."""
    generator = np.random.default_rng([problem.number, 5])
    shape = tuple(2 * round(20 ** generator.random()) for _ in range(int(generator.integers(1, 3))))
    axes = [np.minimum(np.arange(n), n - np.arange(n)) / (0.5 * n) for n in shape]
    r = np.sqrt(sum(axis**2 for axis in np.meshgrid(*axes, indexing="ij", sparse=True))) * power(generator, -0.5, 1.5)
    wanted = one_of(
        generator, (np.exp(-r), np.exp(-(r**2)), np.exp(-r) * np.cos(3 * r), np.where(r > 0, 0.0, 1.0), np.cos(r))
    )
    found = nearest_correlation(translation, wanted)
    spectrum = np.fft.fftn(found.gaussian).real
    translated = np.polynomial.Polynomial(np.concatenate(([0.0], translation.shares)))(found.gaussian)
    least = translation.least_correlation
    short = least - wanted.min()
    met = {
        "no negative spectrum": (-spectrum.min() / spectrum.max(), 1e-13 * wanted.size),
        "lag zero": (abs(found.gaussian.flat[0] - 1), 1e-12),
        "its correlation": (np.abs(found.translated - translated).max(), 1e-12),
        "its deviation": (abs(found.deviation - np.abs(translated - wanted).max()), 1e-12),
        "below the least": (abs(found.below_least - (short if found.below_least else 0.0)), 1e-12),
        "told as below the least": (short if not found.below_least else 0.0, translation.least_error + 1e-12),
    }
    possible = found.negative_share <= 1e-6 and found.below_least == 0.0
    if possible and found.negative_share < 1e-12:
        met["what can be had"] = (found.deviation, 1e-9)
    try:
        corrected_correlation(translation, wanted)
        refused = False
    except IllPosedError:
        refused = True
    met["refused where it cannot be had"] = (float(refused == possible), 0)
    return verdict_of(met)


# Waves.


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


def judge_waves(problem: Problem) -> Verdict:
    """Covariance, structure function, heights on the mesh, the law of a height, lengths and the roughness parameter."""
    law, grid, generator = problem.waves, problem.grid, np.random.default_rng([problem.number, 6])
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
