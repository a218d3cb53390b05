"""Random tables of lags, and fits of a covariance to them.

Without errors the fit must return the model where the lags determine it. In all problems the answer must be a minimum
of the squares, which the judge computes from kernels of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import ConvergenceError, IllPosedError, RoughslipError
from roughslip.scan.covariance_fit import CovarianceFit, fit_covariance
from roughslip.scan.fit_data import Estimates, estimates
from roughslip.surface.covariance import Covariance
from roughslip.surface.models import KINDS, Matern, covariance_of
from workflow.stress.kernels import correlation
from workflow.stress.runner import Verdict, choose, has_advice, log_uniform, verdict_of

SOURCES = ("exact", "noise", "nonsense")
SOURCE_SHARES = (0.45, 0.45, 0.1)
STEPS = (-0.02, 0.02)  # of a logarithm or a radian
STATIONARY = 1e-5  # of the squares, by which a step may lower them


@dataclass(frozen=True)
class FitProblem:
    """A table of lags to fit a covariance to.

    number, source : of the problem, of SOURCES
    kind : of the fitted model
    truth : the covariance that the table comes from
    data : the table
    anisotropic, cutoff_wavelength_m : of the fit
    """

    number: int
    source: str
    kind: str
    truth: Covariance
    data: Estimates
    anisotropic: bool
    cutoff_wavelength_m: float | None


def random_problem(seed: int, number: int) -> FitProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    source = choose(generator, SOURCES, SOURCE_SHARES)
    kind = choose(generator, KINDS, (0.3, 0.25, 0.2, 0.15, 0.1))
    of_truth = kind if source == "exact" or generator.random() < 0.6 else "gaussian"
    unit, anisotropic = log_uniform(generator, -12, 3), bool(generator.random() < 0.6)
    steps = tuple(int(n) for n in generator.integers(3, 9, 2)) if generator.random() < 0.9 else (0, 6)
    length = log_uniform(generator, -0.3, 0.8)
    across = length * log_uniform(generator, -0.4, 0.4) if anisotropic else length
    lay = float(generator.uniform(-1.5, 1.5)) if anisotropic and of_truth != "separable_exponential" else 0.0
    truth = covariance_of(
        of_truth,
        log_uniform(generator, -12, 3),
        unit * length,
        unit * across,
        lay,
        smoothness=log_uniform(generator, -0.7, 0.7) if of_truth == "matern" else None,
        hurst=float(generator.uniform(0.2, 0.9)) if of_truth == "self_affine" else None,
        bandwidth=log_uniform(generator, 0.4, 1.5) if of_truth == "self_affine" else None,
    )
    cutoff = None
    if kind == "self_affine":
        cutoff = math.sqrt(math.prod(truth.cutoff_wavelengths_m)) if of_truth == kind else 2 * unit
    x, y = (np.arange(-n, n + 1) * unit for n in steps)
    r = correlation(truth, x[:, None], y[None, :])
    level = log_uniform(generator, -4, -1)
    if source == "noise":
        noise = level * generator.standard_normal(r.shape)
        r = r + (noise + noise[::-1, ::-1]) / math.sqrt(2)
    elif source == "nonsense":
        r = generator.uniform(-1, 1, r.shape)
    data = estimates(x[:, None], y[None, :], r, np.full(r.shape, level))
    return FitProblem(number, source, kind, truth, data, anisotropic, cutoff)


def judged(problem: FitProblem) -> Verdict:
    """Fit the covariance and judge the fit."""
    truth = problem.truth
    found = fit_covariance(
        problem.kind,
        problem.data,
        truth.rms_height_m,
        anisotropic=problem.anisotropic,
        cutoff_wavelength_m=problem.cutoff_wavelength_m,
    )
    numbers = [*found.parameters.values(), found.misfit, found.criterion, found.effective_lags]
    if not np.isfinite(numbers).all() or np.isnan([*found.standard_errors.values()]).any():
        return Verdict(math.inf, ("parameters are not finite",))
    data, least = problem.data, squares(problem.data, found.covariance)
    number = found.effective_lags
    others = [squares(data, near) for near in neighbours(found, problem)]
    misfit = math.sqrt(least / len(data.x))
    conditions = {
        "its misfit": (abs(found.misfit - misfit), 1e-6 * misfit + 1e-9),
        "its lags": (abs(found.lags - len(data.x)), 0),
        "effective lags": (number - len(data.x) * (1 + 1e-9), 0),
        "errors are not negative": (-min(found.standard_errors.values()), 0),
        "its criterion": (
            abs(found.criterion - number * misfit**2 - len(found.parameters) * math.log(number)),
            1e-6 * abs(found.criterion) + 1e-6,
        ),
        "fewer squares nearby": (least - min(others, default=math.inf), STATIONARY * least + 1e-9),
    }
    if is_determined(problem) and not found.at_bound:
        off = np.abs(correlation(found.covariance, data.x, data.y) - correlation(truth, data.x, data.y)).max()
        conditions["the model comes back"] = (off, 1e-5)
    return verdict_of(conditions)


def is_determined(problem: FitProblem) -> bool:
    """Whether the lags determine the model without error."""
    return problem.source == "exact" and problem.kind == problem.truth.kind


def squares(data: Estimates, model: Covariance) -> float:
    """Return the sum of the squared residuals of a model over the lags."""
    return float(np.sum(((correlation(model, data.x, data.y) - data.correlation) / data.standard_error) ** 2))


def neighbours(found: CovarianceFit, problem: FitProblem) -> list[Covariance]:
    """Return models a step away in each free parameter; no model if a parameter is at its bound."""
    model = found.covariance
    if found.at_bound or model.kind == "self_affine":  # Lengths, bandwidth and cut-off move together.
        return []
    along, across = model.lengths_m
    near = []
    for step in STEPS:
        factor = math.exp(step)
        if problem.anisotropic:
            near += [
                replace(model, correlation_length_m=along * factor, correlation_length_across_m=across),
                replace(model, correlation_length_across_m=across * factor),
            ]
            if model.kind != "separable_exponential":
                near.append(replace(model, lay_rad=model.lay_rad + step))
        else:
            near.append(replace(model, correlation_length_m=along * factor, correlation_length_across_m=None))
        if isinstance(model, Matern) and 0.05 < model.smoothness * factor < 20:
            near.append(replace(model, smoothness=model.smoothness * factor))
    return near


def is_answer(problem: FitProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: it has advice, and the lags do not determine the model."""
    typed = isinstance(error, IllPosedError | ConvergenceError) and has_advice(error)
    return typed and not (is_determined(problem) and has_useful_lags(problem))


def has_useful_lags(problem: FitProblem) -> bool:
    """Whether the table has enough lags both below and beyond the correlation lengths."""
    near = problem.data.correlation > 0.3
    short = min(problem.truth.lengths_m) > 1.5 * float(np.min(np.hypot(problem.data.x, problem.data.y)))
    return short and int(near.sum()) > 8 and float(problem.data.correlation.min()) < 0.2
