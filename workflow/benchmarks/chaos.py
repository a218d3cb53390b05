"""Measure polynomial chaos: the distribution of the pressure at the centre of the square against its reference.

Direct sampling, the paper's eqs. (8) and (9), and our expansion get the same numbers of contact solves, in several
designs. A kept Monte Carlo reference, of other random numbers, judges each distribution. Errors are net of its standard
error s: sqrt(max(0, e^2 - s^2)). The seconds of a row are those of its solves at all penetrations, fit and draws.
"""

import itertools
import math
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from roughslip import store
from roughslip.chaos.centre_distribution import fit_equation
from roughslip.chaos.local import SolvedSurfaces, fit_local
from roughslip.chaos.variables import latin_hypercube
from roughslip.contact.solve import sweep
from roughslip.errors import IllPosedError
from roughslip.limits import FUNCTIONALS
from roughslip.scene.loader import load
from roughslip.scene.types import scene_of
from roughslip.study.from_scene import Stream, elastic, expansion, geometry, surface_model
from roughslip.study.from_scene.geometry import central_nodes, training_nodes
from roughslip.surface.modes import heights, karhunen_loeve
from workflow.benchmarks.rows import OURS, case, make_row, timed, write

ROOT = Path(__file__).parents[2]
KEPT_RESULTS = ROOT / "results" / "reference"  # folders of scenes whose results git keeps
PERCENTILES = (20.0, 50.0, 80.0)  # penetrations of the reference
TOLERANCE = 1e-6  # of solves, far below the sampling error of any number of samples
# The second entry of every seed; the study and the reference use other streams.
STREAMS = {"monte_carlo": 21, "latin_hypercube": 22, "sobol": 23}
EQUATIONS = ("equation_8", "equation_9")
EQUATION_DESIGNS = 3  # of each number of solves to which the equations are fitted
# By scene, how many Latin hypercube designs of each number of samples, and Monte Carlo and Sobol designs of the
# largest; fewer samples are the first ones of these. 1000 solves of `paper` take a third of a second, `resolved` 12 s.
PLANS: dict[str, tuple[dict[int, int], int]] = {
    "paper": ({250: 6, 500: 6, 1000: 20, 2000: 4, 4000: 3}, 6),
    "resolved": ({250: 4, 500: 4, 1000: 2, 2000: 20, 4000: 1}, 2),
}
DRAWS = 400_000  # as in the study; a contact probability of 0.05 is then known to 0.7 %


def distance(kept: Mapping[str, np.ndarray], row: int, pressure: np.ndarray) -> float:
    """Return the largest difference of the distribution of pressures (n,) [Pa] from a kept one, the atom at 0 included.

    It is net of the reference's error at the pressure of that difference. Linear interpolation of the reference
    between levels errs by less than 1e-4.
    """
    level, cumulative, error = (kept[name][row] for name in ("level", "cumulative", "cumulative_standard_error"))
    ascending = np.sort(pressure)
    points = np.concatenate([level, ascending[ascending > 0]])
    expected = np.interp(points, level, cumulative)
    right, left = (np.searchsorted(ascending, points, side=side) / len(ascending) for side in ("right", "left"))
    off = np.maximum(np.abs(right - expected), np.abs(np.where(points > 0, left, right) - expected))
    worst = int(np.argmax(off))
    return math.sqrt(max(0.0, float(off[worst]) ** 2 - float(np.interp(points[worst], level, error)) ** 2))


class Solved(NamedTuple):
    """A design xi (K, M), its pressure and gap (K, penetrations, nodes), and the mean seconds of a sample."""

    xi: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    seconds: float


