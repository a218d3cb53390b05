"""Random laws of heights: translations to other marginals, with their correlation, and waves of random phase.

The judge: scipy's distributions and double integrals over two normal variables; of waves that of surface_waves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import ndtr

from roughslip.errors import ConvergenceError, IllPosedError, RoughslipError
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution, Translation, distribution_of_moments, translate
from roughslip.surface.corrected_covariance import corrected_correlation, nearest_correlation
from roughslip.surface.fractal import WeierstrassMandelbrot
from workflow.benchmarks.measure import case
from workflow.stress.drawing import one_of, power
from workflow.stress.outcomes import Verdict, advised, verdict_of
from workflow.stress.pairs import left_out, pair_correlation
from workflow.stress.surface_waves import judge_waves, truncation

EPS = float(np.finfo(float).eps)
KINDS = ("translation", "torus", "waves")
FAMILIES = ("gaussian", "beta", "weibull", "lognormal")
SCORES = np.linspace(-5.0, 5.0, 41)
LEFT_OUT, HERMITE_TERMS = 1e-4, 120


@dataclass(frozen=True)
class Problem:
    """One law of heights. number, kind : which one, of KINDS; marginal or waves, on the mesh : what is judged."""

    number: int
    kind: str
    marginal: FamilyDistribution
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


def _marginal(generator: np.random.Generator) -> FamilyDistribution:
    family = one_of(generator, FAMILIES, (0.1, 0.4, 0.25, 0.25))
    extreme = generator.random() < 0.2
    shapes: tuple[float, ...] = ()
    if family == "beta":
        shapes = tuple(power(generator, -1.6, 4) if extreme else power(generator, -0.3, 1.5) for _ in range(2))
    elif family == "weibull":
        shapes = (power(generator, math.log10(0.2), math.log10(50.0)),)
    elif family == "lognormal":
        shapes = (power(generator, math.log10(0.02), math.log10(1.5)),)
    return FamilyDistribution(family, power(generator, -12, 3), shapes, bool(generator.random() < 0.5))


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
            "rms": f"{law_.standard_deviation:.3g}",
        }
    return case(number=problem.number, entry=problem.kind, **told, tolerance=1)


def judged(problem: Problem) -> Verdict:
    """The law taken through everything that it offers."""
    if problem.kind == "waves":
        return judge_waves(problem.number, problem.waves, problem.grid)
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


def frozen(marginal: FamilyDistribution) -> stats.distributions.rv_frozen:
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
    rms, mean, std = marginal.standard_deviation, float(law.mean()), float(law.std())
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
        "heights of the table": (np.max(off), translation.table_error * (1 + 1e-9) + 1e-13 * np.max(np.abs(z)) * rms),
        "the correlation": (np.max(np.abs(told - exact)), series + error),
        "the correlation there and back": (np.max(np.abs(inverse - wanted)), 1e-11),
        "the least correlation": (np.max(translation.least_correlation - told), 1e-12),
    }
    met |= _refitted(marginal)
    return verdict_of(met)


def _refitted(marginal: FamilyDistribution) -> dict[str, tuple[float, float]]:
    """The law of the moments of a law is that law, where they tell it."""
    if marginal.family == "gaussian" or (
        marginal.family == "beta" and not 0.1 < min(marginal.shapes) <= max(marginal.shapes) < 100
    ):
        return {}
    if marginal.family == "weibull" and abs(marginal.skewness) < 0.01:
        return {}
    try:
        again = distribution_of_moments(
            marginal.family, marginal.standard_deviation, marginal.skewness, marginal.excess_kurtosis
        )
    except IllPosedError:  # a Weibull law of the skewness of the other side, a shape at its limit
        return {}
    scores = np.array([-2.0, -0.5, 0.3, 1.7])
    off = np.abs(again.from_gaussian(scores) - marginal.from_gaussian(scores)) / marginal.standard_deviation
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
