"""Sparse expansions of functions that others expand too, beside OpenTURNS on the same samples and candidates.

Every expansion is judged at fresh points by the function itself: the error of a row is the root of the share of the
variance that it misses. `rows_of` is the entry.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from roughslip.chaos.basis import Basis, Family, truncated
from roughslip.chaos.expansion import expand, expand_adaptively
from roughslip.errors import IllPosedError
from workflow.benchmarks import measure
from workflow.benchmarks.chaos_generic_peers import PEERS
from workflow.benchmarks.measure import OURS, Row, case, row

SEED = 20261
FRESH = 20_000  # points at which an expansion is judged: its error is known to some per cent
ADAPTIVE = f"{OURS}/adaptive"

Model = Callable[[np.ndarray], np.ndarray]  # values at points : (K, variables)


def ishigami(x: np.ndarray, a: float = 7.0, b: float = 0.1) -> np.ndarray:
    """Three variables on [-1, 1] (Ishigami and Homma, ISUMA 1990)."""
    first, second, third = np.pi * x.T
    return np.sin(first) + a * np.sin(second) ** 2 + b * third**4 * np.sin(first)


def morris(x: np.ndarray) -> np.ndarray:
    """Twenty variables on [-1, 1]: ten matter, products of up to four do (Morris, Technometrics 33 (1991) 161)."""
    w = x.T.copy()
    bent = [2, 4, 6]
    unit = (w[bent] + 1) / 2
    w[bent] = 2 * (1.1 * unit / (unit + 0.1) - 0.5)
    number = np.arange(1, 21)
    first = np.where(number <= 10, 20.0, (-1.0) ** number)
    second = np.where(np.maximum.outer(number, number) <= 6, -15.0, (-1.0) ** np.add.outer(number, number))
    value = first @ w + np.einsum("ik,ij,jk->k", w, np.triu(second, 1), w, optimize=True)
    powers = [np.sum(w[:5] ** p, axis=0) for p in (1, 2, 3)]
    value -= 10 * (powers[0] ** 3 - 3 * powers[0] * powers[1] + 2 * powers[2]) / 6  # all products of three
    return value + 5 * np.prod(w[:4], axis=0)


def few_of_twenty(x: np.ndarray) -> np.ndarray:
    """Twenty standard normals, of which five matter and a sixth hardly."""
    return np.exp(0.4 * x[:, 0]) + x[:, 1] * x[:, 2] + np.sin(x[:, 3]) + 0.3 * x[:, 4] ** 2 * x[:, 0] + 0.05 * x[:, 5]


@dataclass(frozen=True)
class Problem:
    """A function, the law of its variables and the candidates for its expansion: the norm and degree of their set."""

    name: str
    function: Model
    families: tuple[Family, ...]
    degree: int
    norm: float

    @property
    def basis(self) -> Basis:
        return truncated(self.families, self.degree, norm=self.norm)

    def points(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """(count, variables) independent draws."""
        shape = count, len(self.families)
        normal = np.array([family == "hermite" for family in self.families])
        return np.where(normal, generator.standard_normal(shape), generator.uniform(-1, 1, shape))


PROBLEMS = (
    Problem("ishigami", ishigami, ("legendre",) * 3, 10, 1.0),
    Problem("morris", morris, ("legendre",) * 20, 4, 0.75),
    Problem("few_of_twenty", few_of_twenty, ("hermite",) * 20, 4, 0.75),
)


@dataclass(frozen=True)
class Campaign:
    """What is measured.

    samples : K, each with so many designs; the error of a row is the median over them
    most_work : samples times candidates up to which the peers take part: they take half a minute there
    """

    samples: tuple[tuple[int, int], ...] = ((100, 9), (200, 9), (400, 5), (1000, 3))
    most_work: float = 7e5
    problems: tuple[Problem, ...] = PROBLEMS


QUICK = Campaign(((60, 2), (100, 1)), problems=PROBLEMS[:1])


def ways(problem: Problem, peers: Sequence[str]) -> dict[str, Callable[[np.ndarray, np.ndarray], tuple[Model, int]]]:
    """Method -> (points, target) -> the expansion, to be called, and its number of terms."""

    def sparse(points: np.ndarray, target: np.ndarray) -> tuple[Model, int]:
        found = expand(points, target, problem.basis, sparse=True)
        return found, len(found.basis.indices)

    def adaptive(points: np.ndarray, target: np.ndarray) -> tuple[Model, int]:
        degrees = range(1, problem.degree + 1)
        found, _ = expand_adaptively(points, target, problem.families, degrees, norm=problem.norm, sparse=True)
        return found, len(found.basis.indices)

    theirs = {name: PEERS[name](problem.families, problem.degree, problem.norm) for name in peers}
    return {OURS: sparse, ADAPTIVE: adaptive, **theirs}


def rows_of(campaign: Campaign, peers: Sequence[str]) -> tuple[list[Row], dict[str, str]]:
    """A row a case and method: the median error over designs, their errors in `errors`; why designs were refused."""
    rows, refused = [], {}
    for problem, (samples, designs) in ((p, s) for p in campaign.problems for s in campaign.samples):
        terms = len(problem.basis.indices)
        taking = [peer for peer in peers if terms * samples <= campaign.most_work]
        label = case(function=problem.name, variables=len(problem.families), candidates=terms, samples=samples)
        for method, way in ways(problem, taking).items():
            errors, seconds, kept = [], [], []
            for number, (points, target, judge) in enumerate(designs_of(problem, samples, designs)):
                try:
                    spent, (found, active) = measure.timed(lambda p=points, t=target, w=way: w(p, t))
                except IllPosedError as error:
                    refused[f"{label} {method} {number}"] = str(error)
                    continue
                errors.append(judge(found))
                seconds.append(spent)
                kept.append(active)
            if errors:
                rows.append(row(label, method, statistics.median(errors), seconds, samples, errors=errors, terms=kept))
                measure.say(f"{label}: {method} {seconds[0]:.2g} s, error {rows[-1]['error']:.2e}, {kept[0]} terms")
    return rows, refused


def designs_of(
    problem: Problem, samples: int, designs: int
) -> Iterator[tuple[np.ndarray, np.ndarray, Callable[[Model], float]]]:
    """Points, target and judge of each design, the same for every method."""
    fresh = problem.points(np.random.default_rng([SEED, 0]), FRESH)
    expected = problem.function(fresh)

    def judge(found: Model) -> float:
        return math.sqrt(float(np.mean((found(fresh) - expected) ** 2) / expected.var()))

    for number in range(designs):
        points = problem.points(np.random.default_rng([SEED, samples, number]), samples)
        yield points, problem.function(points), judge
