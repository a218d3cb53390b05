"""Campaign of polynomial chaos: random pressures at a node, expanded from random surfaces or along a strip.

No contact is solved: the pressure is the positive part of a known response to Gaussian variables, the gap its negative
part. Pressures and gaps have units of 1e-9 to 1e9.

At a node the response is linear, quadratic, bent or exponential, and scatters. The plane is set so that none, one, few,
half, nearly all or all samples are in contact. The judge compares with other surfaces of the same distribution. The
distribution of n distinct surfaces is within sqrt(log(2 / RISK) / 2 n) of the true one except with a probability of
RISK (Massart, Ann. Probab. 18 (1990) 1269). No expansion of them may be further away.

Every other problem is an expansion along a strip, fitted to the nodes of many short strips and judged on one long
strip. The response is a known function of height, slope and mean of the heights, computed here by plain differences.
The judge does not ask for what K independent samples cannot show. They miss an event with a probability of RISK if its
own probability is at most 1 - RISK^(1/K). The mean square error therefore leaves out the worst points of that share.
The stated error is an estimate from N - A degrees of freedom, with N points and A terms. For normal residuals it is too
low by a factor of (N - A) over the RISK quantile of chi-squared with a probability of RISK. The judge allows TWICE
that, since residuals of bent functions are not normal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from math import comb

import numpy as np
from scipy.stats import chi2, ks_2samp

from roughslip.chaos.functionals import Stencil, local_functionals
from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.chaos.pressure import KINDS, Kind, PressureTarget
from roughslip.chaos.strip import StripExpansion, fit_strip
from roughslip.errors import ConvergenceError, IllPosedError
from workflow.stress.runner import Conditions, Problem, Verdict, choose, log_uniform, unless, verdict_of

RISK, TWICE = 1e-6, 2.0

CONTACTS = ("none", "one", "few", "half", "most", "all")
CONTACT_SHARES = (0.05, 0.05, 0.2, 0.45, 0.15, 0.1)
SHAPES = ("root", "linear")  # of pressure over response: of Hertz contact, and of a single cell
RESPONSES = ("linear", "quadratic", "kink", "exponential")
COPIES, COPY_SHARES = (1, 3, 1000), (0.85, 0.1, 0.05)  # how often each surface occurs

MOST_SURFACES, MOST_TERMS = 1000, 60
FRESH = 20_000
FAR = 30.0  # times the largest pressure of as many other surfaces

STENCIL = Stencil(near=(1, 1), far=(4, 2))
REACH = 5  # nodes from a node to the ends of its strip, beyond all differences and means
TERMS = (1, 9, 45, 165)  # of degree 0 to 3 in the eight functionals
LONG = 2000


def problem(seed: int, number: int) -> Problem:
    """Return the problem of this number."""
    return (strip_problem if number % 2 else node_problem)(seed, number)


def node_problem(seed: int, number: int) -> Problem:
    """Draw surfaces, of which each may occur several times, and how their pressure follows from v variables.

    An error is no answer where half of many distinct surfaces are in contact and the response scatters.
    """
    generator = np.random.default_rng([seed, number, 0])
    contact = choose(generator, CONTACTS, CONTACT_SHARES)
    variables, degree = int(generator.integers(1, 9)), int(generator.integers(1, 5))
    while comb(variables + degree, degree) > MOST_TERMS:
        degree -= 1
    kind, shape, form = choose(generator, KINDS), choose(generator, SHAPES), choose(generator, RESPONSES)
    copies, nodes = choose(generator, COPIES, COPY_SHARES), choose(generator, (1, 1, 3))
    count, drift = round(log_uniform(generator, 1, np.log10(MOST_SURFACES))), float(generator.uniform(0, 1))
    scatter = choose(generator, (0.0, 1e-3, 0.1, 0.3, 1.0))  # standard deviation of the response given the variables
    unit_p, unit_g = log_uniform(generator, -9, 9), log_uniform(generator, -9, 9)  # [Pa], [m]
    guess = log_uniform(generator, -0.5, 0.5)  # stiffness of the gap that is given, over the true one
    cell = 0.3 * unit_p if shape == "linear" else 0.0
    target = (
        PressureTarget(kind, guess * unit_p / unit_g)
        if kind == "trial_pressure"
        else PressureTarget(kind, guess * unit_p**2 / unit_g, cell)
    )
    slope = np.random.default_rng([seed, number, 1]).standard_normal(variables)
    slope /= np.linalg.norm(slope)
    distinct, own = math.ceil(count / copies), np.random.default_rng([seed, number, 2])
    u = own.standard_normal((distinct, nodes, variables))
    u[:, 1:] = np.sqrt(0.5) * (u[:, :1] + u[:, 1:])  # Neighbours are like the node in the centre.
    distance2 = np.linspace(0.0, 1.0, nodes) if nodes > 1 else np.zeros(1)
    response = response_of(form, slope, u) + scatter * own.standard_normal((distinct, 1)) - drift * distance2
    plane = _plane(generator, contact, np.unique(np.repeat(response, copies, axis=0)[:count]))

    def pressure_of(response: np.ndarray) -> np.ndarray:
        pressed = np.maximum(response + plane, 0.0)
        return unit_p * (np.sqrt(pressed) if shape == "root" else pressed)

    parts = (u, pressure_of(response), unit_g * np.maximum(-response - plane, 0.0))
    variables_, pressure, gap = (np.repeat(part, copies, axis=0)[:count] for part in parts)
    samples = Samples(variables_, distance2, pressure, gap)

    def judged(found: LocalExpansion) -> Verdict:
        other = np.random.default_rng([seed, number, 3])
        fresh = other.standard_normal((FRESH, variables))
        true = pressure_of(response_of(form, slope, fresh) + scatter * other.standard_normal(FRESH))
        return judge_node(found, np.random.default_rng([number, 4]), fresh, true, float(pressure.max()), distinct)

    names = {"contact": contact, "shape": shape, "response": form, "copies": copies, "surfaces": count}
    names |= {"kind": kind, "variables": variables, "nodes": nodes, "degree": degree, "scatter": scatter}
    clear = contact == "half" and copies == 1 and scatter >= 0.1
    enough = count >= max(25 * comb(variables + degree, degree), 200)
    is_answer = unless(clear and enough, IllPosedError, ConvergenceError)
    return Problem(names, lambda: fit_local(samples, degree, target), judged, is_answer)


def response_of(form: str, slope: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the response : (...) at variables : (..., v), of order one."""
    along, across = u @ slope, u[..., -1]
    match form:
        case "quadratic":
            return along + 0.3 * (across**2 - 1) + 0.2 * across * u[..., 0]
        case "kink":
            return np.where(along > 0, along, 0.4 * along)
        case "exponential":
            return np.exp(0.7 * along) - 1
    return along


