"""Random expansions of known functions: variables, truncations, designs, noise. A seed and a number make one again.

Nothing is spared: fewer samples than terms and a hundred times as many, copies of samples, constant targets, targets of
which no sample is positive, one or all, variables that are the same, outliers, units of 1e-9 to 1e9.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import hermite_e
from scipy.special import gammaln

from roughslip.chaos.designs import design
from roughslip.chaos.hermite import multi_indices
from workflow.stress.drawing import one_of, power

FUNCTIONS = ("polynomial", "kink", "exponential", "jump", "ishigami", "nothing", "constant", "none", "one", "all")
FUNCTION_SHARES = (0.34, 0.16, 0.1, 0.06, 0.1, 0.08, 0.04, 0.04, 0.04, 0.04)
NOISES = (0.0, 1e-9, 1e-4, 0.03, 0.3, 3.0)
COPIES = ("no", "some", "every", "one-sample", "points", "near")
COPY_SHARES = (0.7, 0.08, 0.08, 0.02, 0.06, 0.06)
DESIGNS = ("monte_carlo", "latin_hypercube", "sobol")

MOST_VARIABLES, MOST_DEGREE = 500, 15
MOST_TERMS = 300
MOST_PRODUCTS = 4e8  # K P^2: a problem stays below a second
MOST_NUMBERS = 2e6  # of the table of terms, or of the variables

Function = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Problem:
    """One function to expand.

    number : which one
    name : of FUNCTIONS
    indices : (P, v) exponents of the basis
    degree : of the basis
    points, target, weights : the samples, (K, v), (K,) and (K,) or None
    truth : the function, without its noise, in the unit of the target
    noise : standard deviation that the samples have beside it, in the unit of the target
    twins : so many variables from the second on are copies of the first
    labels : what else tells the problem, by name
    """

    number: int
    name: str
    indices: np.ndarray
    degree: int
    points: np.ndarray
    target: np.ndarray
    weights: np.ndarray | None
    truth: Function
    noise: float
    twins: int
    labels: dict[str, str]

    def fresh(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """(count, v) independent draws of the law of the samples."""
        return _twinned(generator.standard_normal((count, self.indices.shape[1])), self.twins)


def random_problem(seed: int, number: int) -> Problem:
    """The problem of this number."""
    generator = np.random.default_rng([seed, number])
    variables, twins = _variables(generator)
    degree = _degree(generator, variables)
    indices = multi_indices(variables, degree)
    samples = _count(generator, len(indices), variables)
    kind = one_of(generator, DESIGNS)
    xi = design(kind, [seed, number, 1], samples, variables)
    copies = one_of(generator, COPIES, COPY_SHARES)
    xi, origin = _copied(generator, copies, xi)
    points = _twinned(xi, twins)
    name = one_of(generator, FUNCTIONS, FUNCTION_SHARES)
    truth = _scaled(generator, _function(generator, name, degree, points))
    exact = truth(points)
    spread = float(np.std(exact)) or float(np.max(np.abs(exact))) or 1.0
    level = one_of(generator, NOISES) if name != "nothing" else 1.0
    noise = 0.0 if name in ("constant", "none") else level * spread
    drawn = noise * generator.standard_normal(samples)
    target = exact + (drawn if copies == "points" else drawn[origin])
    outliers = int(generator.integers(1, 4)) if generator.random() < 0.06 else 0
    if outliers:
        target[generator.integers(samples, size=outliers)] += spread * power(generator, 1, 6)
    weights = 10 ** generator.uniform(-2, 0, samples) if generator.random() < 0.1 else None
    labels = {
        "samples": f"{samples}",
        "design": kind,
        "copies": copies,
        "twins": f"{twins}",
        "noise": f"{level:g}",
        "outliers": f"{outliers}",
        "weights": "equal" if weights is None else "random",
        "size": f"{float(np.max(np.abs(target))):.2g}",
    }
    return Problem(number, name, indices, degree, points, target, weights, truth, noise, twins, labels)


def polynomials(x: np.ndarray, degree: int) -> np.ndarray:
    """(K, degree + 1) orthonormal Hermite polynomials at x : (K,), by numpy's recurrences."""
    return hermite_e.hermevander(x, degree) / np.exp(0.5 * gammaln(np.arange(degree + 1) + 1))


