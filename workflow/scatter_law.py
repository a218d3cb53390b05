"""The law of scatter against solved cells: `snakemake scatter_law`, some six minutes on one core.

Periodic cells of sixteen surfaces are solved under six loads, the same heights at all of them. The three constants of
`roughslip.friction.scatter_law` are fitted to every second surface and judged on the others. Written are law.json, with
every measured and every predicted scatter, and a figure.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np

from roughslip.contact.influence import Influence
from roughslip.contact.loads import solve_loads
from roughslip.contact.periodic import cell_heights
from roughslip.friction import scatter_law
from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed_cell
from roughslip.surface.models import covariance_of, self_affine

CELL = 1e-6  # [m]; lengths below are in cells
GRID = Grid(512, 256, CELL, CELL)
BLOCK = 16  # cells of the edge of the least window
WINDOWS = ((2, 2), (4, 1), (4, 2), (4, 4), (8, 4))  # blocks along and across
LOADS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)  # p / (E* h')
CELLS = 48  # of each surface: 3 % of the scatter of windows at medium loads
TOLERANCE = 1e-4
MODULUS = 1e11  # any: scatter depends on p / (E* h') alone
FITTED_FROM = 3e-3  # below, a cell has some ten contacts, and their number is that of the cell
FLOOR = 0.03  # of CV, added to its standard error: meshes and periods


def of_waves(longest: float, shortest: float, hurst: float) -> Covariance:
    """A self-affine covariance between two wavelengths, with a constant spectrum from the longer one on."""
    return self_affine(CELL, hurst, longest * CELL, shortest * CELL)


def of_length(kind: str, length: float, across: float | None = None, **shapes: float) -> Covariance:
    """A covariance of a correlation length, and of another one across."""
    return covariance_of(kind, CELL, length * CELL, None if across is None else across * CELL, **shapes)


SURFACES = {
    "Gaussian, l 12": of_length("gaussian", 12),
    "Gaussian, l 18": of_length("gaussian", 18),
    "H 0.8, waves 16 to 8": of_waves(16, 8, 0.8),
    "H 0.8, waves 32 to 8": of_waves(32, 8, 0.8),
    "H 0.8, waves 64 to 8": of_waves(64, 8, 0.8),
    "H 0.8, waves 64 to 16": of_waves(64, 16, 0.8),
    "H 0.8, waves 128 to 8": of_waves(128, 8, 0.8),
    "H 0.8, waves 128 to 16": of_waves(128, 16, 0.8),
    "H 0.2, waves 64 to 8": of_waves(64, 8, 0.2),
    "H 0.5, waves 64 to 8": of_waves(64, 8, 0.5),
    "H 1, waves 64 to 8": of_waves(64, 8, 1.0),
    "Matern 4, l 12": of_length("matern", 12, smoothness=4.0),
    "Matern 3, l 16": of_length("matern", 16, smoothness=3.0),
    "Gaussian, l 36 by 9": of_length("gaussian", 36, 9),
    "Gaussian, l 24 by 12": of_length("gaussian", 24, 12),
    "Matern 4, l 30 by 10": of_length("matern", 30, 10, smoothness=4.0),
}


class Point(NamedTuple):
    """A measured scatter: load p*, window [cells], CV with its standard error, theory without constants."""

    surface: str
    load: float
    window: tuple[int, int]
    scatter: float
    error: float
    theory: float
    bandwidth: float


def blocks(field: np.ndarray) -> np.ndarray:
    """Sums over the blocks."""
    return field.reshape(GRID.nx // BLOCK, BLOCK, GRID.ny // BLOCK, BLOCK).sum(axis=(1, 3))


def solved(covariance: Covariance, slope: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Area and force : (CELLS, LOADS, blocks along, blocks across) in cells of the mesh and in Pa."""
    embedding, influence = embed_cell(covariance, GRID), Influence(GRID, MODULUS, periodic=True)
    areas, forces = [], []
    for number in range(CELLS):
        heights = cell_heights(embedding.sample(np.random.default_rng([seed, number])), GRID)
        solutions = solve_loads(influence, heights, [load * MODULUS * slope for load in LOADS], TOLERANCE)
        areas.append([blocks(solution.shares) for solution in solutions])
        forces.append([blocks(solution.pressure) for solution in solutions])
    return np.array(areas), np.array(forces)


