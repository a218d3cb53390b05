"""Measure the contact solver against public solvers at equal residual, and on larger meshes alone.

One process, one thread, in turns. One judge computes the residual of every method. It shares no code with any solver
except Love's coefficients. The tolerance of a peer is first tuned for each case to the loosest one that meets that of
the case. Setting up operators and transforms is not timed. Sq, E* and the edge only set units.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from functools import partial

import numpy as np
from scipy import fft
from scipy.optimize import bisect

from roughslip.contact.influence import Influence, love_coefficients
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of
from workflow.benchmarks.contact_peers import PEERS, Problem, tune
from workflow.benchmarks.contact_periodic import measure_cells
from workflow.benchmarks.runner import OURS, Row, case, make_row, power, race, summarise_speed

EDGE, RMS_HEIGHT, MODULUS = 100e-6, 0.5e-6, 2.3e11  # m, m, and Pa: E* of steel against a rigid plane
SEED = 20260
SURFACES = {
    "gauss": covariance_of(kind="gaussian", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 16),
    "exp": covariance_of(kind="exponential", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 64),
}
# The largest mesh on which a peer takes part, at the median and at other planes: what its time allows.
EXTENT = {"tamaas/load": (512, 256), "contactmechanics/bugnicourt": (512, 128), "polonsky-keer": (512, 128)}
SETTINGS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
TOLERANCES = (1e-6, 1e-10)
# Nodes on an edge with the peers, of ours alone, and of pressure error against time. Levels: per cent of the heights
# above the plane, or of nodes in contact.
NODES, GROWING, PRECISE = (64, 128, 256, 512), (1024, 2048), (128, 256)
LEVELS = ("5", "25", "50", "75", "95", "contact90")
QUICK = ((32,), (48,), (32,), ("50", "contact90"))


class Mesh:
    """What is set up once for a mesh: our operator, the judge's, and the peers."""

    def __init__(self, grid: Grid, peers: Iterable[str] = ()) -> None:
        self.grid = grid
        self.influence, self.displacement = Influence(grid, MODULUS), Convolution(grid, MODULUS)
        self.peers = {name: PEERS[name](grid, self.displacement) for name in peers if grid.nx <= EXTENT[name][0]}

    def problem(self, kind: str, level: str) -> Problem:
        """Return a surface, the same at every call, and its plane, to 0.1 % of Sq where it is one of contact."""
        rng = np.random.default_rng([SEED, list(SURFACES).index(kind), *self.grid.shape])
        z = embed(SURFACES[kind], self.grid).sample(rng)
        if level != "contact90":
            return Problem(z, float(np.percentile(z, 100 - float(level))))

        def excess(plane: float) -> float:
            return solve(self.influence, z - plane, 1e-5).area_fraction - 0.9

        high, depth = float(z.min()), 8 * float(z.std())
        while excess(high - depth) < 0:
            high, depth = high - depth, 2 * depth
        return Problem(z, float(bisect(excess, high - depth, high, xtol=1e-3 * float(z.std()))))

    def residual(self, problem: Problem, pressure: np.ndarray) -> float:
        """Return ||min(gap, B_00 p)|| / ||max(u_bar, 0)||: 1 without pressure, 0 at the solution."""
        gap = self.displacement(pressure) - problem.interference
        unmet = np.minimum(gap, self.displacement.diagonal * pressure)
        return float(np.linalg.norm(unmet) / np.linalg.norm(np.maximum(problem.interference, 0.0)))


