"""The law of scatter against solved cells: `snakemake scatter_law`, some fourteen minutes on one core.

Periodic cells of 26 surfaces are solved under seven loads, the same heights at all of them. The three constants of
`roughslip.friction.scatter_law` are fitted to every second surface and judged on the others. Written are law.json, with
every measured and every predicted scatter, and a figure.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from scipy.optimize import least_squares

from roughslip.contact.influence import Influence
from roughslip.contact.periodic import cell_heights
from roughslip.contact.solve import solve_loads
from roughslip.friction import scatter_law
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed_cell
from roughslip.surface.models import SelfAffine, covariance_of, self_affine

NODE = 1e-6  # [m] edge of a cell of the mesh; lengths below are in these
BLOCKS = 32, 16  # of a periodic cell, along and across
WINDOWS = ((2, 2), (4, 1), (4, 2), (4, 4), (8, 4))  # blocks along and across
LOADS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 5e-1)  # p / (E* h')
CELLS = 40  # of each surface, half as many of large ones: 3 % of the scatter at medium loads
SMALL = 512 * 256  # nodes
CHECKED, CHECK_LOADS = 32, (1e-2, 1e-1)  # cells, for the errors of the mesh and of the period
TOLERANCE = 1e-4
MODULUS = 1e11  # any: scatter depends on p / (E* h') alone
START = 1.0, 0.0, 0.3  # of the fit
MOST_OF_CELL = 0.1  # CV of a whole cell: below forty contacts a force that is given hides part of their scatter
FLOOR = 0.03  # of CV, added to its standard error
KINDS = "Gaussian, Matern", "H = 0.8", "other H", "with a lay"


class Case(NamedTuple):
    """A surface, and the nodes of its periodic cell."""

    covariance: Covariance
    nodes: tuple[int, int] = (512, 256)


def of_waves(hurst: float, longest: float, shortest: float = 8.0, lay: float = 1.0) -> Covariance:
    """A self-affine covariance between two wavelengths across the lay, with a constant spectrum from the longer on."""
    return self_affine(NODE, hurst, longest * lay * NODE, shortest * lay * NODE, longest * NODE)


def of_length(kind: str, length: float, lay: float = 1.0, **shapes: float) -> Covariance:
    """A covariance of a correlation length across the lay."""
    return covariance_of(kind, NODE, length * lay * NODE, length * NODE, **shapes)


LARGE = 1024, 512
SURFACES = {  # every second one, from the first on, is fitted
    "Gaussian, l 12": Case(of_length("gaussian", 12)),
    "Gaussian, l 16": Case(of_length("gaussian", 16)),
    "Matern 4, l 12": Case(of_length("matern", 12, smoothness=4.0)),
    "Matern 3, l 16": Case(of_length("matern", 16, smoothness=3.0)),
    "H 0.8, 16 to 8": Case(of_waves(0.8, 16)),
    "H 0.8, 32 to 8": Case(of_waves(0.8, 32)),
    "H 0.8, 64 to 8": Case(of_waves(0.8, 64)),
    "H 0.8, 128 to 8": Case(of_waves(0.8, 128)),
    "H 0.2, 64 to 8": Case(of_waves(0.2, 64)),
    "H 0.2, 128 to 8": Case(of_waves(0.2, 128)),
    "H 0.5, 32 to 8": Case(of_waves(0.5, 32)),
    "H 0.5, 64 to 8": Case(of_waves(0.5, 64)),
    "H 1, 128 to 8": Case(of_waves(1.0, 128)),
    "H 1, 64 to 8": Case(of_waves(1.0, 64)),
    "Gaussian, lay 2": Case(of_length("gaussian", 12, 2)),
    "Gaussian, lay 4": Case(of_length("gaussian", 9, 4)),
    "Gaussian, lay 30": Case(of_length("gaussian", 9, 30), (2048, 128)),
    "Gaussian, lay 10": Case(of_length("gaussian", 9, 10), (1024, 128)),
    "Matern 4, lay 3": Case(of_length("matern", 10, 3, smoothness=4.0)),
    "Matern 2, l 20": Case(of_length("matern", 20, smoothness=2.0)),
    "H 0.8, 64 to 8, lay 10": Case(of_waves(0.8, 64, lay=10), (1024, 256)),
    "H 0.8, 32 to 8, lay 4": Case(of_waves(0.8, 32, lay=4)),
    "H 0.8, 512 to 8": Case(of_waves(0.8, 512), LARGE),
    "H 0.8, 256 to 8": Case(of_waves(0.8, 256), LARGE),
    "H 0.5, 256 to 8": Case(of_waves(0.5, 256), LARGE),
    "H 0.5, 512 to 8": Case(of_waves(0.5, 512), LARGE),
}


class Point(NamedTuple):
    """A measured scatter: load p*, window [nodes], CV with its standard error, T, B and nu; CV and A / A0 of cells."""

    surface: str
    load: float
    window: tuple[int, int]
    scatter: float
    error: float
    pairs: float
    bandwidth: float
    lay: float
    of_cell: float
    area: float


class Sums(NamedTuple):
    """Area and force : (cells, blocks along, blocks across), in nodes and in Pa."""

    area: np.ndarray
    force: np.ndarray

    def squares(self, window: tuple[int, int]) -> np.ndarray:
        """(cells,) mean square of the influence of windows of so many blocks."""
        a, f = (
            x.reshape(len(x), x.shape[1] // window[0], window[0], x.shape[2] // window[1], window[1]).sum(axis=(2, 4))
            for x in self
        )
        return np.mean(((a - self.area.sum() / self.force.sum() * f) / a.mean()) ** 2, axis=(1, 2))


def solved(grid: Grid, influence: Influence, heights: np.ndarray, slope: float, loads: Sequence[float]) -> np.ndarray:
    """(loads, 2, blocks along, blocks across) area and force of one surface, in nodes and in Pa."""
    pressures = [load * MODULUS * slope for load in loads]
    solutions = solve_loads(influence, cell_heights(heights, grid), pressures, TOLERANCE)
    return np.array([[_blocks(each.shares), _blocks(each.pressure)] for each in solutions])


def _blocks(field: np.ndarray) -> np.ndarray:
    """Sums over the blocks."""
    along, across = BLOCKS
    return field.reshape(along, field.shape[0] // along, across, field.shape[1] // across).sum(axis=(1, 3))


def points(name: str) -> list[Point]:
    """The scatter of every window at every load, of one surface."""
    (covariance, nodes), seed = SURFACES[name], list(SURFACES).index(name)
    edges = [count // blocks for count, blocks in zip(nodes, BLOCKS, strict=True)]
    rough, grid = scatter_law.roughness_of(covariance, 16.0 * NODE), Grid(*nodes, NODE, NODE)
    embedding, influence = embed_cell(covariance, grid), Influence(grid, MODULUS, periodic=True)
    share, rows = 1 if grid.size <= SMALL else 2, []
    for number in range(CELLS // share):
        heights = embedding.sample(np.random.default_rng([seed, number]))
        rows.append(solved(grid, influence, heights, rough.slope, LOADS))
    scatters = []
    for k, load in enumerate(LOADS):
        sums = Sums(*np.array([row[k] for row in rows]).swapaxes(0, 1))
        area = float(sums.area.mean()) / math.prod(edges)
        for window in WINDOWS:
            size = window[0] * edges[0], window[1] * edges[1]
            squares = sums.squares(window)
            scatter, error = math.sqrt(squares.mean()), _relative_error(squares) / 2.0
            of_cell = scatter * math.sqrt(math.prod(size) / grid.size)
            pairs = scatter_law.mean_over_window(covariance, rough, load, (size[0] * NODE, size[1] * NODE))
            of_surface = math.sqrt(pairs), rough.bandwidth, rough.lay
            scatters.append(Point(name, load, size, scatter, scatter * error, *of_surface, of_cell, area))
    return scatters


def _relative_error(values: np.ndarray) -> float:
    """Standard error of a mean over the mean."""
    return float(values.std(ddof=1) / math.sqrt(len(values)) / values.mean())


def check_mesh() -> dict[str, float]:
    """CV on cells of an eighth of the shortest wave over that on cells half as large, of the same heights."""
    grids = Grid(512, 256, 2 * NODE, 2 * NODE), Grid(1024, 512, NODE, NODE)
    covariance, seed = of_waves(0.8, 128, 16), len(SURFACES)
    slope = scatter_law.roughness_of(covariance, 16.0 * NODE).slope
    embedding, influences = (
        embed_cell(covariance, grids[1]),
        [Influence(grid, MODULUS, periodic=True) for grid in grids],
    )
    rows: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for number in range(CHECKED):
        z = embedding.sample(np.random.default_rng([seed, number]))
        for row, grid, influence, heights in zip(rows, grids, influences, (z[::2, ::2], z), strict=True):
            row.append(solved(grid, influence, heights, slope, CHECK_LOADS))
    coarse, fine = (_columns(row, 1) for row in rows)
    error = float(np.std(_relative(coarse) - _relative(fine), ddof=1)) / math.sqrt(CHECKED) / 2.0
    return {"ratio": _ratio(coarse, fine), "error": error}


def check_period() -> dict[str, float]:
    """CV in periodic cells of half the edges over that in whole ones, as many windows of each."""
    covariance, columns = of_waves(0.8, 64), []
    slope = scatter_law.roughness_of(covariance, 16.0 * NODE).slope
    for part in (2, 1):
        grid = Grid(512 // part, 256 // part, NODE, NODE)
        embedding, influence = embed_cell(covariance, grid), Influence(grid, MODULUS, periodic=True)
        seeds = ([len(SURFACES) + part, number] for number in range(CHECKED * part**2))
        samples = (embedding.sample(np.random.default_rng(seed)) for seed in seeds)
        columns.append(_columns([solved(grid, influence, z, slope, CHECK_LOADS) for z in samples], part))
    return {"ratio": _ratio(*columns), "error": math.hypot(*(_relative_error(_relative(x)) for x in columns)) / 2.0}


def _columns(rows: list[np.ndarray], part: int) -> np.ndarray:
    """(cells, loads times windows) squares of the influence. part : blocks are that many times smaller"""
    sums = [Sums(*row) for row in np.array(rows).transpose(1, 2, 0, 3, 4)]
    return np.array([each.squares((part * a, part * b)) for each in sums for a, b in WINDOWS]).T


def _relative(columns: np.ndarray) -> np.ndarray:
    """(cells,) squares over their means, in the mean of the columns."""
    return np.asarray((columns / columns.mean(axis=0)).mean(axis=1))


def _ratio(fine: np.ndarray, coarse: np.ndarray) -> float:
    """Of CV, in the geometric mean of the columns."""
    return float(np.exp(np.mean(np.log(fine.mean(axis=0) / coarse.mean(axis=0))) / 2.0))


def predicted(point: Point, fitted: Sequence[float]) -> float:
    """CV by the law."""
    rough = scatter_law.Roughness(1.0, point.bandwidth, point.lay, NODE)
    return math.sqrt(scatter_law.of_summits(rough, point.load, fitted)) * point.pairs


def fitted(measured: list[Point]) -> list[float]:
    """(a, b, k) by least squares of the logarithm, weighted by its error and FLOOR."""

    def residuals(constants: np.ndarray) -> list[float]:
        return [
            math.log(predicted(p, constants) / p.scatter) / math.hypot(p.error / p.scatter, FLOOR) for p in measured
        ]

    return [float(value) for value in least_squares(residuals, START).x]


def errors(judged: list[Point], constants: Sequence[float]) -> dict[str, float]:
    """Of the logarithm of CV: rms, mean, the part of the solved scatter, and rms without it."""
    logs = [math.log(predicted(p, constants) / p.scatter) for p in judged]
    rms, noise = (math.sqrt(np.mean(np.square(x))) for x in (logs, [p.error / p.scatter for p in judged]))
    law = math.sqrt(max(rms**2 - noise**2, 0.0))
    return {"rms": rms, "mean": float(np.mean(logs)), "noise": noise, "law": law, "points": len(judged)}


def widths(point: Point) -> str:
    """The edge of a square as large as the window over the correlation length of the heights."""
    edge = math.sqrt(math.prod(point.window) / math.prod(SURFACES[point.surface].covariance.lengths_m)) * NODE
    return "below 2" if edge < 2.0 else "2 to 8" if edge < 8.0 else "above 8"


def aspect(point: Point) -> float:
    """Correlation lengths along the lay over across."""
    along, across = SURFACES[point.surface].covariance.lengths_m
    return along / across


def shape(point: Point, name: str) -> str:
    """A shape of a self-affine covariance."""
    covariance = SURFACES[point.surface].covariance
    return f"{getattr(covariance, name):.2g}" if isinstance(covariance, SelfAffine) else "not self-affine"


def kind(point: Point) -> str:
    """The family of a surface."""
    family = {"not self-affine": KINDS[0], "0.8": KINDS[1]}.get(shape(point, "hurst"), KINDS[2])
    return family if aspect(point) < 1.01 else KINDS[3]


MAPS: dict[str, Callable[[Point], str]] = {  # of the surfaces that are judged
    "load": lambda point: f"{point.load:g}",
    "window": widths,
    "kind": kind,
    "lay": lambda point: f"{aspect(point):.0f}",
    "ratio": lambda point: shape(point, "bandwidth"),
    "hurst": lambda point: shape(point, "hurst"),
}


def summary(measured: list[Point]) -> dict[str, object]:
    """Constants of half of the surfaces, errors on the other half and of each surface, and all numbers."""
    half, taken = list(SURFACES)[::2], [point for point in measured if point.of_cell < MOST_OF_CELL]
    constants = fitted([point for point in taken if point.surface in half])
    judged = [point for point in taken if point.surface not in half]
    maps = {
        title: {key: errors([p for p in judged if of(p) == key], constants) for key in sorted({of(p) for p in judged})}
        for title, of in MAPS.items()
    }
    surfaces = {name: errors([p for p in taken if p.surface == name], constants) for name in SURFACES}
    laws = {
        "constants": constants,
        "constants_of_all": fitted(taken),
        "judged": errors(judged, constants),
        "maps": maps | {"surface": surfaces},
    }
    rows = [[*point, predicted(point, constants)] for point in measured]
    return laws | {"columns": [*Point._fields, "law"], "points": rows}


def rounded(value: Any) -> Any:
    """Numbers to five digits."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(each) for each in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def draw(measured: list[Point], constants: Sequence[float], files: list[Path]) -> None:
    """Solved against predicted scatter on one line; and their ratio over the load, of each surface."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
    half, colours = list(SURFACES)[::2], dict(zip(KINDS, ("C0", "C1", "C2", "C3"), strict=True))
    taken = [point for point in measured if point.of_cell < MOST_OF_CELL]
    law, scatter = ([f(p) for p in taken] for f in (lambda p: predicted(p, constants), lambda p: p.scatter))
    left.scatter(law, scatter, 4.0, [colours[kind(p)] for p in taken])
    ends = [0.9 * min(law), 1.1 * max(law)]
    left.plot(ends, ends, "k-", linewidth=0.8)
    left.set(xscale="log", yscale="log", xlabel="law", ylabel="solved cells")
    left.set_title("Coefficient of variation of friction")
    for place, name in enumerate(SURFACES):
        own = [p for p in taken if p.surface == name]
        loads = sorted({p.load for p in own})
        ratio = [np.mean([p.scatter / predicted(p, constants) for p in own if p.load == load]) for load in loads]
        shift = np.array(loads) * 1.008 ** (place - len(SURFACES) / 2)
        face = "none" if name in half else colours[kind(own[0])]
        right.plot(shift, ratio, "o", color=colours[kind(own[0])], markersize=4.0, markerfacecolor=face)
    for name, colour in colours.items():
        right.plot([], [], "o", color=colour, markersize=4.0, label=name)
    right.plot([], [], "o", color="k", markersize=4.0, markerfacecolor="none", label="fitted; full: judged")
    right.axhline(1.0, color="k", linewidth=0.8)
    right.set(xscale="log", xlabel="p / (E* h')", title="Solved over law, mean of windows", ylim=(0.7, 1.3))
    right.legend(fontsize="x-small", ncols=2)
    for file in files:
        figure.savefig(file, dpi=150)


def main() -> None:
    """Solve, fit, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="folder of law.json, law.png and law.svg")
    output: Path = parser.parse_args().output
    measured = [point for name in SURFACES for point in points(name)]
    results: dict[str, Any] = summary(measured) | {"mesh": check_mesh(), "period": check_period()}
    output.mkdir(parents=True, exist_ok=True)
    draw(measured, results["constants"], [output / "law.png", output / "law.svg"])
    (output / "law.json").write_text(json.dumps(rounded(results)) + "\n", encoding="utf-8")
    print(json.dumps(rounded({name: value for name, value in results.items() if name != "points"}), indent=1))


if __name__ == "__main__":
    main()