def points(name: str, seed: int) -> Iterator[Point]:
    """The scatter of every window at every load, of one surface."""
    covariance = SURFACES[name]
    rough = scatter_law.roughness_of(covariance, BLOCK * CELL)
    area, force = solved(covariance, rough.slope, seed)
    for along, across in WINDOWS:
        a, f = (
            x.reshape(*x.shape[:2], x.shape[2] // along, along, x.shape[3] // across, across).sum(axis=(3, 5))
            for x in (area, force)
        )
        for k, load in enumerate(LOADS):
            mean = a[:, k].sum() / f[:, k].sum()
            square = np.mean(((a[:, k] - mean * f[:, k]) / a[:, k].mean()) ** 2, axis=(1, 2))
            scatter, error = math.sqrt(square.mean()), square.std(ddof=1) / math.sqrt(CELLS) / square.mean() / 2.0
            edges = along * BLOCK, across * BLOCK
            theory = scatter_law.mean_over_window(covariance, rough, load, (edges[0] * CELL, edges[1] * CELL))
            yield Point(name, load, edges, scatter, scatter * error, math.sqrt(theory), rough.bandwidth)


def fitted(measured: list[Point]) -> np.ndarray:
    """(a, b, c) of CV = a p*^b alpha^c times theory, by least squares of the logarithm."""
    used = [point for point in measured if point.load >= FITTED_FROM]
    matrix = np.array([[1.0, math.log(point.load), math.log(point.bandwidth)] for point in used])
    ratio = np.log([point.scatter / point.theory for point in used])
    weight = 1.0 / np.hypot([point.error / point.scatter for point in used], FLOOR)
    found = np.linalg.lstsq(matrix * weight[:, None], ratio * weight, rcond=None)[0]
    return np.array([math.exp(found[0]), found[1], found[2]])


def predicted(point: Point, constants: np.ndarray) -> float:
    """CV by the law."""
    return float(constants[0] * point.load ** constants[1] * point.bandwidth ** constants[2] * point.theory)


def summary(measured: list[Point]) -> dict[str, object]:
    """Constants of half of the surfaces, errors on the other half by load, and all numbers."""
    half = list(SURFACES)[::2]
    constants = fitted([point for point in measured if point.surface in half])
    judged = [point for point in measured if point.surface not in half]
    errors = {}
    for load in LOADS:
        logs = [math.log(predicted(p, constants) / p.scatter) for p in judged if p.load == load]
        noise = [p.error / p.scatter for p in judged if p.load == load]
        errors[f"{load:g}"] = {"rms": float(np.std(logs)), "mean": float(np.mean(logs)), "noise": float(np.mean(noise))}
    kept = [math.log(predicted(p, constants) / p.scatter) for p in judged if p.load >= FITTED_FROM]
    return {
        "constants": [round(float(value), 4) for value in constants],
        "constants_of_all": [round(float(value), 4) for value in fitted(measured)],
        "rms_error_judged": float(np.sqrt(np.mean(np.square(kept)))),
        "by_load": errors,
        "points": [_rounded(point._asdict() | {"law": predicted(point, constants)}) for point in measured],
    }


def _rounded(row: dict[str, Any]) -> dict[str, Any]:
    """Numbers to five digits."""
    return {name: float(f"{value:.5g}") if isinstance(value, float) else value for name, value in row.items()}


def draw(found: dict[str, object], files: list[Path]) -> None:
    """Measured against predicted scatter, and their ratio over the load."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    rows: Any = found["points"]
    law, scatter, load = (np.array([row[name] for row in rows]) for name in ("law", "scatter", "load"))
    surface = np.array([row["surface"] for row in rows])
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
    for each in LOADS:
        left.plot(law[load == each], scatter[load == each], ".", label=f"{each:g}")
    ends = [0.9 * law.min(), 1.1 * law.max()]
    left.plot(ends, ends, "k-", linewidth=0.8)
    left.set(xscale="log", yscale="log", xlabel="law", ylabel="solved cells")
    left.set_title("Coefficient of variation of friction")
    left.legend(title="p / (E* h')", fontsize="small")
    for name, colour in zip(SURFACES, mpl.colormaps["tab20"].colors, strict=False):
        ratio = [np.mean((scatter / law)[(surface == name) & (load == each)]) for each in LOADS]
        right.plot(LOADS, ratio, "-", color=colour, linewidth=1.0, label=name)
    right.axhline(1.0, color="k", linewidth=0.8)
    right.set(xscale="log", xlabel="p / (E* h')", title="Solved over law, mean of windows")
    right.legend(fontsize="xx-small", ncols=2)
    for file in files:
        figure.savefig(file, dpi=150)


def main() -> None:
    """Solve, fit, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="folder of law.json, law.png and law.svg")
    output: Path = parser.parse_args().output
    measured = [point for seed, name in enumerate(SURFACES) for point in points(name, seed)]
    found = summary(measured)
    output.mkdir(parents=True, exist_ok=True)
    draw(found, [output / "law.png", output / "law.svg"])
    (output / "law.json").write_text(json.dumps(found) + "\n", encoding="utf-8")
    print(json.dumps({name: value for name, value in found.items() if name != "points"}, indent=1))


if __name__ == "__main__":
    main()
