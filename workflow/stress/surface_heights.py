"""Random height distributions: translations of Gaussian fields, with their correlation, and waves of random phase.

The judge uses scipy's distributions, double integrals over two normal variables, and sums of cosines in long doubles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import ndtr

from roughslip.errors import IllPosedError, RoughslipError
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution, Translation, distribution_of_moments, translate
from roughslip.surface.corrected_covariance import corrected_correlation, nearest_correlation
from roughslip.surface.fractal import WeierstrassMandelbrot, plane_waves
from workflow.evidence.rows import case
from workflow.stress.kernels import left_out, pair_correlation
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

EPS = float(np.finfo(float).eps)
ALIAS = 1e-9  # about the limit of a wave that a mesh can represent
KINDS = ("translation", "torus", "waves")
FAMILIES = ("gaussian", "beta", "weibull", "lognormal")
SCORES = np.linspace(-5.0, 5.0, 41)
LEFT_OUT, HERMITE_TERMS = 1e-4, 120


@dataclass(frozen=True)
class HeightProblem:
    """A distribution of heights to translate to, or a sum of waves on a mesh.

    number, kind : of the problem, of KINDS
    marginal : the distribution of heights
    waves, grid : the sum of waves, and the mesh
    """

    number: int
    kind: str
    marginal: FamilyDistribution
    waves: WeierstrassMandelbrot
    grid: Grid


def random_problem(seed: int, number: int) -> HeightProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    kind = choose(generator, KINDS, (0.4, 0.2, 0.4))
    longest = log_uniform(generator, -12, 3)
    count, gamma = int(generator.integers(1, 16)), 1.0 + log_uniform(generator, -2, 1)
    waves = WeierstrassMandelbrot(
        choose(generator, (1e-3, 0.5, 0.999, float(generator.uniform(0.01, 0.99)))),
        log_uniform(generator, -12, 3),
        longest,
        longest / gamma ** (count - 1),
        choose(generator, (1, 2, int(generator.integers(1, 20)))),
        gamma,
    )
    nx, ny = (round(24 ** generator.random()) for _ in range(2))
    cell = waves.shortest_wavelength_m * log_uniform(generator, -2, 0.3)
    grid = Grid(nx, ny, cell, cell * log_uniform(generator, -0.5, 0.5))
    return HeightProblem(number, kind, _marginal(generator), waves, grid)


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


def case_of(problem: HeightProblem) -> str:
    if problem.kind == "waves":
        law = problem.waves
        labels = {
            "azimuths": law.azimuths,
            "waves": law.variables,
            "gamma": f"{law.gamma:.4g}",
            "hurst": f"{law.hurst:.3g}",
            "longest": f"{law.longest_wavelength_m:.3g}",
            "rms": f"{law.rms_height_m:.3g}",
        }
    else:
        law_ = problem.marginal
        labels = {
            "kernel": law_.family,
            "shapes": ",".join(f"{shape:.4g}" for shape in law_.shapes) or "none",
            "mirrored": law_.mirrored,
            "rms": f"{law_.standard_deviation:.3g}",
        }
    return case(number=problem.number, entry=problem.kind, **labels, tolerance=1)


def judged(problem: HeightProblem) -> Verdict:
    """Translate or sum the waves of a problem and judge the result."""
    if problem.kind == "waves":
        return judge_waves(problem.number, problem.waves, problem.grid)
    translation = translate(problem.marginal)
    if problem.kind == "torus":
        return judge_torus(problem, translation)
    return judge_translation(problem, translation)


def is_answer(problem: HeightProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: a series that the judge cannot sum either."""
    if problem.kind == "waves" or not (isinstance(error, IllPosedError) and has_advice(error)):
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
    conditions |= _refitted(marginal)
    return verdict_of(conditions)


def _refitted(marginal: FamilyDistribution) -> Conditions:
    """Return whether the moments of a distribution give it back, where they determine it."""
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
    except IllPosedError:  # a Weibull distribution of the opposite skewness, or a shape at its limit
        return {}
    scores = np.array([-2.0, -0.5, 0.3, 1.7])
    off = np.abs(again.from_gaussian(scores) - marginal.from_gaussian(scores)) / marginal.standard_deviation
    other = marginal.family == "weibull" and marginal.mirrored != again.mirrored
    return {} if other else {"the distribution of its moments": (np.max(off), 1e-6)}


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


def _phases(law: WeierstrassMandelbrot, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return phases k . r (waves, n) in long doubles, longest waves first."""
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
    """Return the verdict on covariance, structure function and heights of a sum of waves on a mesh."""
    generator = np.random.default_rng([number, 6])
    rms = law.rms_height_m
    r = law.longest_wavelength_m * 10 ** generator.uniform(-3, 1, 20)
    angle = generator.uniform(0, 2 * math.pi, 20)
    x, y = np.append(r * np.cos(angle), 0.0), np.append(r * np.sin(angle), 0.0)
    phases, a = _phases(law, x, y), _amplitudes(law)
    covariance = (0.5 * a**2) @ np.cos(phases)
    structure = (2 * a**2) @ np.sin(0.5 * phases) ** 2
    turned = 32 * EPS * (1 + np.abs(phases).max(axis=0))  # the rounding of phases
    conditions: Conditions = {
        "the covariance": (np.max(np.abs(law(x, y) / rms**2 - covariance) / turned), 1.0),
        "the structure function": (np.max(np.abs(law.structure_function(x, y) / rms**2 - structure) / turned), 1.0),
        "the variance": (abs(law(0.0) / rms**2 - 1), 1e-12),
    }
    return verdict_of(conditions | _heights(law, grid, generator))


def _heights(law: WeierstrassMandelbrot, grid: Grid, generator: np.random.Generator) -> Conditions:
    """Return conditions on heights on the mesh, or whether waves that alias are refused."""
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
        right = aliases > 1 - ALIAS and has_advice(error)
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
