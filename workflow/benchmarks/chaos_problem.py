"""The pressure at the centre of a scene's square: its solves in several designs, and its judge, the reference.

Every error is told net of what the reference itself may be off: sqrt(max(0, e^2 - s^2)) with its standard error s, for
the largest difference of two distributions that at the pressure where it is found. What was seen is kept beside it.
"""

from __future__ import annotations

import math
import time
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
from roughslip.stages.from_scene import elastic, expansion, geometry, surface_model
from roughslip.stages.from_scene.nodes import Nodes, central_nodes, training_nodes
from roughslip.surface.karhunen_loeve import heights, karhunen_loeve
from roughslip.surface.model import GaussianModel
from workflow.references.pressure_solves import PERCENTILES, TOLERANCE

ROOT = Path(__file__).parents[2]
# The second entry of every seed, after the scene's: apart from the streams of the study and of the reference.
STREAMS = {"monte_carlo": 21, "latin_hypercube": 22, "sobol": 23}
JUDGED = (0.5, 0.9, 0.99)  # quantiles given contact
QUANTILES = {f"quantile_{100 * probability:.0f}": probability for probability in JUDGED}


class Difference(NamedTuple):
    """What was seen, and the standard error of the reference in the same unit."""

    seen: float
    reference_error: float

    @property
    def net(self) -> float:
        """What is left when the error of the reference is taken out, with the sign of what was seen."""
        if not math.isfinite(self.seen):
            return self.seen
        return math.copysign(math.sqrt(max(0.0, self.seen**2 - self.reference_error**2)), self.seen)


@dataclass(frozen=True)
class Reference:
    """The kept reference of a scene at one penetration.

    level, cumulative, error : (n,) [Pa], [-] its distribution with standard errors; level 0 is no contact
    numbers : name -> value and standard error of contact probability, mean pressure and quantiles given contact
    """

    level: np.ndarray
    cumulative: np.ndarray
    error: np.ndarray
    numbers: dict[str, tuple[float, float]]

    def distance(self, pressure: np.ndarray) -> Difference:
        """Largest difference of the distribution of pressures : (n,) [Pa], the atom at zero included.

        Between levels the reference is a straight line, which errs by less than 1e-4.
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
        """The distance, and relative errors with their signs; NaN for the quantiles of pressures without contact."""
        positive = pressure[pressure > 0]
        found = {"contact_probability": len(positive) / len(pressure), "mean_pressure": float(pressure.mean())}
        of_contact = np.quantile(positive, JUDGED) if len(positive) else np.full(len(JUDGED), np.nan)
        found |= dict(zip(QUANTILES, map(float, of_contact), strict=True))
        relative = {
            name: Difference((found[name] - value) / value, error / value)
            for name, (value, error) in self.numbers.items()
        }
        return {"distance": self.distance(pressure), **relative}


def references(path: Path) -> list[Reference]:
    """A reference a penetration, in the order of PERCENTILES. Raises StoreError where the file is missing."""
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
            Reference(kept["level"][row], kept["cumulative"][row], kept["cumulative_standard_error"][row], numbers)
        )
    return found


@dataclass(frozen=True)
class Square:
    """What the solves and expansions of a scene's square need.

    modes : (M, nx, ny) [m]
    nodes : at which the pressure is kept, the `central` ones first
    directions, odd : (nodes, variables, M), and what the symmetries of the surface do to the variables
    indices : (P, variables) exponents
    planes : (penetrations,) [m]
    """

    name: str
    configuration: geometry.Configuration
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
        """The square of a scene of the project."""
        configuration = load(name, ROOT / "config" / "scenes")
        model, grid = surface_model.gaussian_model(configuration), geometry.square_grid(configuration)
        order, share = (configuration["square"].get(name) for name in ("modes", "variance_share"))
        modes = karhunen_loeve(model.covariance, grid, order, share=share).modes
        nodes, terms = training_nodes(model, grid), configuration["expansion"]
        return cls(
            name,
            configuration,
            model,
            grid,
            modes,
            elastic.influence(configuration, grid),
            nodes,
            len(central_nodes(model, grid).x),
            *expansion.directions(model, grid, modes, nodes, terms["variables"]),
            multi_indices(terms["variables"], terms["degree"]),
            expansion.targets(configuration, model, grid)[0],
            np.array([float(model.plane_height(percentile)) for percentile in PERCENTILES]),
        )

    @property
    def seed(self) -> int:
        """Of the scene."""
        return int(self.configuration["seed"])

    def design(self, name: str, count: int, number: int) -> np.ndarray:
        """xi : (count, M), the `number`-th design of its name and size; of Sobol points the first of a power of two."""
        seed, modes = [self.seed, STREAMS[name]], len(self.modes)
        if name == "monte_carlo":
            return np.array([monte_carlo([*seed, count * number + sample], modes) for sample in range(count)])
        if name == "latin_hypercube":
            return latin_hypercube(np.random.default_rng([*seed, count, number]), count, modes)
        return ndtri(sobol_places(np.random.default_rng([*seed, number]), count, modes))

    def surface(self, xi: np.ndarray) -> np.ndarray:
        """Heights : (nx, ny) [m] of one sample."""
        return self.model.heights(heights(self.modes, xi))

    def solved(self, xi: np.ndarray) -> Solved:
        """All penetrations of every sample of a design : (K, M)."""
        shape = len(xi), len(self.planes), len(self.nodes.x)
        pressure, gap = np.empty(shape), np.empty(shape)
        for row, sample in enumerate(xi):
            for level, solution in enumerate(sweep(self.influence, self.surface(sample), self.planes, TOLERANCE)):
                pressure[row, level] = solution.pressure[self.nodes.x, self.nodes.y]
                gap[row, level] = solution.gap[self.nodes.x, self.nodes.y]
        return Solved(xi, pressure, gap)

    def seconds(self, samples: int) -> list[float]:
        """Of a solve at each penetration alone, its surface included: the mean, as work varies with the samples."""
        xi = self.design("monte_carlo", samples, 0)
        found = []
        for plane in self.planes:
            solve(self.influence, self.surface(xi[0]) - plane, TOLERANCE)  # what is compiled at the first one
            start = time.perf_counter()
            for sample in xi:
                solve(self.influence, self.surface(sample) - plane, TOLERANCE)
            found.append((time.perf_counter() - start) / samples)
        return found


@dataclass(frozen=True)
class Solved:
    """A design and its solves: xi : (K, M), pressure and gap : (K, penetrations, nodes)."""

    xi: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray

    def part(self, first: int, last: int) -> Solved:
        """Some of its samples."""
        return Solved(self.xi[first:last], self.pressure[first:last], self.gap[first:last])
