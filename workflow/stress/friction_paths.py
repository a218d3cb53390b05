"""Random friction processes, and the judge of the covariance that their paths are drawn from, and of the paths.

The stationary state of a recursion must solve Lyapunov's equation. The covariance of a period is a sum of cosines. The
translation to the marginal distribution is a double integral. Over many seeds, the distribution of first nodes must be
within the band of Dvoretzky, Kiefer, Wolfowitz and Massart, and the correlation of normal scores within that of
Fisher's z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc, betaincinv, ndtr, ndtri

from roughslip.errors import IllPosedError, ParameterError, RoughslipError
from roughslip.friction.paths import METHODS, Paths, Spectrum, prepare
from roughslip.friction.process import FrictionProcess, Marginal, average_beta
from roughslip.friction.recursion import SPACINGS, Recursion
from roughslip.probability import BetaDistribution, QuantileDistribution
from workflow.stress.kernels import left_out, pair_correlation
from workflow.stress.runner import Conditions, Verdict, choose, has_advice, log_uniform, verdict_of

PATHS = 250
RISK_LOG = math.log(2e8)  # a risk of one in a hundred million for each comparison
SCORE_WIDTH = 5.7  # standard deviations: the same risk
MOST_NODES = 20_000  # of a period
LAGS = 6
SHORT = 300  # nodes of a path that the judge reads
WORST = 0.01  # error of the autocorrelation beyond which the package refuses paths
LEFT_OUT, HERMITE_TERMS = 1e-4, 200  # share of the variance beyond so many polynomials that the package refuses


@dataclass(frozen=True)
class PathProblem:
    """Paths of a friction process.

    number : of the problem
    method : of METHODS
    process, spacing, length : of the paths, [m]
    """

    number: int
    method: str
    process: FrictionProcess
    spacing: float
    length: float


def random_problem(seed: int, number: int) -> PathProblem:
    """Return the problem of this number."""
    generator = np.random.default_rng([seed, number])
    method = choose(generator, METHODS)
    correlation_length = log_uniform(generator, -12, 3)
    ratio = log_uniform(generator, -6, 1) if method == "recursion" else log_uniform(generator, -1.5, 1)
    if generator.random() < 0.05:
        ratio = choose(generator, SPACINGS)
    if method != "recursion":
        ratio = max(ratio, 0.03)
    nodes = round(SHORT ** generator.random()) + 0.5 * float(generator.random() < 0.5)
    spacing = ratio * correlation_length
    return PathProblem(
        number, method, FrictionProcess(_marginal(generator), correlation_length), spacing, max(nodes, 0.5) * spacing
    )


def _marginal(generator: np.random.Generator) -> Marginal:
    if generator.random() < 0.75:
        a, b = (log_uniform(generator, math.log10(0.3), math.log10(50)) for _ in range(2))
        width = log_uniform(generator, -9, 3) if generator.random() < 0.95 else 0.0
        lower = choose(generator, (0.0, width, -width, 1.0))
        if generator.random() < 0.2:
            return BetaDistribution(*average_beta(a, b, lower, lower + width, int(generator.integers(1, 200))))
        if generator.random() < 0.2:
            return BetaDistribution.of_moments(a, b, lower, width)
        return BetaDistribution(a, b, lower, lower + width)
    count = round(10 ** generator.uniform(1, 3.3))
    if generator.random() < 0.5:
        q = np.sort(generator.gamma(log_uniform(generator, -0.5, 1.5), size=count))
    else:
        q = betaincinv(*(log_uniform(generator, 0, 1) for _ in range(2)), np.linspace(0, 1, count))
    return QuantileDistribution(q * log_uniform(generator, -9, 3), 1.0, log_uniform(generator, -9, 1))


def is_answer(problem: PathProblem, error: RoughslipError) -> bool:
    """Whether an error answers a problem: a marginal distribution near to steps, which no Gaussian process reaches."""
    if not has_advice(error):
        return False
    ratio = problem.spacing / problem.process.correlation_length_m
    if isinstance(error, ParameterError):
        return problem.method == "recursion" and not SPACINGS[0] <= ratio <= SPACINGS[1]
    share = left_out(problem.process.marginal.centred, HERMITE_TERMS)
    return isinstance(error, IllPosedError) and share > 0.5 * LEFT_OUT


def judged(problem: PathProblem) -> Verdict:
    """Build paths and judge them and what they are drawn from."""
    process, scale = problem.process, problem.process.marginal.scale
    paths = prepare(process, problem.spacing, problem.length, problem.method)
    nodes = max(math.ceil(problem.length / problem.spacing - 1e-9), 1) + 1
    generator = np.random.default_rng([problem.number, 7])
    gaussian, conditions = _recursion(paths) if isinstance(paths, Recursion) else _period(paths, nodes)
    some = np.unique(generator.integers(0, min(len(gaussian), nodes), LAGS))
    wanted = np.exp(-some * problem.spacing / process.correlation_length_m)
    reached, error = pair_correlation(process.marginal.centred, np.clip(gaussian[some], -1, 1))
    series = 2 * abs(paths.translation.left_out) + 1e-8
    conditions |= {
        "lag zero": (abs(gaussian[0] - 1), 1e-9),
        "the autocorrelation": (np.max(np.abs(reached - wanted)), paths.correlation_error + series + error),
        "its error": (paths.correlation_error, WORST),
    }
    sample = np.stack([_path(paths, [problem.number, seed], nodes) for seed in range(PATHS)])
    again = _path(paths, [problem.number, 3], nodes)
    table = process.marginal.centred(np.array([-8.5, 8.5]))
    conditions |= {
        "finite": (0.0 if np.isfinite(sample).all() else math.inf, 0),
        "again the same bits": (float(not np.array_equal(again, sample[3])), 0),
        "its bounds, below": (float(np.max(scale * table[0] - sample)), 1e-15 * scale),
        "its bounds, above": (float(np.max(sample - scale * table[1])), 1e-15 * scale),
    }
    if scale > 0:
        conditions |= _sampled(problem, sample, gaussian)
    return verdict_of(conditions)


def _recursion(paths: Recursion) -> tuple[np.ndarray, Conditions]:
    """Return the Gaussian correlation at the nodes, by the stationary state: P = D P D + c c'."""
    state, decay, gain = (part.astype(np.longdouble) for part in (paths.start, paths.decay, paths.gain))
    p = state @ state.T
    after = decay[:, None] * p * decay + np.outer(gain, gain)
    weights = p.sum(axis=0)
    lags = np.arange(SHORT)
    return (weights @ decay[:, None] ** lags).astype(float), {
        "a stationary state": (np.max(np.abs(after - p)) / np.max(np.abs(p)), 1e-10),
    }