class Convolution:
    """u = B p by transforms padded to twice the mesh (Hockney's method). diagonal, modulus : B_00, E*"""

    def __init__(self, grid: Grid, modulus: float) -> None:
        coefficients = love_coefficients(grid, modulus)
        self.modulus, self.diagonal, self.shape = modulus, coefficients[0, 0], grid.shape
        self.padded = (2 * grid.nx, 2 * grid.ny)
        i, j = (np.abs(fft.fftfreq(2 * n, 1 / (2 * n))).astype(int) % n for n in grid.shape)  # offset n is never used
        self.symbol = fft.rfft2(coefficients[i[:, None], j])

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Return displacements (nx, ny) [m] under pressures (nx, ny) [Pa]."""
        nx, ny = self.shape
        return fft.irfft2(fft.rfft2(pressure, self.padded) * self.symbol, self.padded)[:nx, :ny]


def square(n: int, peers: Iterable[str] = ()) -> Mesh:
    """Return a square mesh of n x n nodes."""
    return Mesh(Grid(n, n, EDGE / n, EDGE / n), peers)


def compare_solvers(cases: Iterable[tuple[int, str, str, float]], peers: Iterable[str], quick: bool) -> list[Row]:
    """Return rows of cases (n, surface, level, tolerance), with the peers that take part in each."""
    rows: list[Row] = []
    tuned: dict[tuple[str, str, str], float] = {}  # peer, surface, level: the setting last found, over the tolerance
    for n, of_mesh in itertools.groupby(cases, key=lambda entry: entry[0]):
        mesh = square(n, peers)
        for _, kind, level, tolerance in of_mesh:
            name, problem = case(n=n, surface=kind, level=level, tolerance=power(tolerance)), mesh.problem(kind, level)
            load = solve(mesh.influence, problem.interference, 1e-12).mean_pressure
            calls, trials = {OURS: partial(solve, mesh.influence, problem.interference, tolerance)}, {}
            for peer, solver in mesh.peers.items():
                if n <= EXTENT[peer][level != "50"]:
                    first = tolerance * tuned.get((peer, kind, level), 30.0)
                    trials[peer] = tune(solver, problem, load, tolerance, first, mesh.residual)
                    tuned[peer, kind, level] = trials[peer][0] / tolerance
                    calls[peer] = partial(solver.solve, problem, load, trials[peer][0])
            seconds, results = race(calls, quick, least=3 if level == "50" else 1)
            ours, error = results[OURS], mesh.residual(problem, results[OURS].pressure)
            rows.append(make_row(name, OURS, error, seconds[OURS], ours.work, solver=ours.method))
            for peer, (setting, residual) in trials.items():
                rows.append(make_row(name, peer, residual, seconds[peer], setting=setting))
    return rows


def pressure_errors(n: int, peers: Iterable[str], quick: bool) -> list[Row]:
    """Return rows of the relative error of the pressure at each method's own settings."""
    mesh, rows = square(n, peers), []
    problem, name = mesh.problem("gauss", "50"), case(n=n, surface="gauss", level="50", quantity="pressure")
    reference = solve(mesh.influence, problem.interference, 1e-13).pressure
    load, calls = float(reference.mean()), {}
    for setting in SETTINGS:
        calls[OURS, setting] = partial(solve, mesh.influence, problem.interference, setting)
        calls |= {(peer, setting): partial(one.solve, problem, load, setting) for peer, one in mesh.peers.items()}
    seconds, results = race(calls, quick)
    for (method, setting), found in results.items():
        pressure, work = (found.pressure, found.work) if method == OURS else (found, None)
        error = float(np.linalg.norm(pressure - reference) / np.linalg.norm(reference))
        rows.append(make_row(name, method, error, seconds[method, setting], work, setting=setting))
    return rows


def measure(quick: bool, with_peers: bool) -> dict[str, object]:
    """Return summary and rows."""
    nodes, growing, precise, levels = QUICK if quick else (NODES, GROWING, PRECISE, LEVELS)
    peers, median = tuple(PEERS) if with_peers else (), ("gauss", "50", TOLERANCES[-1])
    rows = compare_solvers(itertools.product(nodes, SURFACES, levels, TOLERANCES), peers, quick)
    rows += measure_cells(TOLERANCES, with_peers, quick)
    alone = compare_solvers([(n, *median) for n in growing], (), quick)
    errors = [row for n in precise for row in pressure_errors(n, peers, quick)]
    return {"summary": {"times_faster_than": summarise_speed(rows)}, "rows": rows + alone + errors}
