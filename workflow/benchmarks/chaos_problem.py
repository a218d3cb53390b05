"""The pressure at the centre of a scene's square: solves in several designs, and the kept Monte Carlo reference.

Errors are net of the standard error s of the reference: sqrt(max(0, e^2 - s^2)). For the largest difference of two
distributions, s is the one at the pressure of that difference.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from roughslip import store
from roughslip.chaos.designs import latin_hypercube, monte_carlo, sobol_places
from roughslip.chaos.hermite import multi_indices
from roughslip.chaos.pressure import PressureTarget
from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve, sweep
from roughslip.grid import Grid
from roughslip.scene.loader import load
from roughslip.scene.types import Scene, scene_of
from roughslip.stages.from_scene import elastic, expansion, geometry, surface_model
from roughslip.stages.from_scene.geometry import Nodes, central_nodes, training_nodes
from roughslip.surface.karhunen_loeve import heights, karhunen_loeve
from roughslip.surface.model import GaussianModel
from workflow.monte_carlo.pressure import PERCENTILES, TOLERANCE

ROOT = Path(__file__).parents[2]
KEPT_RESULTS = ROOT / "results" / "reference"  # folders of scenes whose results git keeps
# The second entry of every seed; the study and the reference use other streams.
STREAMS = {"monte_carlo": 21, "latin_hypercube": 22, "sobol": 23}
MEDIAN = 1  # index of the median penetration in PERCENTILES
JUDGED = (0.5, 0.9, 0.99)  # quantiles given contact
QUANTILES = {f"quantile_{100 * probability:.0f}": probability for probability in JUDGED}


class Difference(NamedTuple):
    """An observed difference, and the standard error of the reference in the same unit."""

    seen: float
    reference_error: float

    @property
    def net(self) -> float:
        """The difference without the error of the reference, with the sign of the observed one."""
        if not math.isfinite(self.seen):
            return self.seen
        return math.copysign(math.sqrt(max(0.0, self.seen**2 - self.reference_error**2)), self.seen)


@dataclass(frozen=True)
class MonteCarloReference:
    """The kept Monte Carlo reference of a scene at one penetration.

    level, cumulative, error : (n,) [Pa], [-] the distribution with standard errors; level 0 is no contact
    numbers : value and standard error of contact probability, mean pressure and quantiles given contact
    """

    level: np.ndarray
    cumulative: np.ndarray
    error: np.ndarray
    numbers: dict[str, tuple[float, float]]

    def distance(self, pressure: np.ndarray) -> Difference:
        """Return the largest difference of the distribution of pressures (n,) [Pa], including the atom at zero.

        Linear interpolation of the reference between levels errs by less than 1e-4.
        """
        ascending = np.sort(pressure)
        points = np.concatenate([self.level, ascending[ascending > 0]])
        expected = np.interp(points, self.level, self.cumulative)
        sides = [np.searchsorted(ascending, points, side=side) / len(ascending) for side in ("right", "left")]
        sides[1] = np.where(points > 0, sides[1], sides[0])
        off = np.maximum(*(np.abs(share - expected) for share in sides))
        worst = int(np.argmax(off))
        return Difference(float(off[worst]), float(np.interp(points[worst], self.level, self.error)))

    def differences(self, pressure: np.ndarray) -> dict[str, Difference]:
        """Return the distance, and signed relative errors of numbers; quantiles without contact are NaN."""
        positive = pressure[pressure > 0]
        found = {"contact_probability": len(positive) / len(pressure), "mean_pressure": float(pressure.mean())}
        of_contact = np.quantile(positive, JUDGED) if len(positive) else np.full(len(JUDGED), np.nan)
        found |= dict(zip(QUANTILES, map(float, of_contact), strict=True))
        relative = {
            name: Difference((found[name] - value) / value, error / value)
            for name, (value, error) in self.numbers.items()
        }
        return {"distance": self.distance(pressure), **relative}


def load_scene(name: str, changes: Mapping[str, object] | None = None) -> Scene:
    """Return a scene of the project.

    changes : values of dotted keys, such as strip.cell_m, that replace those of the scene
    """
    values = load(name, ROOT / "config" / "scenes")
    for key, value in (changes or {}).items():
        section, field = key.split(".")
        values = {**values, section: {**values[section], field: value}}
    return scene_of(values)


def read_references(path: Path) -> list[MonteCarloReference]:
    """Read the references of a scene in the order of PERCENTILES. Raises StoreError if the file is missing."""
    kept = store.read(path)
    places = [int(np.flatnonzero(np.isclose(kept["probability"], probability))[0]) for probability in JUDGED]
    found = []
    for row in range(len(PERCENTILES)):
        numbers = {
            name: (float(kept[best][row]), float(kept[f"{best}_standard_error"][row]))
            for name, best in (("contact_probability",) * 2, ("mean_pressure", "controlled_mean_pressure"))
        }
        for name, place in zip(QUANTILES, places, strict=True):
            numbers[name] = float(kept["quantile"][row, place]), float(kept["quantile_standard_error"][row, place])
        found.append(
            MonteCarloReference(
                kept["level"][row], kept["cumulative"][row], kept["cumulative_standard_error"][row], numbers
            )
        )
    return found


@dataclass(frozen=True)
class Square:
    """The square of a scene, with what solves and expansions need.

    modes : (M, nx, ny) [m]
    nodes : nodes whose pressure is kept; the first `central` ones are at the centre
    directions, odd : (nodes, variables, M), and how the symmetries of the surface act on the variables
    indices : (P, variables) exponents
    planes : (penetrations,) [m]
    """

    name: str
    scene: Scene
    model: GaussianModel
    grid: Grid
    modes: np.ndarray
    influence: Influence
    nodes: Nodes
    central: int
    directions: np.ndarray
    odd: np.ndarray
    indices: np.ndarray
    target: PressureTarget
    planes: np.ndarray

    @classmethod
    def of(cls, name: str) -> Square:
        """Return the square of a scene of the project."""
        scene = load_scene(name)
        model, grid = surface_model.gaussian_model(scene), geometry.square_grid(scene)
        modes = karhunen_loeve(model.covariance, grid, scene.square.modes, share=scene.square.variance_share).modes
        nodes, terms = training_nodes(model.lengths_m, grid), scene.expansion
        return cls(
            name,
            scene,
            model,
            grid,
            modes,
            elastic.influence(scene, grid),
            nodes,
            len(central_nodes(model.lengths_m, grid).x),
            *expansion.directions(model, grid, modes, nodes, terms.variables),
            multi_indices(terms.variables, terms.degree),
            expansion.targets(scene, model, grid)[0],
            np.array([float(model.plane_height(percentile)) for percentile in PERCENTILES]),
        )

    @property
    def seed(self) -> int:
        """The seed of the scene."""
        return self.scene.seed

    def design(self, name: str, count: int, number: int) -> np.ndarray:
        """Return xi (count, M) of the design of this name, size and number; Sobol points are the first of 2^n."""
        seed, modes = [self.seed, STREAMS[name]], len(self.modes)
        if name == "monte_carlo":
            return np.array([monte_carlo([*seed, count * number + sample], modes) for sample in range(count)])
        if name == "latin_hypercube":
            return latin_hypercube(np.random.default_rng([*seed, count, number]), count, modes)
        return ndtri(sobol_places(np.random.default_rng([*seed, number]), count, modes))

    def surface(self, xi: np.ndarray) -> np.ndarray:
        """Return heights (nx, ny) [m] of one sample."""
        return self.model.heights(heights(self.modes, xi))

    def solve(self, xi: np.ndarray) -> Solved:
        """Solve every sample of a design (K, M) at all penetrations."""
        shape = len(xi), len(self.planes), len(self.nodes.x)
        pressure, gap = np.empty(shape), np.empty(shape)
        for row, sample in enumerate(xi):
            for level, solution in enumerate(sweep(self.influence, self.surface(sample), self.planes, TOLERANCE)):
                pressure[row, level] = solution.pressure[self.nodes.x, self.nodes.y]
                gap[row, level] = solution.gap[self.nodes.x, self.nodes.y]
        return Solved(xi, pressure, gap)

    def solve_seconds(self, samples: int) -> list[float]:
        """Return the mean seconds of a solve at each penetration alone, including its surface."""
        xi = self.design("monte_carlo", samples, 0)
        found = []
        for plane in self.planes:
            solve(self.influence, self.surface(xi[0]) - plane, TOLERANCE)  # compiles at the first call
            start = time.perf_counter()
            for sample in xi:
                solve(self.influence, self.surface(sample) - plane, TOLERANCE)
            found.append((time.perf_counter() - start) / samples)
        return found


@dataclass(frozen=True)
class Solved:
    """A design xi (K, M) and its solves: pressure and gap (K, penetrations, nodes)."""

    xi: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray

    def part(self, first: int, last: int) -> Solved:
        """Return samples first ... last - 1."""
        return Solved(self.xi[first:last], self.pressure[first:last], self.gap[first:last])