def _period(paths: Paths, nodes: int) -> tuple[np.ndarray, Conditions]:
    """Return the Gaussian correlation at the nodes, by the waves of a period."""
    if not isinstance(paths, Spectrum):
        raise TypeError("neither a recursion nor a period")
    squares = paths.amplitude.astype(np.longdouble) ** 2
    squares[[0, -1]] *= 0.5  # one real number each
    k = np.arange(len(squares))
    lags = np.arange(min(nodes, SHORT))
    waves = np.cos(2 * np.pi * (np.outer(lags, k) % paths.period_nodes) / paths.period_nodes)
    share = np.full(len(squares), 2.0)
    share[[0, -1]] = 1.0
    return (waves @ (share * squares) / np.longdouble(paths.period_nodes) ** 2).astype(float), {
        "nodes": (abs(paths.nodes - nodes), 0),
        "spacing": (paths.period_nodes - MOST_NODES, 10.0 * MOST_NODES),
    }


def _path(paths: Paths, seed: list[int], nodes: int) -> np.ndarray:
    """Return the first nodes of a path, at most SHORT."""
    pieces, count = [], min(nodes, SHORT)
    for piece in paths.realisation(seed):
        pieces.append(piece)
        if sum(map(len, pieces)) >= count:
            break
    return np.concatenate(pieces)[:count]


def _sampled(problem: PathProblem, sample: np.ndarray, gaussian: np.ndarray) -> Conditions:
    """Return conditions on the distribution of the first node, and on the correlation of scores with another node."""
    marginal = problem.process.marginal
    probability = _probability(marginal, sample / marginal.scale)
    first = np.sort(probability[:, 0])
    steps = np.arange(PATHS + 1) / PATHS
    distance = max(np.max(steps[1:] - first), np.max(first - steps[:-1]))
    conditions: Conditions = {"the marginal": (distance, math.sqrt(RISK_LOG / (2 * PATHS)) + 1e-6)}
    scores = np.clip(ndtri(probability), -4, 4)
    lag = int(np.argmin(np.abs(gaussian[: sample.shape[1]] - 0.8)))
    if lag and abs(gaussian[lag]) < 0.999:
        r = float(np.corrcoef(scores[:, 0], scores[:, lag])[0, 1])
        apart = abs(math.atanh(min(r, 1 - 1e-12)) - math.atanh(gaussian[lag]))
        conditions["the correlation of paths"] = (apart, SCORE_WIDTH / math.sqrt(PATHS - 3))
    return conditions


def _probability(marginal: Marginal, centred: np.ndarray) -> np.ndarray:
    """Return the distribution function of centred values, in the unit of the marginal."""
    if isinstance(marginal, BetaDistribution):
        return betainc(marginal.a, marginal.b, np.clip(centred + marginal.a / (marginal.a + marginal.b), 0, 1))
    table = np.linspace(-8, 8, 8193)
    values = marginal.centred(table)
    return np.interp(centred, values, ndtr(table))