def product_terms(indices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(K, P) terms of these exponents at points : (K, v)."""
    values = np.ones((len(indices), len(points)))
    for variable in np.flatnonzero(indices.any(axis=0)):
        powers = indices[:, variable]
        table = polynomials(points[:, variable], int(powers.max())).T
        present = np.flatnonzero(powers)
        values[present] *= table[powers[present]]
    return values.T


def _variables(generator: np.random.Generator) -> tuple[int, int]:
    """The number of variables, and how many from the second on are copies of the first."""
    variables = round(MOST_VARIABLES ** generator.random())
    if generator.random() < 0.15:
        variables = 1
    twins = int(generator.integers(1, variables)) if variables > 1 and generator.random() < 0.05 else 0
    return variables, twins


def _degree(generator: np.random.Generator, variables: int) -> int:
    """A degree with at most MOST_TERMS terms."""
    degree = int(generator.integers(MOST_DEGREE + 1))
    while math.comb(variables + degree, degree) > MOST_TERMS:
        degree -= 1
    return degree


def _count(generator: np.random.Generator, terms: int, variables: int) -> int:
    """Samples, from half the terms to a hundred times as many, as far as time allows."""
    asked = math.ceil(terms * power(generator, math.log10(0.5), 2)) + int(generator.integers(0, 8))
    if generator.random() < 0.15:
        asked = terms + int(generator.integers(0, 12))  # hardly more than the terms
    return max(2, min(asked, int(MOST_PRODUCTS / terms**2), int(MOST_NUMBERS / max(terms, variables))))


def _twinned(points: np.ndarray, twins: int) -> np.ndarray:
    """So many variables from the second on are the first one."""
    points[:, 1 : 1 + twins] = points[:, :1]
    return points


def _copied(generator: np.random.Generator, copies: str, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples of which some are copies, or nearly so, and the number of the sample that each is a copy of."""
    count = len(xi)
    origin = np.arange(count)
    match copies:
        case "some":
            moved = generator.random(count) < 0.3
            origin = np.where(moved, generator.integers(count, size=count), origin)
            origin = origin[origin]
        case "every" | "points" | "near":
            origin = origin // 2 if generator.random() < 0.7 else origin // int(generator.integers(3, 6))
        case "one-sample":
            origin = np.zeros(count, dtype=np.int64)
    jitter = power(generator, -13, -7.5) * generator.standard_normal(xi.shape) if copies == "near" else 0.0
    return xi[origin] + jitter, origin


def _function(generator: np.random.Generator, name: str, degree: int, points: np.ndarray) -> Function:
    """A function of order one of few of the variables."""
    variables = points.shape[1]
    few = np.sort(generator.permutation(variables)[: int(generator.integers(1, 5))])
    slope = generator.standard_normal(len(few))
    slope /= np.linalg.norm(slope)
    match name:
        case "polynomial":
            return _polynomial(generator, few, degree)
        case "kink" | "jump":
            at = float(generator.uniform(-2.5, 2.5))
            return lambda x: _bent(name, at + x[:, few] @ slope)
        case "one" | "all":
            along = np.unique(points[:, few] @ slope)
            at = -along[-2:].mean() if name == "one" else 1.0 - along[0]
            return lambda x: np.maximum(at + x[:, few] @ slope, 0.0)
        case "exponential":
            rate = float(generator.uniform(0.2, 1.0))
            return lambda x: np.exp(rate * (x[:, few] @ slope))
        case "ishigami":
            first, second, third = (few[k % len(few)] for k in range(3))
            return lambda x: np.sin(np.pi * x[:, first]) * (1 + 0.1 * x[:, third] ** 4) + np.sin(x[:, second]) ** 2
        case "none" | "nothing":
            return lambda x: np.zeros(len(x))
        case _:
            value = float(generator.standard_normal())
            return lambda x: np.full(len(x), value)


def _bent(name: str, along: np.ndarray) -> np.ndarray:
    return np.maximum(along, 0.0) if name == "kink" else np.sign(along)


def _polynomial(generator: np.random.Generator, few: np.ndarray, degree: int) -> Function:
    """Some terms of up to a degree more than the basis has."""
    highest = int(generator.integers(1, degree + 2))
    exponents = np.zeros((int(generator.integers(1, 7)), len(few)), dtype=np.int64)
    for row in exponents:
        np.add.at(row, generator.integers(len(few), size=int(generator.integers(1, highest + 1))), 1)
    coefficients = generator.standard_normal(len(exponents))
    return lambda x: product_terms(exponents, x[:, few]) @ coefficients


def _scaled(generator: np.random.Generator, function: Function) -> Function:
    """The function in another unit, and over another zero."""
    unit = power(generator, -9, 9) if generator.random() < 0.7 else 1.0
    zero = unit * power(generator, -2, 9) if generator.random() < 0.15 else 0.0
    return lambda x: unit * function(x) + zero
