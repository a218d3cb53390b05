"""From a stage's slice of the scene to meshes, blocks, designs, and nodes at which the pressure is kept."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from roughslip.chaos.variables import latin_hypercube
from roughslip.grid import Grid
from roughslip.limits import LEAST_CONTACT, MARGIN, TRAINING_SPACING, WINDOWS, designs_of
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream

OUTER_NODE_DISTANCE = 0.5  # correlation lengths from the central nodes; of 0.5, 1 and 1.5 it has the least bias


def square_grid(scene: Scene) -> Grid:
    """Mesh of the square of Figure 2."""
    square = scene.square
    cell = square.edge_m / square.nodes
    return Grid(square.nodes, square.nodes, cell, cell)


def strip_grid(scene: Scene) -> Grid:
    """Mesh of a strip of Figure 3, margins included."""
    strip = scene.strip
    cell = strip.cell_m
    length = (WINDOWS + 2 * MARGIN) * strip.window_m
    return Grid(round(length / cell), round(strip.width_m / cell), cell, cell)


def middle(scene: Scene) -> slice:
    """Columns of the strip on which windows lie: the ends of a contact carry more pressure, so they are left out."""
    strip, cell = scene.strip, scene.strip.cell_m
    margin, length = round(MARGIN * strip.window_m / cell), round(WINDOWS * strip.window_m / cell)
    return slice(margin, margin + length)


@dataclass(frozen=True)
class Lattice:
    """Every so many columns of a strip, on which the expansion lives: neighbours of smooth heights say the same again.

    spacing : columns of the strip from one to the next
    grid : mesh of these columns, and all rows
    first : column of the strip that is the first of the lattice
    middle : those of the lattice on which windows lie
    """

    spacing: int
    grid: Grid
    first: int
    middle: slice

    def of(self, field: np.ndarray) -> np.ndarray:
        """The columns of the lattice of a field (nx, ny) on the strip."""
        return field[self.first :: self.spacing]


def lattice(scene: Scene) -> Lattice:
    """Where the expansion of a strip lives, every column where the scene does not say."""
    strip, fine = scene.strip, strip_grid(scene)
    spacing = round((strip.expansion_spacing_m or strip.cell_m) / strip.cell_m)
    within = middle(scene)
    start = within.start + (spacing - 1) // 2  # in the middle of the columns that it stands for
    first, count = start % spacing, (within.stop - within.start) // spacing
    columns = len(range(first, fine.nx, spacing))
    grid = Grid(columns, fine.ny, fine.dx * spacing, fine.dy)
    return Lattice(spacing, grid, first, slice(start // spacing, start // spacing + count))


def block_nodes(scene: Scene) -> tuple[int, int]:
    """Nodes of a block along and across the belt: the distance of two windows, and their width."""
    strip, cell = scene.strip, scene.strip.cell_m
    return round(strip.window_spacing_m / cell), round(strip.width_m / cell)


def least_contact_area(scene: Scene) -> float:
    """[m2] below which a window has no friction coefficient."""
    return LEAST_CONTACT * (scene.strip.window_m * scene.strip.width_m)


def training_columns(middle: slice) -> np.ndarray:
    """Columns of a strip whose pressure and gap train the expansion, all of them on its stationary middle."""
    return np.arange(middle.start + TRAINING_SPACING // 2, middle.stop, TRAINING_SPACING)


class Nodes(NamedTuple):
    """Nodes of a mesh at which the pressure is kept, the centre first.

    x, y : (n,) their numbers
    distance2 : (n,) [-] squared distance from the centre of the mesh in correlation lengths, less that of the first
    """

    x: np.ndarray
    y: np.ndarray
    distance2: np.ndarray


def central_nodes(lengths_m: tuple[float, float], grid: Grid) -> Nodes:
    """The centre, and on an even mesh the three nodes that are its mirror images.

    lengths_m : 1/e lengths of the surface along x and y
    """
    return _nodes(lengths_m, grid, [_central(n) for n in grid.shape])


def training_nodes(lengths_m: tuple[float, float], grid: Grid) -> Nodes:
    """The central nodes, and such as lie half a correlation length from them where the mesh resolves that."""
    lines = []
    for n, cell, length in zip(grid.shape, (grid.dx, grid.dy), lengths_m, strict=True):
        central, far = _central(n), round(OUTER_NODE_DISTANCE * length / cell)
        outer = [central[0] + far, central[-1] - far]
        lines.append(central + outer if far >= 2 and outer[1] >= 1 else central)
    return _nodes(lengths_m, grid, lines)


def _central(n: int) -> list[int]:
    return sorted({n // 2, (n - 1) // 2}, reverse=True)


def _nodes(lengths_m: tuple[float, float], grid: Grid, lines: list[list[int]]) -> Nodes:
    x, y = (part.ravel() for part in np.meshgrid(*map(np.array, lines), indexing="ij"))
    along, across = lengths_m
    distance2 = ((x - (grid.nx - 1) / 2) * grid.dx / along) ** 2 + ((y - (grid.ny - 1) / 2) * grid.dy / across) ** 2
    order = np.argsort(distance2, kind="stable")
    return Nodes(x[order], y[order], (distance2 - distance2[0])[order])


def variables_of(seed: int, numbers: Iterable[int], modes: int) -> np.ndarray:
    """xi : (samples, modes) of Monte Carlo samples by their numbers."""
    words = (np.array([seed, Stream.MONTE_CARLO, number], np.uint32) for number in numbers)  # quicker than integers
    return np.array([np.random.default_rng(word).standard_normal(modes) for word in words]).reshape(-1, modes)


def latin_hypercubes(scene: Scene, modes: int) -> Iterator[np.ndarray]:
    """xi : (samples, modes) of each of the designs that the paper's equations are fitted to, the first as if alone."""
    seed = [scene.seed, Stream.LATIN_HYPERCUBE]
    for number, part in enumerate(designs_of(scene.square.latin_hypercube_samples)):
        generator = np.random.default_rng([*seed, number] if number else seed)
        yield latin_hypercube(generator, part.stop - part.start, modes)


def training_design(scene: Scene, modes: int) -> np.ndarray:
    """xi : (samples, modes) of the design that our expansion is fitted to."""
    generator = np.random.default_rng([scene.seed, Stream.EXPANSION_DESIGN])
    return latin_hypercube(generator, scene.expansion.samples, modes)
