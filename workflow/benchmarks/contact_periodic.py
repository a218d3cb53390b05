"""Measure contact of periodic cells under a load: squares and belts, light to half contact, elastic and yielding.

The only peer is Tamaas. Its matrix is that of continuous waves, ours that of cells, so each is judged with its own:
how far the conditions of contact are unmet, over the larger of ||max(z - plane, 0)|| and B_00 ||p||. Tamaas' solver of
limited pressures does not converge on these problems, so yielding cells are ours alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np
from scipy import fft

from roughslip.contact.influence import Influence
from roughslip.contact.periodic import periodic_symbol
from roughslip.contact.solve import solve_load
from roughslip.grid import Grid
from workflow.benchmarks.contact_peers import Problem, Tamaas, tune
from workflow.benchmarks.runner import OURS, Row, case, make_row, power, race

LENGTH = 6.0  # cells in a correlation length of the Gaussian covariance
LOADS = (0.01, 0.1, 0.3)  # over E* h': from 2 % to half contact
SHAPES = ((64, 64), (128, 128), (256, 256), (512, 512), (1024, 1024), (1920, 80))
QUICK = ((32, 32), (240, 10))
HARDNESS = 1.0  # over E* h'


class Waves:
    """u = B p wave by wave. diagonal : B_00; cells are squares of edge 1, and E* = 1"""

    modulus = 1.0

    def __init__(self, symbol: np.ndarray, shape: tuple[int, int]) -> None:
        self.symbol, self.shape = symbol, shape
        self.diagonal = float(fft.irfft2(symbol, shape)[0, 0])

    def residual(self, heights: np.ndarray, load: float, cap: float, pressure: np.ndarray) -> float:
        """Return the relative residual; infinite for pressures out of bounds or of another load."""
        wrong_load = abs(float(pressure.mean()) - load) > 1e-9 * load
        if wrong_load or pressure.min() < 0 or pressure.max() > cap:
            return math.inf
        gap = fft.irfft2(self.symbol * fft.rfft2(pressure), self.shape) - heights
        between = (pressure > 0) & (pressure < cap)
        if not between.any():
            return math.inf
        plane = -float(gap[between].mean())
        own = self.diagonal * pressure
        unmet = own - np.clip(own - gap - plane, 0.0, self.diagonal * cap)
        scale = max(np.linalg.norm(np.maximum(heights - plane, 0.0)), np.linalg.norm(own))
        return float(np.linalg.norm(unmet) / scale)

    def elastic(self, load: float, problem: Problem, pressure: np.ndarray) -> float:
        """Return the residual of elastic contact under a load, as `tune` asks for it."""
        return self.residual(problem.heights, load, math.inf, pressure)


def gaussian_heights(shape: tuple[int, int], seed: int) -> tuple[np.ndarray, float]:
    """Return heights of unit variance on a torus, and their root mean square slope."""
    q = 2 * np.pi * np.hypot(fft.fftfreq(shape[0])[:, None], fft.rfftfreq(shape[1]))
    noise = fft.rfft2(np.random.default_rng([seed, *shape]).standard_normal(shape))
    heights = fft.irfft2(noise * np.exp(-((q * LENGTH) ** 2) / 8), shape)
    return heights / heights.std(), 2 / LENGTH


def measure_cells(tolerances: Iterable[float], with_peers: bool, quick: bool) -> list[Row]:
    """Return rows of periodic cells, elastic with the peer, and yielding."""
    rows = []
    for shape in QUICK if quick else SHAPES:
        grid = Grid(*shape, 1.0, 1.0)
        influence, ours = Influence(grid, 1.0, periodic=True), Waves(periodic_symbol(grid, 1.0), shape)
        q = np.pi * np.hypot(fft.fftfreq(shape[0])[:, None], fft.rfftfreq(shape[1]))
        theirs = Waves(np.divide(1.0, q, out=np.zeros_like(q), where=q > 0), shape)
        peer = Tamaas(grid, theirs, periodic=True) if with_peers else None
        heights, slope = gaussian_heights(shape, 20261)
        for share, tolerance, limit in [(s, t, h) for h in (math.inf, HARDNESS) for s in LOADS for t in tolerances]:
            load, cap = share * slope, limit * slope
            problem = f"{shape[0]}x{shape[1]}"
            name = case(boundary="periodic", mesh=problem, load=share, hardness=limit, tolerance=power(tolerance))
            calls: dict[str, Any] = {OURS: partial(solve_load, influence, heights, load, tolerance, None, cap)}
            if peer and limit == math.inf:
                setting, error = tune(
                    peer, Problem(heights, 0.0), load, tolerance, tolerance, partial(theirs.elastic, load)
                )
                calls["tamaas/periodic"] = partial(peer.solve, Problem(heights, 0.0), load, setting)
            seconds, results = race(calls, quick)
            found = results[OURS]
            residual = ours.residual(heights, load, cap, found.pressure)
            rows.append(make_row(name, OURS, residual, seconds[OURS], found.work))
            if "tamaas/periodic" in calls:
                rows.append(make_row(name, "tamaas/periodic", error, seconds["tamaas/periodic"], setting=setting))
    return rows