def _plane(generator: np.random.Generator, contact: str, levels: np.ndarray) -> float:
    """Return what the response, of these levels, is raised by, so that the named share of samples is in contact."""
    match contact:
        case "none":
            return float(-levels[-1] - 1)
        case "one":
            return float(-levels[-2:].mean())
        case "all":
            return float(1 - levels[0])
    least, most = {"few": (0.005, 0.1), "half": (0.2, 0.8), "most": (0.9, 0.99)}[contact]
    return float(-np.quantile(levels, 1 - generator.uniform(least, most)))


def sampling_error(count: int) -> float:
    """Return the bound of sup |F_n - F| for so many samples, exceeded with a probability of RISK."""
    return math.sqrt(math.log(2 / RISK) / (2 * count))


def judge_node(
    expansion: LocalExpansion,
    generator: np.random.Generator,
    fresh: np.ndarray,
    true: np.ndarray,
    highest: float,
    distinct: int,
) -> Verdict:
    """Return whether pressures of an expansion have the distribution of those of other surfaces.

    fresh, true : variables (FRESH, v) and pressures (FRESH,) [Pa] of other surfaces
    highest : [Pa] of the samples, of which so many are distinct
    """
    drawn, means = expansion.draw(generator, FRESH), expansion.mean_pressure_at(fresh)
    if not all(np.isfinite(part).all() for part in (drawn, means, expansion.score, expansion.cross_validated)):
        return Verdict(math.inf, ("pressures are not finite",))
    distance = float(ks_2samp(drawn, true, method="asymp").statistic)
    limit = sampling_error(distinct) + 2 * sampling_error(FRESH)
    conditions: Conditions = {
        "the distribution": (distance, limit),
        "p >= 0": (-min(drawn.min(), means.min()), 0),
        "the largest pressure": (drawn.max(), FAR * max(float(true.max()), highest)),
        "errors are not negative": (-min(expansion.score, expansion.cross_validated), 0),
    }
    return verdict_of(conditions, distance / limit)


