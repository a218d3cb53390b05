"""Polynomial chaos: random pressures at a node, expanded from random surfaces or along a strip.

No contact is solved: the pressure is the positive part of a known response to Gaussian variables, the gap its negative
part. Pressures and gaps have units of 1e-9 to 1e9.

At a node the response is linear, quadratic, bent or exponential, and scatters. The plane is set so that none, one, few,
half, nearly all or all samples are in contact. The judge compares with other surfaces of the same distribution. The
distribution of n surfaces is within sqrt(log(2 / RISK) / 2 n) of the true one except with a probability of
RISK (Massart, Ann. Probab. 18 (1990) 1269). No expansion of them may be further away.

Every other problem is an expansion along a strip, fitted to the nodes of many short strips and judged on one long
strip. The response is a known function of height, slope and mean of the heights, computed here by plain differences.
K independent samples miss an event with a probability of RISK if its own probability is at most 1 - RISK^(1/K). The
mean square error therefore leaves out the worst points of that share. The stated error is an estimate from N - A
degrees of freedom, with N points and A terms. For normal residuals it is too low by a factor of (N - A) over the RISK
quantile of chi-squared with a probability of RISK. The judge allows TWICE that, since residuals of bent functions are
not normal.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import chi2, ks_2samp

from roughslip.chaos.local import SolvedSurfaces, fit_local
from roughslip.chaos.pressure import KINDS, PressureTarget
from roughslip.chaos.strip import fit_strip
from roughslip.chaos.variables import Stencil, local_functionals
from roughslip.errors import ConvergenceError, IllPosedError
from tests.properties.campaign import Trial, choose, log_uniform

RISK, TWICE = 1e-6, 2.0
# Shares of samples in contact, between two ends of a share; `none`, `one` and `all` are exact.
CONTACTS = {"none": (), "one": (), "few": (0.005, 0.1), "half": (0.2, 0.8), "most": (0.9, 0.99), "all": ()}
CONTACT_SHARES = (0.05, 0.05, 0.2, 0.45, 0.15, 0.1)
SHAPES = ("root", "linear")  # of pressure over response: of Hertz contact, and of a single cell
RESPONSES = ("linear", "quadratic", "kink", "exponential")
MOST_SURFACES, MOST_TERMS = 1000, 60
FRESH = 20_000
FAR = 30.0  # times the largest pressure of as many other surfaces

STENCIL = Stencil(near=(1, 1), far=(4, 2))
REACH = 5  # nodes from a node to the ends of its strip, beyond all differences and means
TERMS = (1, 9, 45, 165)  # of degree 0 to 3 in the eight functionals
LONG = 2000


def attempt(trial: Trial) -> None:
    """Expand at a node or along a strip."""
    (attempt_strip if trial.number % 2 else attempt_node)(trial)


def attempt_node(trial: Trial) -> None:
    """Expand the pressure at a node from surfaces.

    An error is no answer where half of many surfaces are in contact and the response scatters.
    """
    rng, drawn_slope, own, other = (np.random.default_rng([trial.seed, trial.number, k]) for k in range(4))
    contact = choose(rng, tuple(CONTACTS), CONTACT_SHARES)
    variables, degree = int(rng.integers(1, 9)), int(rng.integers(1, 5))
    while math.comb(variables + degree, degree) > MOST_TERMS:
        degree -= 1
    terms = math.comb(variables + degree, degree)
    kind, shape, form = choose(rng, KINDS), choose(rng, SHAPES), choose(rng, RESPONSES)
    nodes = choose(rng, (1, 1, 3))
    count, drift = round(log_uniform(rng, 1, np.log10(MOST_SURFACES))), float(rng.uniform(0, 1))
    scatter = choose(rng, (0.0, 1e-3, 0.1, 0.3, 1.0))  # standard deviation of the response given the variables
    unit_p, unit_g = log_uniform(rng, -9, 9), log_uniform(rng, -9, 9)  # [Pa], [m]
    guess = log_uniform(rng, -0.5, 0.5)  # stiffness of the gap that is given, over the true one
    power = 1 if kind == "trial_pressure" else 2
    cell = 0.3 * unit_p if shape == "linear" and power == 2 else 0.0
    target = PressureTarget(kind, guess * unit_p**power / unit_g, cell)
    slope = drawn_slope.standard_normal(variables)
    slope /= np.linalg.norm(slope)
    u = own.standard_normal((count, nodes, variables))
    u[:, 1:] = np.sqrt(0.5) * (u[:, :1] + u[:, 1:])  # Neighbours are like the node in the centre.
    distance2 = np.linspace(0.0, 1.0, nodes) if nodes > 1 else np.zeros(1)
    response = response_of(form, slope, u) + scatter * own.standard_normal((count, 1)) - drift * distance2
    raised = -contact_level(rng, contact, np.unique(response))

    def pressure_of(response: np.ndarray) -> np.ndarray:
        pressed = np.maximum(response + raised, 0.0)
        return unit_p * (np.sqrt(pressed) if shape == "root" else pressed)

    pressure, gap = pressure_of(response), unit_g * np.maximum(-response - raised, 0.0)
    trial.case |= {"contact": contact, "shape": shape, "response": form, "surfaces": count}
    trial.case |= {"kind": kind, "variables": variables, "nodes": nodes, "degree": degree, "scatter": scatter}
    clear = contact == "half" and scatter >= 0.1 and count >= max(25 * terms, 200)
    trial.answers = () if clear else (IllPosedError, ConvergenceError)
    expansion = fit_local(SolvedSurfaces(u, distance2, pressure, gap), degree, target)
    fresh = other.standard_normal((FRESH, variables))
    true = pressure_of(response_of(form, slope, fresh) + scatter * other.standard_normal(FRESH))
    drawn = expansion.draw(np.random.default_rng([trial.number, 4]), FRESH)
    missed = expansion.fit.leave_one_out
    assert all(np.isfinite(part).all() for part in (drawn, missed)), "not finite"
    distance = float(ks_2samp(drawn, true, method="asymp").statistic)
    trial.check("the distribution", distance, sampling_error(count) + 2 * sampling_error(FRESH))
    trial.check("p >= 0", -drawn.min())
    trial.check("the largest pressure", drawn.max(), FAR * max(float(true.max()), float(pressure.max())))
    trial.check("errors are not negative", -missed)


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


def contact_level(rng: np.random.Generator, contact: str, levels: np.ndarray) -> float:
    """Return the level of the response, of these levels, above which the named share of samples is in contact."""
    if CONTACTS[contact]:
        return float(np.quantile(levels, 1 - rng.uniform(*CONTACTS[contact])))
    return float({"none": levels[-1] + 1, "one": levels[-2:].mean(), "all": levels[0] - 1}[contact])


def sampling_error(count: int) -> float:
    """Return the bound of sup |F_n - F| for so many samples, exceeded with a probability of RISK."""
    return math.sqrt(math.log(2 / RISK) / (2 * count))


def attempt_strip(trial: Trial) -> None:
    """Expand the target along a strip at one or several planes, and check it along a long strip.

    Heights are white noise averaged over three nodes along the strip. An error is no answer where samples are many,
    rows are five and planes are within the heights.
    """
    rng = np.random.default_rng([trial.seed, trial.number, 9])
    degree = int(rng.integers(0, 4))
    count = min(math.ceil(TERMS[degree] * log_uniform(rng, -0.3, 2)) + int(rng.integers(0, 6)), 3000)
    kind, rows = choose(rng, KINDS), int(rng.integers(1, 9))
    bend = choose(rng, (0.0, 0.0, 0.1, 1.0))  # how far the response is from a polynomial of degree 2
    planes = rng.choice([-30.0, -2.0, -0.8, 0.0, 0.8, 30.0], int(rng.integers(1, 4)))
    height_unit, pressure_unit = log_uniform(rng, -9, 9), log_uniform(rng, -9, 9)  # [m], [Pa]
    power = 1 if kind == "trial_pressure" else 2

    def heights(stream: int, strips: int, nodes: int) -> np.ndarray:
        white = np.random.default_rng([trial.seed, trial.number, stream]).standard_normal((strips, nodes + 2, rows))
        return height_unit * (white[:, :-2] + white[:, 1:-1] + white[:, 2:]) / math.sqrt(3)

    def values(z: np.ndarray) -> np.ndarray:
        """Return the target (strips, nodes - 2 REACH, rows, levels) at the nodes away from both ends."""
        h, inner = z / height_unit, slice(REACH, z.shape[1] - REACH)
        slope, mean = np.gradient(h, axis=1)[:, inner], sum(np.roll(h, k, axis=1) for k in (-1, 0, 1))[:, inner] / 3
        response = (1 + 0.2 * np.arange(rows)) * h[:, inner] + 0.5 * mean + 0.3 * slope**2 + bend * np.abs(slope)
        return pressure_unit**power * (response[..., None] + planes)

    short = heights(1, count, 2 * REACH + 1)
    functionals, known = local_functionals(short, STENCIL)[:, :, REACH].transpose(1, 2, 0), values(short)[:, 0]
    trial.case |= {"kind": kind, "rows": rows, "samples": count, "degree": degree, "bend": bend}
    trial.case["planes"] = ",".join(map(str, planes))
    well_posed = count >= 8 * TERMS[degree] and rows >= 5 and max(np.abs(planes)) < 1.0
    trial.answers = () if well_posed else (IllPosedError, ConvergenceError)
    target = PressureTarget(kind, pressure_unit**power / height_unit)
    expansion, stated, _ = fit_strip(functionals, known, degree, STENCIL, target, np.arange(count))
    long = heights(2, 1, LONG)
    pressure, true = target.pressure(expansion.predicted(long[0]))[:, REACH:-REACH], values(long)[0]
    assert ((pressure >= 0) & (pressure < math.inf)).all(), "pressures that are negative or not finite"
    squares = ((pressure**power).transpose(1, 2, 0) - np.maximum(true, 0.0)) ** 2
    seen = math.ceil(RISK ** (1 / count) * len(squares))  # A share of the worst may be unknown to the samples.
    freedom = count - TERMS[degree]
    factor = TWICE * freedom / float(chi2.ppf(RISK, freedom)) if freedom > 0 else math.inf
    for place in np.ndindex(*stated.shape):
        fitted, fresh = known[(slice(None), *place)], true[(slice(None), *place)]
        of_fit, of_fresh = (weights_of(power, part, fitted) for part in (fitted, fresh))
        mean = np.average(fitted, weights=of_fit)
        variance = float(np.average((fitted - mean) ** 2, weights=of_fit))
        error = float(np.sort(squares[(slice(None), *place)] * of_fresh)[:seen].sum() / of_fresh.sum())
        allowed = factor * stated[place] * variance + (1e-11 * np.max(np.abs(fitted))) ** 2
        trial.check(f"error in row {place[0]}, penetration {place[1]}", error, allowed)


def weights_of(power: int, target: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return 1 in contact, 1 / (1 + (w / w_0)^2) out of it with w_0 = 0.3 of the mean in contact; 1 for pressures."""
    if power == 1:
        return np.ones(len(target))
    return np.where(target > 0, 1.0, 1 / (1 + (target / (0.3 * known[known > 0].mean())) ** 2))