class Square:
    """The square of a scene, with what solves and expansions need.

    modes : (M, nx, ny) [m]
    nodes : nodes whose pressure is kept; the first `central` ones are at the centre
    directions, odd : (nodes, variables, M), and how the symmetries of the surface act on the variables
    planes : (penetrations,) [m]
    """

    def __init__(self, name: str) -> None:
        self.name, self.scene = name, scene_of(load(name, ROOT / "config" / "scenes"))
        self.seed, self.degree = self.scene.seed, self.scene.expansion.degree
        self.model, self.grid = surface_model.gaussian_model(self.scene), geometry.square_grid(self.scene)
        square = self.scene.square
        self.modes = karhunen_loeve(self.model.covariance, self.grid, square.modes).modes
        self.central = len(central_nodes(self.model.lengths_m, self.grid).x)
        self.influence = elastic.influence(self.scene, self.grid)
        self.nodes = training_nodes(self.model.lengths_m, self.grid)
        self.directions, self.odd = expansion.directions(self.model, self.grid, self.modes, self.nodes, FUNCTIONALS)
        self.target = expansion.target(self.scene, self.model, self.grid)
        self.planes = np.array([float(self.model.plane_height(percentile)) for percentile in PERCENTILES])

    def design(self, name: str, count: int, number: int) -> np.ndarray:
        """Return xi (count, M) of the design of this name, size and number; Sobol points are the first of 2^n."""
        seed, modes = [self.seed, STREAMS[name]], len(self.modes)
        if name == "monte_carlo":
            generators = (np.random.default_rng([*seed, count * number + sample]) for sample in range(count))
            return np.array([generator.standard_normal(modes) for generator in generators])
        if name == "latin_hypercube":
            return latin_hypercube(np.random.default_rng([*seed, count, number]), count, modes)
        return ndtri(qmc.Sobol(modes, rng=np.random.default_rng([*seed, number])).random(count))

    def solve(self, xi: np.ndarray) -> Solved:
        """Solve every sample of a design (K, M) at all penetrations."""
        pressure, gap = np.empty((2, len(xi), len(self.planes), len(self.nodes.x)))
        start = time.perf_counter()
        for row, sample in enumerate(xi):
            z = self.model.heights(heights(self.modes, sample[None])[0])
            for level, solution in enumerate(sweep(self.influence, z, self.planes, TOLERANCE)):
                pressure[row, level] = solution.pressure[self.nodes.x, self.nodes.y]
                gap[row, level] = solution.gap[self.nodes.x, self.nodes.y]
        return Solved(xi, pressure, gap, (time.perf_counter() - start) / len(xi))

    def designs(self, plan: tuple[dict[int, int], int]) -> Iterator[tuple[str, int, Solved]]:
        """Yield the kind of each design of a plan, its number, and its solves."""
        latin_hypercube, others = plan
        for kind in ("monte_carlo", "sobol"):
            for number in range(others):
                whole = self.solve(self.design(kind, max(latin_hypercube), number))
                for samples in latin_hypercube:
                    parts = (part[:samples] for part in whole[:3])
                    yield kind, number, Solved(*parts, whole.seconds)
        for samples, count in latin_hypercube.items():
            for number in range(count):
                yield "latin_hypercube", number, self.solve(self.design("latin_hypercube", samples, number))


def draw_pressures(method: str, square: Square, solved: Solved, level: int, stream: int) -> np.ndarray:
    """Return pressures (n,) [Pa] by a method: those at the central nodes, or drawn from an expansion of them.

    Eqs. (8) and (9) are fitted to the samples in contact alone, as in stage chaos_square.
    """
    if method in STREAMS:
        return solved.pressure[:, level, : square.central].ravel()
    seed = [square.seed, Stream.DRAWS, stream]
    if method == OURS:
        variables = np.einsum("km,nvm->knv", solved.xi, square.directions)
        pressure, gap = solved.pressure[:, level], solved.gap[:, level]
        samples = SolvedSurfaces(variables, square.nodes.distance2, pressure, gap, square.odd)
        return fit_local(samples, square.degree, square.target).draw(np.random.default_rng(seed), DRAWS)
    variables, pressures = [solved.xi @ square.directions[0].T], [solved.pressure[:, level, 0]]
    return fit_equation(variables, pressures, square.degree, logarithm=method == "equation_9").draw(seed)[0]


def measure(_: bool) -> dict[str, Any]:
    """Return a row for each scene, penetration, method and number of solves.

    The error of a row is the median net distance of its designs from the reference, without those that were refused.
    """
    results_of: dict[tuple[str, int, str, int], list[tuple[float, float]]] = defaultdict(list)
    for scene, plan in PLANS.items():
        kept, square = store.read(KEPT_RESULTS / scene / "pressure.nc"), Square(scene)
        for kind, number, solved in square.designs(plan):
            samples = len(solved.xi)
            fitted = (OURS, *(EQUATIONS if number < EQUATION_DESIGNS else ())) if kind == "latin_hypercube" else ()
            for method, level in itertools.product((kind, *fitted), range(len(PERCENTILES))):
                try:
                    seconds, pressure = timed(partial(draw_pressures, method, square, solved, level, number))
                except IllPosedError as error:
                    print(f"{case_of(scene, level)} {method} {samples} {number}: {error}", file=sys.stderr)
                    continue
                time_and_distance = samples * solved.seconds + seconds, distance(kept, level, pressure)
                results_of[scene, level, method, samples].append(time_and_distance)
    rows = []
    for (scene, level, method, samples), results in sorted(results_of.items()):
        turns, distances = zip(*results, strict=True)
        rows.append(make_row(case_of(scene, level), method, statistics.median(distances), turns, samples))
    return {"rows": rows}


def case_of(scene: str, level: int) -> str:
    """Return the case of a scene at a penetration."""
    return case(scene=scene, percentile=f"{PERCENTILES[level]:g}", quantity="pressure")


if __name__ == "__main__":
    write("chaos", measure)
