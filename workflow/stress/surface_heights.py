"""Random height distributions: translations of Gaussian fields to them, with their correlation.

The judge uses scipy's distributions and double integrals over two normal variables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import ndtr

from roughslip.errors import IllPosedError, RoughslipError
from roughslip.probability import FamilyDistribution, Translation, translate
from roughslip.surface.corrected_covariance import corrected_correlation, nearest_correlation
from workflow.stress.kernels import left_out, pair_correlation
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

EPS = float(np.finfo(float).eps)
KINDS = ("translation", "torus")
FAMILIES = ("gaussian", "beta", "weibull", "lognormal")
SCORES = np.linspace(-5.0, 5.0, 41)
LEFT_OUT, HERMITE_TERMS = 1e-4, 120


@dataclass(frozen=True)
class HeightProblem:
    """A distribution of heights to translate to.

    number, kind : of the problem, of KINDS
    marginal : the distribution
    """

    number: int
    kind: str
    marginal: FamilyDistribution


def random_problem(seed: int, number: int) -> HeightProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    return HeightProblem(number, choose(generator, KINDS, (0.65, 0.35)), _marginal(generator))


def _marginal(generator: np.random.Generator) -> FamilyDistribution:
    family = choose(generator, FAMILIES, (0.1, 0.4, 0.25, 0.25))
    extreme = generator.random() < 0.2
    shapes: tuple[float, ...] = ()
    if family == "beta":
        shapes = tuple(
            log_uniform(generator, -1.6, 4) if extreme else log_uniform(generator, -0.3, 1.5) for _ in range(2)
        )
    elif family == "weibull":
        shapes = (log_uniform(generator, math.log10(0.2), math.log10(50.0)),)
    elif family == "lognormal":
        shapes = (log_uniform(generator, math.log10(0.02), math.log10(1.5)),)
    return FamilyDistribution(family, log_uniform(generator, -12, 3), shapes, bool(generator.random() < 0.5))


def judged(problem: HeightProblem) -> Verdict:
    """Translate to the distribution and judge the translation."""
    translation = translate(problem.marginal)
    return (judge_torus if problem.kind == "torus" else judge_translation)(problem, translation)


def is_answer(problem: HeightProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: a series that the judge cannot sum either."""
    if not (isinstance(error, IllPosedError) and has_advice(error)):
        return False
    return left_out(problem.marginal.from_gaussian, HERMITE_TERMS) > 0.5 * LEFT_OUT


def frozen(marginal: FamilyDistribution) -> stats.distributions.rv_frozen:
    """Return scipy's distribution of the family."""
    match marginal.family:
        case "beta":
            return stats.beta(*marginal.shapes)
        case "weibull":
            return stats.weibull_min(*marginal.shapes)
        case "lognormal":
            return stats.lognorm(*marginal.shapes)
        case _:
            return stats.norm()


