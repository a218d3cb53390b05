"""The law of scatter against solved cells: `snakemake scatter_law`, some fourteen minutes on one core.

Periodic cells of 26 surfaces are solved under seven loads, the same heights at all of them. The three constants of
`roughslip.friction.scatter_law` are fitted to every second surface and judged on the others. Written is law.json, with
every measured and every predicted scatter.
"""

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from roughslip.contact.influence import Influence
from roughslip.contact.periodic import cell_heights
from roughslip.contact.solve import solve_loads
from roughslip.friction import scatter_law
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed_cell
from roughslip.surface.models import covariance_of, self_affine

NODE, MODULUS = 1e-6, 1e11  # [m] edge of a cell of the mesh; [Pa] any: scatter depends on p / (E* h') alone
BLOCKS = 32, 16  # of a periodic cell, along and across
WINDOWS = ((2, 2), (4, 1), (4, 2), (4, 4), (8, 4))  # blocks along and across
LOADS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 5e-1)  # p / (E* h')
CELLS, SMALL = 40, 512 * 256  # of each surface, half as many of more nodes: 3 % of the scatter at medium loads
TOLERANCE, START = 1e-4, (1.0, 0.0, 0.3)  # of the solves; of the fit
MOST_OF_CELL = 0.1  # CV of a whole cell: below forty contacts a force that is given hides part of their scatter
FLOOR = 0.03  # of CV, added to its standard error
LONG, LARGE = (1024, 128), (1024, 512)


def waves(hurst: float, longest: float, lay: float = 1.0) -> Covariance:
    """A self-affine covariance of waves of 8 to so many nodes across the lay, with a constant spectrum beyond."""
    return self_affine(NODE, hurst, longest * lay * NODE, 8.0 * lay * NODE, longest * NODE)


def smooth(kind: str, length: float, lay: float = 1.0, smoothness: float | None = None) -> Covariance:
    """A covariance of a correlation length [nodes] across the lay."""
    return covariance_of(kind, NODE, length * lay * NODE, length * NODE, smoothness=smoothness)


SURFACES = {  # every second one, from the first on, is fitted; with the nodes of a cell where these are not 512 x 256
    **{f"Gaussian, l {length}": (smooth("gaussian", length),) for length in (12, 16)},
    "Matern 4, l 12": (smooth("matern", 12, smoothness=4.0),),
    "Matern 3, l 16": (smooth("matern", 16, smoothness=3.0),),
    **{f"H 0.8, {longest} to 8": (waves(0.8, longest),) for longest in (16, 32, 64, 128)},
    **{f"H 0.2, {longest} to 8": (waves(0.2, longest),) for longest in (64, 128)},
    **{f"H 0.5, {longest} to 8": (waves(0.5, longest),) for longest in (32, 64)},
    **{f"H 1, {longest} to 8": (waves(1.0, longest),) for longest in (128, 64)},
    "Gaussian, lay 2": (smooth("gaussian", 12, 2),),
    "Gaussian, lay 4": (smooth("gaussian", 9, 4),),
    "Gaussian, lay 30": (smooth("gaussian", 9, 30), (2048, 128)),
    "Gaussian, lay 10": (smooth("gaussian", 9, 10), LONG),
    "Matern 4, lay 3": (smooth("matern", 10, 3, 4.0),),
    "Matern 2, l 20": (smooth("matern", 20, smoothness=2.0),),
    "H 0.8, 64 to 8, lay 10": (waves(0.8, 64, 10), (1024, 256)),
    "H 0.8, 32 to 8, lay 4": (waves(0.8, 32, 4),),
    **{f"H 0.8, {longest} to 8": (waves(0.8, longest), LARGE) for longest in (512, 256)},
    **{f"H 0.5, {longest} to 8": (waves(0.5, longest), LARGE) for longest in (256, 512)},
}


class Point(NamedTuple):
    """A measured scatter: load p*, window [nodes], CV with its standard error, T, B and nu; CV of cells."""

    surface: str
    load: float
    window: tuple[int, int]
    scatter: float
    error: float
    pairs: float
    bandwidth: float
    lay: float
    of_cell: float

    def law(self, fitted: Sequence[float]) -> float:
        """CV by the law."""
        rough = scatter_law.Roughness(1.0, self.bandwidth, self.lay, NODE)
        return math.sqrt(scatter_law.of_summits(rough, self.load, fitted)) * self.pairs