def strip_problem(seed: int, number: int) -> Problem:
    """Draw nodes of short strips and the response that gives their target at one or several planes.

    Heights are white noise averaged over three nodes along the strip. An error is no answer where distinct samples are
    many, rows are five and planes are within the heights.
    """
    generator = np.random.default_rng([seed, number, 9])
    degree = int(generator.integers(0, 4))
    count = min(math.ceil(TERMS[degree] * log_uniform(generator, -0.3, 2)) + int(generator.integers(0, 6)), 3000)
    kind, rows = choose(generator, KINDS), int(generator.integers(1, 9))
    bend = choose(generator, (0.0, 0.0, 0.1, 1.0))  # how far the response is from a polynomial of degree 2
    planes = generator.choice([-30.0, -2.0, -0.8, 0.0, 0.8, 30.0], int(generator.integers(1, 4)))
    height_unit, pressure_unit = log_uniform(generator, -9, 9), log_uniform(generator, -9, 9)  # [m], [Pa]
    copies = choose(generator, (1, 2, 3), (0.8, 0.15, 0.05))
    power = 1 if kind == "trial_pressure" else 2
    distinct = max(count // copies, 1)

    def heights(stream: int, strips: int, nodes: int) -> np.ndarray:
        white = np.random.default_rng([seed, number, stream]).standard_normal((strips, nodes + 2, rows))
        return height_unit * (white[:, :-2] + white[:, 1:-1] + white[:, 2:]) / math.sqrt(3)

    def values(z: np.ndarray) -> np.ndarray:
        """Return the target (strips, nodes - 2 REACH, rows, levels) at the nodes away from both ends."""
        h, inner = z / height_unit, slice(REACH, z.shape[1] - REACH)
        slope, mean = np.gradient(h, axis=1)[:, inner], sum(np.roll(h, k, axis=1) for k in (-1, 0, 1))[:, inner] / 3
        response = (1 + 0.2 * np.arange(rows)) * h[:, inner] + 0.5 * mean + 0.3 * slope**2 + bend * np.abs(slope)
        return pressure_unit**power * (response[..., None] + planes)

    short = heights(1, distinct, 2 * REACH + 1)
    parts = local_functionals(short, STENCIL)[:, :, REACH].transpose(1, 2, 0), values(short)[:, 0]
    functionals, known = (np.repeat(part, copies, axis=0) for part in parts)
    target = PressureTarget(kind, pressure_unit**power / height_unit)

    def judged(found: tuple[StripExpansion, dict[str, np.ndarray]]) -> Verdict:
        long = heights(2, 1, LONG)
        pressure = found[0].pressure(long[0])[:, REACH:-REACH]
        if not (np.isfinite(pressure).all() and (pressure >= 0).all()):
            return Verdict(math.inf, ("pressures are negative or not finite",))
        stated, ours = found[1]["leave_one_out"], (pressure**power).transpose(1, 2, 0)
        return judge_strip(ours, values(long)[0], known, stated, distinct, distinct - TERMS[degree], kind)

    names = {"kind": kind, "rows": rows, "samples": count, "degree": degree, "bend": bend, "copies": copies}
    names |= {"planes": ",".join(map(str, planes))}
    well_posed = count >= 8 * TERMS[degree] and copies == 1 and rows >= 5 and max(np.abs(planes)) < 1.0
    solve: Callable = lambda: fit_strip(functionals, known, degree, STENCIL, target)  # noqa: E731
    return Problem(names, solve, judged, unless(well_posed, IllPosedError, ConvergenceError))


def judge_strip(
    ours: np.ndarray,
    true: np.ndarray,
    known: np.ndarray,
    stated: np.ndarray,
    distinct: int,
    freedom: int,
    kind: Kind,
) -> Verdict:
    """Compare positive parts of the target along a long strip, with the weights of the fit.

    ours, true : (nodes, rows, levels) of the expansion, and the true target
    known : (samples, rows, levels) the fitted target, of which so many samples are distinct
    stated : (rows, levels) [-] leave-one-out errors of the expansion, of these degrees of freedom
    """
    squares = (ours - np.maximum(true, 0.0)) ** 2
    seen = math.ceil(RISK ** (1 / distinct) * len(squares))  # A share of the worst may be unknown to the samples.
    factor = TWICE * freedom / float(chi2.ppf(RISK, freedom)) if freedom > 0 else math.inf
    conditions: Conditions = {}
    for place in np.ndindex(*stated.shape):
        fitted = known[(slice(None), *place)]
        weights, fresh = (_weights(kind, part, fitted) for part in (fitted, true[(slice(None), *place)]))
        mean = np.average(fitted, weights=weights)
        variance = float(np.average((fitted - mean) ** 2, weights=weights))
        error = float(np.sort(squares[(slice(None), *place)] * fresh)[:seen].sum() / fresh.sum())
        allowed = factor * stated[place] * variance + (1e-11 * np.max(np.abs(fitted))) ** 2
        conditions[f"error in row {place[0]}, penetration {place[1]}"] = (error, allowed)
    return verdict_of(conditions)


def _weights(kind: Kind, target: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return weights: 1 in contact, 1 / (1 + (w / w_0)^2) out of it with w_0 = 0.3 of the mean in contact.

    For a trial pressure all are 1.
    """
    if kind == "trial_pressure":
        return np.ones(len(target))
    scale = 0.3 * known[known > 0].mean()
    return np.where(target > 0, 1.0, 1 / (1 + (target / scale) ** 2))
