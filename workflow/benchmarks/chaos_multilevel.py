"""Multilevel Monte Carlo over meshes, for mean pressure and contact area of the square of scene `resolved`.

E P_64 = E P_16 + E (P_32 - P_16) + E (P_64 - P_32), both meshes of a difference seeing the same surface: every second
node of the finer one. The law of the heights on a mesh is thus the same in both differences that it is part of, and the
sum is free of bias. With variances V_l and seconds C_l of a sample, a standard error e costs
(sum_l sqrt(V_l C_l))^2 / e^2 (M. B. Giles, Oper. Res. 56 (2008) 607), plain Monte Carlo V C / e^2.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np

from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.stages.from_scene import elastic
from roughslip.surface.karhunen_loeve import heights
from workflow.benchmarks import measure
from workflow.benchmarks.chaos_problem import PERCENTILES, TOLERANCE, Square
from workflow.benchmarks.measure import Row, case, row

SCENE = "resolved"
STRIDES = (4, 2, 1)  # meshes of 16, 32 and 64 nodes an axis, coarse to fine
STREAM = 24
QUANTITIES = ("mean_pressure", "area_fraction")
Pilot = tuple[np.ndarray, float]  # terms and seconds of one
BUDGET = 1000  # solves on the fine mesh whose cost both methods get
METHODS = ("monte_carlo", "multilevel")


class Mesh:
    """Every `stride`-th node of the square, on a mesh that covers it."""

    def __init__(self, square: Square, stride: int) -> None:
        grid = square.grid
        self.square, self.modes = square, np.ascontiguousarray(square.modes[:, ::stride, ::stride])
        shape = self.modes.shape[1:]
        mesh = Grid(shape[0], shape[1], stride * grid.dx, stride * grid.dy)
        self.influence = elastic.influence(square.configuration, mesh)

    def quantities(self, xi: np.ndarray, plane: float) -> np.ndarray:
        """Mean pressure [Pa] and share of the nodes in contact."""
        z = self.square.model.heights(heights(self.modes, xi))
        solution = solve(self.influence, z - plane, TOLERANCE)
        return np.array([solution.mean_pressure, solution.area_fraction])


def samples_of(meshes: Sequence[Mesh], level: int, plane: float, count: int) -> tuple[np.ndarray, float]:
    """Terms of the sum over the meshes, and the mean seconds of one.

    Returns differences : (count, quantities) from the next coarser mesh, on the first the quantities themselves.
    Samples of different levels, and of sums over different meshes, are independent.
    """
    square = meshes[level].square
    terms = np.empty((count, len(QUANTITIES)))
    start = time.perf_counter()
    for number in range(count):
        seed = [square.seed, STREAM, len(meshes), level, number]
        xi = np.random.default_rng(seed).standard_normal(len(square.modes))
        terms[number] = meshes[level].quantities(xi, plane)
        if level:
            terms[number] -= meshes[level - 1].quantities(xi, plane)
    return terms, (time.perf_counter() - start) / count


def allocation(variances: np.ndarray, costs: np.ndarray, budget: float) -> tuple[np.ndarray, float]:
    """Samples a level, as real numbers, for a budget in seconds, and the standard error that they leave."""
    total = float(np.sum(np.sqrt(variances * costs)))
    return budget * np.sqrt(variances / costs) / total, total / math.sqrt(budget)


def rows_of(count: int) -> list[Row]:
    """Rows of the relative standard error that the cost of BUDGET solves on the fine mesh leaves, for both methods.

    count : surfaces a level, a pilot run, from which variances and seconds are taken

    `estimate` and `standard_error` are those of the pilot; `gain` is what a given error costs in plain Monte Carlo over
    its cost here.
    """
    square, rows = Square.of(SCENE), []
    meshes = [Mesh(square, stride) for stride in STRIDES]
    for number, percentile in enumerate(PERCENTILES):
        plane = float(square.planes[number])
        for mesh in meshes:
            mesh.quantities(np.zeros(len(square.modes)), plane)
        plain = samples_of(meshes[-1:], 0, plane, count)
        levels = [samples_of(meshes, level, plane, count) for level in range(len(meshes))]
        for which, quantity in enumerate(QUANTITIES):
            label = case(scene=SCENE, percentile=f"{percentile:g}", quantity=quantity)
            rows += compared(label, *([(terms[:, which], cost) for terms, cost in part] for part in ([plain], levels)))
    return rows


def compared(label: str, plain: list[Pilot], levels: list[Pilot]) -> list[Row]:
    """Plain and multilevel row of a case, from terms and seconds of their levels."""
    budget, scale = BUDGET * plain[0][1], float(plain[0][0].mean())
    rows, errors = [], []
    for method, pilots in zip(METHODS, (plain, levels), strict=True):
        variances = np.array([terms.var(ddof=1) for terms, _ in pilots])
        counts, error = allocation(variances, np.array([cost for _, cost in pilots]), budget)
        errors.append(error)
        more = {
            "estimate": sum(float(terms.mean()) for terms, _ in pilots),
            "standard_error": math.sqrt(sum(terms.var(ddof=1) / len(terms) for terms, _ in pilots)),
            "variances": variances.tolist(),
            "level_seconds": [cost for _, cost in pilots],
            "level_samples": counts.tolist(),
            "gain": (errors[0] / error) ** 2,
        }
        rows.append(row(label, method, error / scale, [budget], round(float(counts.sum())), **more))
    measure.say(f"{label}: multilevel costs 1/{rows[-1]['gain']:.3g} of plain Monte Carlo at equal error")
    return rows
