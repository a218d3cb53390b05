"""Periodic cells of a scene's surface under a load: their size, their number, and sums over blocks of their contact.

A cell has whole windows along and across the belt, at least WINDOWS of them and EDGE correlation lengths. All of it
bears the nominal pressure, so it also needs many contacts. The expected real area is sqrt(2 pi) p / (E* h') of it at
light loads (Bush, Gibson and Thomas, Wear 35 (1975) 87). It is at least CONTACT correlation areas, some 20 contacts.
What the period itself does is measured in docs/notebook/contact.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np

from roughslip import store
from roughslip.contact.influence import Influence
from roughslip.contact.periodic import cell_heights
from roughslip.contact.solution import ContactSolution, ContactSweep
from roughslip.contact.solve import solve_loads
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.from_scene.surface_model import fitted_covariance, gaussian_model, scan_warnings
from roughslip.stages.runtime.command import Job
from roughslip.surface.plausibility import (
    LIGHT_AREA,
    MOST_CELL_NODES,
    contact_mistake,
    plasticity_index,
    rms_slope,
    slope_mistake,
    yield_warning,
)

WINDOWS = 6, 2  # along and across, at least: lags of three windows are within half a period
SAMPLE = 8  # windows that stand for a sample of the scene
EDGE = 8.0  # correlation lengths of an edge, at least
CONTACT = 4.0  # correlation areas in contact in a cell, at least
FEWEST = 16  # cells that are resampled, at least


@dataclass(frozen=True)
class Cell:
    """One period of the surface.

    grid : its mesh
    block : nodes of a block along and across: the distance of two windows, and their width
    """

    grid: Grid
    block: tuple[int, int]

    def sums(self, field: np.ndarray) -> np.ndarray:
        """Integral (X, Y) over blocks of a field (nx, ny)."""
        (nx, ny), (x, y) = self.grid.shape, self.block
        return self.grid.cell_area * field.reshape(nx // x, x, ny // y, y).sum(axis=(1, 3))


def cell(scene: Scene, lengths_m: tuple[float, float], light_area: float) -> Cell:
    """The smallest cell that serves, or one of at most MOST_CELL_NODES nodes. Its shorter edge doubles until it serves.

    lengths_m : 1/e lengths of the heights along and across
    light_area : [-] share of the cell in contact that is expected
    """
    strip = scene.strip
    window, width = strip.window_m, strip.width_m
    along, across = (
        2 * math.ceil(max(least, EDGE * length / edge) / 2)
        for least, length, edge in zip(WINDOWS, lengths_m, (window, width), strict=True)
    )
    needed = CONTACT * math.prod(lengths_m) / light_area
    most = MOST_CELL_NODES * strip.cell_m**2
    while along * window * across * width < min(needed, most / 2):
        along, across = (2 * along, across) if along * window <= across * width else (along, 2 * across)
    x, y, spacing = (round(size / strip.cell_m) for size in (window, width, strip.window_spacing_m))
    return Cell(Grid(along * x, across * y, strip.cell_m, strip.cell_m), (spacing, y))


def check_slope(scan: store.Result) -> None:
    """Raise IllPosedError for a covariance fitted to a scan whose slope is infinite."""
    fitted = fitted_covariance(scan)
    if fitted is not None and (text := slope_mistake(fitted)):
        raise IllPosedError(f"roughness.scan.covariance: {text}. Of a scan, measured ends at its spacing")


class Cells:
    """The periodic cells of a scene at a nominal pressure, by number.

    mistake : of a pressure too high or too low; plasticity_index : E* h' / H [-], zero in elastic contact
    """

    def __init__(self, job: Job, pressure_pa: float) -> None:
        scene, scan = job.scene, job.arguments.scan
        self.scene = scene
        if scan is not None:
            check_slope(store.read(scan))
        model = gaussian_model(scene, scan)
        modulus, hardness = elastic.material(scene).plane_strain_modulus_pa, elastic.hardness_pa(scene)
        slope = rms_slope(model.covariance, scene.strip.cell_m)
        share = max(LIGHT_AREA * pressure_pa / (modulus * slope), pressure_pa / hardness)
        least = CONTACT * math.prod(model.lengths_m) / (MOST_CELL_NODES * scene.strip.cell_m**2)
        self.mistake = contact_mistake(pressure_pa, modulus, slope, hardness, least)
        self.plasticity_index = plasticity_index(modulus, slope, hardness)
        self.cell = cell(scene, model.lengths_m, share)
        if self.cell.grid.size > MOST_CELL_NODES:
            raise IllPosedError(
                f"a periodic cell of {WINDOWS[0]} x {WINDOWS[1]} windows and {EDGE:g} correlation lengths takes "
                f"{self.cell.grid.size} nodes, more than {MOST_CELL_NODES}: use larger cells or smaller windows; scene "
                "keys: strip.cell_m, strip.window_m, strip.width_m"
            )
        self._model, self._modulus_pa = model, modulus
        if scan is not None:
            job.usage.warn(*scan_warnings(scene, model))
            if math.isinf(hardness) and (text := yield_warning(scene.material.young_modulus_pa, modulus, slope)):
                job.usage.warn(text)

    @cached_property
    def influence(self) -> Influence:
        """B of the cell."""
        return Influence(self.cell.grid, self._modulus_pa, periodic=True)

    @cached_property
    def _sample(self) -> Callable[[np.random.Generator], np.ndarray]:
        return self._model.cell_sampler(self.cell.grid)

    def count(self, samples: int, fewest: int = FEWEST) -> int:
        """Cells that have SAMPLE windows a sample together, and at least the fewest."""
        grid, strip = self.cell.grid, self.scene.strip
        windows = grid.size * grid.cell_area / (strip.window_m * strip.width_m)
        return max(round(samples * SAMPLE / windows), fewest)

    def heights(self, number: int) -> np.ndarray:
        """Heights (nx, ny) [m] of a cell, as cells of constant pressure need them where edges of contacts count."""
        seed = [self.scene.seed, Stream.CELL, number]
        drawn = self._model.heights(self._sample(np.random.default_rng(seed)))
        return cell_heights(drawn, self.cell.grid) if elastic.counts_shares(self.scene) else drawn

    def solutions(self, number: int, pressures_pa: Sequence[float]) -> ContactSweep:
        """The contact of a cell at each pressure."""
        tolerance, hardness = self.scene.numerics.contact_tolerance, elastic.hardness_pa(self.scene)
        return solve_loads(self.influence, self.heights(number), pressures_pa, tolerance, hardness)

    def block_sums(self, solution: ContactSolution) -> tuple[np.ndarray, np.ndarray]:
        """Contact area [m2] and force [N] of the blocks (X, Y)."""
        touched = solution.shares if elastic.counts_shares(self.scene) else solution.contact
        return self.cell.sums(touched), self.cell.sums(solution.pressure)


def solved(
    at: Mapping[float, Cells], count: Callable[[Cells], int], progress: Callable[[int, int], object]
) -> Iterator[tuple[Cells, np.ndarray, np.ndarray]]:
    """Contact at several pressures. Those that share a size of cells are the same surfaces, from the lightest on.

    at : cells by pressure [Pa]; count : how many of a size; progress : is given solves done, and all

    Yields for each size its pressures (k,) [Pa], and area [m2] and force [N] of the blocks (2, k, cells, X, Y).
    """
    groups = [(at[same[0]], same) for _, group in groupby(sorted(at), key=lambda p: at[p].cell) if (same := [*group])]
    done, every = 0, sum(count(cells) * len(pressures) for cells, pressures in groups)
    for cells, pressures in groups:
        sums = []
        for number in range(count(cells)):
            sums.append([cells.block_sums(solution) for solution in cells.solutions(number, pressures)])
            done += len(pressures)
            progress(done, every)
        yield cells, np.array(pressures), np.moveaxis(np.array(sums), (2, 1), (0, 1))


def yielding(index: float, share: float) -> str:
    """Whether the contact of a load yields, as the log and the page say it.

    index : E* h' / H, zero in elastic contact; share : of the real area that bears the hardness
    """
    if not index:
        return "The contact is elastic: material.hardness_pa is not given."
    return f"The plasticity index E* h' / H is {index:.2g}; {100 * share:.2g} % of the real area bears the hardness."
