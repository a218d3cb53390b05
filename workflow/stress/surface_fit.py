"""Random tables of lags, and fits of a covariance to them.

Without errors the fit must return the model where the lags determine it. In all problems the answer must be a minimum
of the squares: no step of a parameter may lower them.
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
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

SOURCES, SOURCE_SHARES = ("exact", "noise", "nonsense"), (0.45, 0.45, 0.1)
STEPS = (-0.02, 0.02)  # of a logarithm or a radian
STATIONARY = 1e-5  # of the squares, by which a step may lower them


@dataclass(frozen=True)
class FitProblem:
    """A table of lags to fit a covariance to.

    number, source : of the problem, of SOURCES
    kind : of the fitted model
    truth : the covariance that the table comes from
    data : the table
    cutoff_wavelength_m : of the fit
    """

    number: int
    source: str
    kind: str
    truth: Covariance
    data: Estimates
    cutoff_wavelength_m: float | None

    @property
    def is_determined(self) -> bool:
        """Whether the lags determine the model without error."""
        return self.source == "exact" and self.kind == self.truth.kind


def random_problem(seed: int, number: int) -> FitProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    source, kind = choose(generator, SOURCES, SOURCE_SHARES), choose(generator, KINDS)
    of_truth = kind if source == "exact" or generator.random() < 0.6 else "gaussian"
    unit, anisotropic = log_uniform(generator, -12, 3), bool(generator.random() < 0.6)
    steps = tuple(int(n) for n in generator.integers(3, 9, 2)) if generator.random() < 0.9 else (0, 6)
    length = log_uniform(generator, -0.3, 0.8)
    across = length * log_uniform(generator, -0.4, 0.4) if anisotropic else length
    lay = float(generator.uniform(-1.5, 1.5)) if anisotropic and of_truth != "separable_exponential" else 0.0
    shapes: dict[str, float] = {}
    if of_truth == "matern":
        shapes["smoothness"] = log_uniform(generator, -0.7, 0.7)
    elif of_truth == "self_affine":
        shapes |= {"hurst": float(generator.uniform(0.2, 0.9)), "bandwidth": log_uniform(generator, 0.4, 1.5)}
    truth = covariance_of(of_truth, log_uniform(generator, -12, 3), unit * length, unit * across, lay, **shapes)
    cutoff = None
    if kind == "self_affine":
        cutoff = math.sqrt(math.prod(truth.cutoff_wavelengths_m)) if of_truth == kind else 2 * unit
    x, y = (np.arange(-n, n + 1) * unit for n in steps)
    r = truth(x[:, None], y) / truth.rms_height_m**2
    level = log_uniform(generator, -4, -1)
    if source == "noise":
        noise = level * generator.standard_normal(r.shape)
        r = r + (noise + noise[::-1, ::-1]) / math.sqrt(2)
    elif source == "nonsense":
        r = generator.uniform(-1, 1, r.shape)
    data = estimates(x[:, None], y[None, :], r, np.full(r.shape, level))
    return FitProblem(number, source, kind, truth, data, cutoff)


def judged(problem: FitProblem) -> Verdict:
    """Fit the covariance and judge the fit."""
    data, truth = problem.data, problem.truth
    found = fit_covariance(problem.kind, data, truth.rms_height_m, cutoff_wavelength_m=problem.cutoff_wavelength_m)
    if not np.isfinite([*found.parameters.values(), found.misfit]).all():
        return Verdict(math.inf, ("parameters are not finite",))
    least = squares(data, found.covariance)
    nearby = min((squares(data, near) for near in neighbours(found)), default=math.inf)
    misfit = math.sqrt(least / len(data.x))
    conditions: Conditions = {
        "its misfit": (abs(found.misfit - misfit), 1e-6 * misfit + 1e-9),
        "errors are not negative": (-min(found.standard_errors.values()), 0),
        "fewer squares nearby": (least - nearby, STATIONARY * least + 1e-9),
    }
    if problem.is_determined and not found.at_bound:
        off = np.abs(correlation(found.covariance, data) - correlation(truth, data)).max()
        conditions["the model comes back"] = (off, 1e-5)
    return verdict_of(conditions)


def correlation(model: Covariance, data: Estimates) -> np.ndarray:
    """Return correlations [-] of a model at the lags."""
    return model(data.x, data.y) / model.rms_height_m**2


def squares(data: Estimates, model: Covariance) -> float:
    """Return the sum of the squared residuals of a model over the lags."""
    return float(np.sum(((correlation(model, data) - data.correlation) / data.standard_error) ** 2))


def neighbours(found: CovarianceFit) -> list[Covariance]:
    """Return models a step away in each free parameter; no model if a parameter is at its bound."""
    model = found.covariance
    if found.at_bound or model.kind == "self_affine":  # Lengths, bandwidth and cut-off move together.
        return []
    along, across = model.lengths_m
    near = []
    for step in STEPS:
        factor = math.exp(step)
        near += [
            replace(model, correlation_length_m=along * factor, correlation_length_across_m=across),
            replace(model, correlation_length_across_m=across * factor),
        ]
        if model.kind != "separable_exponential":
            near.append(replace(model, lay_rad=model.lay_rad + step))
        if isinstance(model, Matern) and 0.05 < model.smoothness * factor < 20:
            near.append(replace(model, smoothness=model.smoothness * factor))
    return near


def is_answer(problem: FitProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: it has advice, and the lags do not determine the model.

    They do with enough lags both below and beyond the correlation lengths.
    """
    data = problem.data
    short = min(problem.truth.lengths_m) > 1.5 * float(np.min(np.hypot(data.x, data.y)))
    enough = short and int((data.correlation > 0.3).sum()) > 8 and float(data.correlation.min()) < 0.2
    typed = isinstance(error, IllPosedError | ConvergenceError) and has_advice(error)
    return typed and not (problem.is_determined and enough)
