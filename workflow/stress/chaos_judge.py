"""The judge of expansions: their polynomials evaluated anew at fresh points, beside the function itself.

What K independent samples cannot have seen is not asked for: whatever happens with a probability of 1 - RISK^(1/K) at
most, they miss with a probability of RISK. So the worst points of that share are left out of the mean square error.

What is told, the larger of the corrected leave-one-out error and the error bound, is an estimate from N - A degrees of
freedom, at N points with A terms: of normal residuals it is that many times too low with a probability of RISK,
(N - A) over the RISK quantile of chi-squared. TWICE that is allowed, as residuals of bent functions are not normal.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import chi2

from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.regression import Fit
from roughslip.chaos.sensitivity import Sensitivity
from workflow.stress.chaos_problem import Problem, product_terms
from workflow.stress.outcomes import Verdict

FRESH = 4000
RISK = 1e-6
TWICE = 2.0
SAME_POINT = 1e-5  # samples that differ by no more in any variable are one to the judge
ROUNDING = 1e-13  # of the largest target: what a sum of some hundred terms may lose
WILD = 10.0  # times the error of the mean of the samples
REFITTED, SOUND = 80, 1e3  # samples and condition up to which leave-one-out is done again by refits
WELL_SEEN, ENOUGH = 0.3, 4  # least eigenvalue, samples a term, with which an expansion must not be refused
NO_ONE_ALONE = 0.5  # leverage: unless a sample of more tells a coefficient alone


def judge(problem: Problem, fit: Fit) -> Verdict:
    """Whether an expansion is as good as it says; the residual is its error over the largest that it allows."""
    points = problem.fresh(np.random.default_rng([problem.number, 2]), FRESH)
    terms = product_terms(problem.indices, points)
    own, truth = terms @ fit.coefficients, problem.truth(points)
    if not np.isfinite(own).all():
        return Verdict(math.inf, ("values are not finite",))
    weights = np.ones(len(problem.target)) if problem.weights is None else problem.weights
    mean = np.average(problem.target, weights=weights)
    variance = float(np.average((problem.target - mean) ** 2, weights=weights))
    rounding = ROUNDING * float(np.max(np.abs(problem.target)))
    count = distinct(problem.points)
    squares = (own - truth) ** 2
    error = seen_error(squares, count) + problem.noise**2
    allowed = beyond(count - len(terms.T)) * told(fit) * variance + rounding**2
    by_the_mean = float(np.mean((mean - truth) ** 2)) + problem.noise**2
    whole = float(squares.mean()) + problem.noise**2
    met = {
        "the error at fresh points": (error, allowed),
        "the error beside that of the mean": (whole, max(WILD * (by_the_mean + variance), allowed)),
        "values are those of the coefficients": (
            np.max(np.abs(hermite_basis(points, problem.indices) @ fit.coefficients - own)),
            ROUNDING * np.max(np.abs(terms) @ np.abs(fit.coefficients)),
        ),
        "figures are not negative": (-min(fit.leave_one_out, fit.least_eigenvalue), 0),
        "r_squared": (fit.r_squared, 1.0),
        "leave-one-out, from the residuals": (1.0 - fit.r_squared, fit.leave_one_out * (1 + 1e-9) + 1e-12),
    }
    if count == len(problem.target) <= REFITTED and problem.weights is None and _sound(problem):
        refitted = _by_refits(problem)
        lost = 2 * math.sqrt(refitted) * rounding + rounding**2  # (e + d)^2 - e^2 of residuals e that lose d
        met["leave-one-out, by refits"] = (abs(fit.leave_one_out * variance - refitted), 1e-6 * refitted + lost)
    broken = [f"{name}: {value:.3e} for {limit:.3e}" for name, (value, limit) in met.items() if not value <= limit]
    return Verdict(error / allowed, tuple(broken))


def _sound(problem: Problem) -> bool:
    """Whether the fit without any one sample is known to some digits."""
    terms = product_terms(problem.indices, problem.points)
    leverage = np.sum(np.linalg.qr(terms)[0] ** 2, axis=1)
    return bool(np.linalg.cond(terms) < SOUND and leverage.max() < 1 - 1 / SOUND)


def _by_refits(problem: Problem) -> float:
    """Mean square of the target less its prediction from all other samples, one fit each."""
    terms, target = product_terms(problem.indices, problem.points), problem.target
    squares = []
    for k in range(len(target)):
        others = np.arange(len(target)) != k
        without = np.linalg.lstsq(terms[others], target[others], rcond=None)[0]
        squares.append(float(target[k] - terms[k] @ without) ** 2)
    return float(np.mean(squares))


def told(fit: Fit) -> float:
    """Share of the variance of the target that an expansion says it misses."""
    return max(fit.corrected_leave_one_out, fit.error_bound)


def distinct(points: np.ndarray) -> int:
    """Points among the samples : (K, v)."""
    return len(np.unique(np.round(points / SAME_POINT), axis=0))


def well_posed(problem: Problem) -> bool:
    """Whether a problem can be solved beyond doubt: then no error answers it."""
    count, terms = distinct(problem.points), len(problem.indices)
    exact = problem.target - problem.target.mean()
    varies = np.max(np.abs(exact)) > 1e-9 * np.max(np.abs(problem.target))
    if problem.weights is not None or not varies or count < max(ENOUGH * terms, 40):
        return False
    values = product_terms(problem.indices, problem.points)
    if count < len(problem.points):
        values = values[np.unique(np.round(problem.points / SAME_POINT), axis=0, return_index=True)[1]]
    leverage = np.sum(np.linalg.qr(values)[0] ** 2, axis=1)
    seen = np.linalg.eigvalsh(values.T @ values / len(values))[0] > WELL_SEEN
    return bool(seen and leverage.max() < NO_ONE_ALONE)


def judge_shares(problem: Problem, fit: Fit, shares: Sensitivity) -> tuple[str, ...]:
    """What is wrong with moments and Sobol' indices: by sums over the terms, variable by variable."""
    indices, c = problem.indices, fit.coefficients
    constant = ~indices.any(axis=1)
    squares = np.where(constant, 0.0, (c / np.max(np.abs(c))) ** 2)
    alone = (indices > 0).sum(axis=1) == 1
    first = np.array([squares[alone & (powers > 0)].sum() for powers in indices.T]) / squares.sum()
    total = np.array([squares[powers > 0].sum() for powers in indices.T]) / squares.sum()
    met = {
        "the mean": abs(shares.mean - c[constant].sum()) <= ROUNDING * np.max(np.abs(c)),
        "the variance": abs(shares.variance / (squares.sum() * np.max(np.abs(c)) ** 2) - 1) <= ROUNDING,
        "first": np.allclose(shares.first, first, rtol=0, atol=ROUNDING),
        "total": np.allclose(shares.total, total, rtol=0, atol=ROUNDING),
        "0 <= first <= total <= 1": bool(
            np.all((shares.first >= 0) & (shares.first <= shares.total + ROUNDING) & (shares.total <= 1 + ROUNDING))
        ),
    }
    return tuple(f"Sobol' indices: {name}" for name, right in met.items() if not right)


def seen_error(squares: np.ndarray, count: int) -> float:
    """Mean of squared errors : (n,) without the worst ones that so many samples cannot have seen."""
    kept = math.ceil(RISK ** (1 / count) * len(squares))
    return float(np.sort(squares)[:kept].sum()) / len(squares)


def beyond(freedom: int) -> float:
    """By how much an error estimated from so many degrees of freedom may be too low."""
    return TWICE * freedom / float(chi2.ppf(RISK, freedom)) if freedom > 0 else math.inf