def judge_translation(problem: HeightProblem, translation: Translation) -> Verdict:
    """Return the verdict on quantiles, moments, the table, and the correlation, with their inverses."""
    marginal, generator = problem.marginal, np.random.default_rng([problem.number, 4])
    law, sign = frozen(marginal), -1.0 if marginal.mirrored else 1.0
    rms, mean, std = marginal.standard_deviation, float(law.mean()), float(law.std())
    p = ndtr(SCORES)
    z = marginal.quantile(p) / rms
    if not np.isfinite(z).all():
        return Verdict(math.inf, ("quantiles are not finite",))
    # A height loses digits to the mean that was subtracted.
    moved = 8 * EPS * (np.abs(z) + mean / std)
    ends = np.stack([law.cdf(mean + std * sign * (z + step)) for step in (-moved, moved)])
    ends = 1.0 - ends if marginal.mirrored else ends
    back = marginal.cdf(rms * z)
    skewness, excess = (float(m) for m in law.stats("sk"))
    low, high = ends.min(axis=0) - 1e-11, ends.max(axis=0) + 1e-11
    rho = generator.uniform(-1, 1, 3) ** 3
    rho[2] = 1 - 0.1 * abs(rho[2])
    exact, error = pair_correlation(lambda g: marginal.from_gaussian(g) / rms, rho)
    found = translation.correlation(rho)
    series = 2 * abs(translation.left_out) + HERMITE_TERMS * translation.quadrature_error + 1e-9
    inside = generator.uniform(-6, 6, 50)
    wanted = np.append(generator.uniform(max(translation.least_correlation, -1), 1, 4), [0.0, 1.0])
    inverse = translation.correlation(translation.gaussian_correlation(wanted))
    off = np.abs(translation.apply(inside) - marginal.from_gaussian(inside))
    conditions: Conditions = {
        "the probability of a quantile, from below": (np.max(low - p), 1e-13),
        "the probability of a quantile, from above": (np.max(p - high), 1e-13),
        "the quantile of a probability": (np.max(np.maximum(low - back, back - high)), 1e-13),
        "ascending": (np.max(-np.diff(z)), 0),
        "skewness": (abs(marginal.skewness - sign * skewness), 1e-6 * (1 + abs(skewness))),
        "excess kurtosis": (abs(marginal.excess_kurtosis - excess), 1e-5 * (1 + abs(excess))),
        "heights of the table": (np.max(off), translation.table_error * (1 + 1e-9) + 1e-13 * np.max(np.abs(z)) * rms),
        "the correlation": (np.max(np.abs(found - exact)), series + error),
        "the correlation there and back": (np.max(np.abs(inverse - wanted)), 1e-11),
        "the least correlation": (np.max(translation.least_correlation - found), 1e-12),
    }
    return verdict_of(conditions)


def judge_torus(problem: HeightProblem, translation: Translation) -> Verdict:
    """Return the verdict on the nearest correlation on a torus, which is refused only where it differs."""
    generator = np.random.default_rng([problem.number, 5])
    shape = tuple(2 * round(20 ** generator.random()) for _ in range(int(generator.integers(1, 3))))
    axes = [np.minimum(np.arange(n), n - np.arange(n)) / (0.5 * n) for n in shape]
    r = np.sqrt(sum(axis**2 for axis in np.meshgrid(*axes, indexing="ij", sparse=True))) * log_uniform(
        generator, -0.5, 1.5
    )
    wanted = choose(
        generator, (np.exp(-r), np.exp(-(r**2)), np.exp(-r) * np.cos(3 * r), np.where(r > 0, 0.0, 1.0), np.cos(r))
    )
    found = nearest_correlation(translation, wanted)
    spectrum = np.fft.fftn(found.gaussian).real
    translated = np.polynomial.Polynomial(np.concatenate(([0.0], translation.shares)))(found.gaussian)
    least = translation.least_correlation
    short = least - wanted.min()
    conditions: Conditions = {
        "no negative spectrum": (-spectrum.min() / spectrum.max(), 1e-13 * wanted.size),
        "lag zero": (abs(found.gaussian.flat[0] - 1), 1e-12),
        "its correlation": (np.abs(found.translated - translated).max(), 1e-12),
        "its deviation": (abs(found.deviation - np.abs(translated - wanted).max()), 1e-12),
        "below the least": (abs(found.below_least - (short if found.below_least else 0.0)), 1e-12),
        "stated as below the least": (short if not found.below_least else 0.0, translation.least_error + 1e-12),
    }
    possible = found.negative_share <= 1e-6 and found.below_least == 0.0
    if possible and found.negative_share < 1e-12:
        conditions["what can be had"] = (found.deviation, 1e-9)
    try:
        corrected_correlation(translation, wanted)
        refused = False
    except IllPosedError:
        refused = True
    conditions["refused where it cannot be had"] = (float(refused == possible), 0)
    return verdict_of(conditions)