def points(name: str) -> list[Point]:
    """The scatter of every window at every load, of one surface."""
    covariance, nodes = (*SURFACES[name], (512, 256))[:2]
    grid, rough, seed = Grid(*nodes, NODE, NODE), scatter_law.roughness_of(covariance), list(SURFACES).index(name)
    embedding, influence = embed_cell(covariance, grid), Influence(grid, MODULUS, periodic=True)
    pressures, rows = [load * MODULUS * rough.slope for load in LOADS], []
    (along, across), (nx, ny) = BLOCKS, (count // blocks for count, blocks in zip(nodes, BLOCKS, strict=True))
    for number in range(CELLS if grid.size <= SMALL else CELLS // 2):
        heights = cell_heights(embedding.sample(np.random.default_rng([seed, number])), grid)
        solved = solve_loads(influence, heights, pressures, TOLERANCE)
        fields = np.array([(each.shares, each.pressure) for each in solved])
        rows.append(fields.reshape(len(LOADS), 2, along, nx, across, ny).sum(axis=(3, 5)))
    found = []
    for load, sums in zip(LOADS, np.array(rows).transpose(1, 2, 0, 3, 4), strict=True):
        for i, j in WINDOWS:
            area, force = sums.reshape(2, len(rows), along // i, i, across // j, j).sum(axis=(3, 5))
            squares = np.mean(((area - area.sum() / force.sum() * force) / area.mean()) ** 2, axis=(1, 2))
            scatter, size = math.sqrt(squares.mean()), (i * nx, j * ny)
            error = scatter * float(squares.std(ddof=1) / math.sqrt(len(rows)) / squares.mean()) / 2.0
            pairs = scatter_law.mean_over_window(covariance, rough, load, (size[0] * NODE, size[1] * NODE))
            of_cell = scatter * math.sqrt(math.prod(size) / grid.size)
            of_surface = math.sqrt(pairs), rough.bandwidth, rough.lay
            found.append(Point(name, load, size, scatter, error, *of_surface, of_cell))
    return found


def fitted(measured: Sequence[Point]) -> list[float]:
    """(a, b, k) by least squares of the logarithm, weighted by its error and FLOOR."""

    def residuals(abk: np.ndarray) -> list[float]:
        return [math.log(p.law(abk) / p.scatter) / math.hypot(p.error / p.scatter, FLOOR) for p in measured]

    return [float(value) for value in least_squares(residuals, START).x]


def errors(judged: Sequence[Point], constants: Sequence[float]) -> dict[str, float]:
    """Of the logarithm of CV: rms, the part of the solved scatter, and rms without it."""
    logs = [math.log(p.law(constants) / p.scatter) for p in judged]
    rms, noise = (math.sqrt(np.mean(np.square(x))) for x in (logs, [p.error / p.scatter for p in judged]))
    return {"rms": rms, "noise": noise, "law": math.sqrt(max(rms**2 - noise**2, 0.0)), "points": len(judged)}


def main() -> None:
    """Solve, fit, judge, write law.json, whose name is the only argument."""
    measured = [point for name in SURFACES for point in points(name)]
    taken, half = [point for point in measured if point.of_cell < MOST_OF_CELL], list(SURFACES)[::2]
    constants = fitted([point for point in taken if point.surface in half])
    judged = [point for point in taken if point.surface not in half]
    of_loads = {f"{load:g}": errors([p for p in judged if p.load == load], constants) for load in LOADS}
    of_surfaces = {name: errors([p for p in taken if p.surface == name], constants) for name in SURFACES}
    results = {"constants": constants, "judged": errors(judged, constants), "load": of_loads, "surface": of_surfaces}
    print(json.dumps(results, indent=1))
    results |= {"columns": [*Point._fields, "law"], "points": [[*p, p.law(constants)] for p in measured]}
    Path(sys.argv[1]).write_text(json.dumps(results) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
