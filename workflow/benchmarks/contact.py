"""Measure the contact solver against public solvers at equal residual, and on larger meshes alone.

One process, one thread, in turns. One judge computes the residual of every method. It shares no code with any solver
except Love's coefficients. The tolerance of a peer is first tuned for each case to the loosest one that meets that of
the case. Setting up operators and transforms is not timed. Sq, E* and the edge only set units.

Peers are used as documented, with their tolerance as the only setting. A peer is set up once for a mesh.
`solve(problem, load, setting)` solves one problem from a cold start, and returns the pressure (nx, ny) [Pa], zero if
the method failed. `load` [Pa] is the mean pressure at the solution, for methods whose input it is.

Periodic cells under a load: squares and belts, light to half contact, elastic and yielding. The only peer is Tamaas.
Its matrix is that of continuous waves, ours that of cells, so each is judged with its own: how far the conditions of
contact are unmet, over the larger of ||max(z - plane, 0)|| and B_00 ||p||. Tamaas' solver of limited pressures does not
converge on these problems, so yielding cells are ours alone.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import fft
from scipy.optimize import bisect

from roughslip.contact.influence import Influence, love_coefficients
from roughslip.contact.periodic import periodic_symbol
from roughslip.contact.solve import solve, solve_load
from roughslip.grid import Grid
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of
from workflow.benchmarks.runner import OURS, Row, case, make_row, power, race, summarise_speed

MOST_ITERATIONS = 2000
STEP = 4.0  # from one setting to the next: one or two iterations
MOST_TRIALS = 10


class Problem(NamedTuple):
    """A surface (nx, ny) [m] and the height of the plane [m]."""

    heights: np.ndarray
    plane: float

    @property
    def interference(self) -> np.ndarray:
        """(nx, ny) [m] u_bar, height of the surface over the plane."""
        return self.heights - self.plane


class PolonskyKeer:
    """Conjugate gradients in plain numpy, restarted at every node that comes into contact.

    Polonsky and Keer, Wear 231 (1999) 206, at fixed penetration: the gap is not shifted and the load is not scaled.
    displacement : B with its `diagonal`
    """

    def __init__(self, _: Grid, displacement: Any) -> None:
        self.displacement = displacement

    def solve(self, problem: Problem, load: float, setting: float) -> np.ndarray:
        """Stop, as the paper does, when the pressures change by less than `setting` times their sum."""
        interference = problem.interference
        pressure = np.maximum(interference, 0.0) / self.displacement.diagonal
        direction, length, conjugate, before = np.zeros_like(pressure), 0.0, False, 1.0
        for _ in range(MOST_ITERATIONS):
            gap = self.displacement(pressure) - interference
            contact = pressure > 0
            square = float((gap[contact] ** 2).sum())
            direction = np.where(contact, gap + conjugate * square / before * direction, 0.0)
            product = self.displacement(direction)
            length = float((gap * direction).sum() / (direction * product).sum())
            last, pressure = pressure, np.maximum(pressure - length * direction, 0.0)
            overlap = (pressure == 0) & (gap < 0)
            conjugate, before = not overlap.any(), square
            pressure[overlap] -= length * gap[overlap]
            if np.abs(pressure - last).sum() <= setting * pressure.sum():
                break
        return pressure


class Tamaas:
    """Tamaas' PolonskyKeerRey at the exact load, its best case; on the free half-space by `registerNonPeriodic`."""

    def __init__(self, grid: Grid, displacement: Any, periodic: bool = False) -> None:
        import tamaas

        tamaas.initialize(1)
        tamaas.set_log_level(tamaas.LogLevel.error)
        sizes = [grid.nx * grid.dx, grid.ny * grid.dy]
        self.model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, sizes, list(grid.shape))
        self.model.E, self.model.nu = displacement.modulus, 0.0
        self.heights = np.zeros(grid.shape)  # each problem overwrites it
        self.solver = tamaas.PolonskyKeerRey(self.model, self.heights, 1e-10)
        if not periodic:
            tamaas.ModelFactory.registerNonPeriodic(self.model, "free")
            self.solver.setIntegralOperator("free")
        self.solver.max_iter = MOST_ITERATIONS

    def solve(self, problem: Problem, load: float, setting: float) -> np.ndarray:
        """Solve at the given load."""
        self.solver.tolerance = setting
        self.heights[...] = problem.heights
        self.model.traction[...] = 0.0
        try:
            self.solver.solve(load)
        except (ArithmeticError, RuntimeError):  # for example, a contact area of a single node
            self.model.traction[...] = 0.0
        return np.nan_to_num(np.array(self.model.traction))


class ContactMechanics:
    """ContactMechanics: the dual problem at a given offset, by Bugnicourt's conjugate gradients without restart."""

    def __init__(self, grid: Grid, displacement: Any) -> None:
        import ContactMechanics
        from SurfaceTopography import Topography

        self.grid, self.sizes = grid, (grid.nx * grid.dx, grid.ny * grid.dy)
        self.substrate = ContactMechanics.FreeFFTElasticHalfSpace(
            grid.shape, displacement.modulus, self.sizes, fft="serial"
        )
        self.make_system, self.topography = ContactMechanics.make_system, Topography

    def solve(self, problem: Problem, load: float, setting: float) -> np.ndarray:
        """Solve at the given plane; `setting` bounds the gap in contact over the largest interference."""
        gap = setting * float(problem.interference.max())
        options = {"solver": "ccg-without-restart", "gtol": gap, "maxiter": MOST_ITERATIONS}
        with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            system = self.make_system(self.topography(problem.heights, self.sizes), self.substrate)
            solution = system.dual_minimize_proxy(-problem.plane, np.zeros(self.grid.shape), **options)
        return np.nan_to_num(np.asarray(solution.x).reshape(self.grid.shape)) / self.grid.cell_area


PEERS: dict[str, Callable[[Grid, Any], Any]] = {
    "tamaas/load": Tamaas,
    "contactmechanics/bugnicourt": ContactMechanics,
    "polonsky-keer": PolonskyKeer,
}


def tune(
    peer: Any,
    problem: Problem,
    load: float,
    tolerance: float,
    first: float,
    residual: Callable[[Problem, np.ndarray], float],
) -> tuple[float, float]:
    """Return the loosest setting of a peer that meets the tolerance, to STEP, and its residual.

    If no setting does, it is that of least residual. The search starts at `first`, which is loosened while it meets the
    tolerance, or else tightened until it does.
    """
    trials: list[tuple[float, float]] = []
    for number in range(MOST_TRIALS):
        factor = STEP if trials and trials[0][1] <= tolerance else 1 / STEP
        setting = first * factor**number
        trials.append((setting, residual(problem, peer.solve(problem, load, setting))))
        if number and (trials[-1][1] <= tolerance) != (trials[0][1] <= tolerance):
            break
    return max((trial for trial in trials if trial[1] <= tolerance), default=min(trials, key=lambda trial: trial[1]))


LENGTH = 6.0  # cells in a correlation length of the Gaussian covariance
LOADS = (0.01, 0.1, 0.3)  # over E* h': from 2 % to half contact
SHAPES = ((64, 64), (128, 128), (256, 256), (512, 512), (1024, 1024), (1920, 80))
QUICK_SHAPES = ((32, 32), (240, 10))
HARDNESS = 1.0  # over E* h'


class Response:
    """u = B p by transforms. symbol : of B on a mesh of this size; shape : of pressures; modulus, diagonal : E*, B_00

    On the free half-space the mesh is padded to twice the pressures (Hockney's method). A period has no padding.
    """

    def __init__(self, symbol: np.ndarray, shape: tuple[int, int], size: tuple[int, int], modulus: float) -> None:
        self.symbol, self.shape, self.size, self.modulus = symbol, shape, size, modulus
        self.diagonal = float(fft.irfft2(symbol, size)[0, 0])

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Return displacements (nx, ny) [m] under pressures (nx, ny) [Pa]."""
        nx, ny = self.shape
        return fft.irfft2(fft.rfft2(pressure, self.size) * self.symbol, self.size)[:nx, :ny]

    def residual(self, problem: Problem, pressure: np.ndarray) -> float:
        """Return ||min(gap, B_00 p)|| / ||max(u_bar, 0)||: 1 without pressure, 0 at the solution."""
        unmet = np.minimum(self(pressure) - problem.interference, self.diagonal * pressure)
        return float(np.linalg.norm(unmet) / np.linalg.norm(np.maximum(problem.interference, 0.0)))

    def residual_under(self, load: float, cap: float, problem: Problem, pressure: np.ndarray) -> float:
        """Return the same under a load, at the plane of the solution; infinite out of bounds or of another load.

        ||B_00 p|| replaces the norm of what lies above the plane where it is larger.
        """
        between = (pressure > 0) & (pressure < cap)
        wrong_load = abs(float(pressure.mean()) - load) > 1e-9 * load
        if wrong_load or pressure.min() < 0 or pressure.max() > cap or not between.any():
            return math.inf
        gap = self(pressure) - problem.heights
        plane = -float(gap[between].mean())
        own = self.diagonal * pressure
        unmet = own - np.clip(own - gap - plane, 0.0, self.diagonal * cap)
        scale = max(np.linalg.norm(np.maximum(problem.heights - plane, 0.0)), np.linalg.norm(own))
        return float(np.linalg.norm(unmet) / scale)


def half_space(grid: Grid, modulus: float) -> Response:
    """Return the response of the free half-space, from Love's coefficients."""
    i, j = (np.abs(fft.fftfreq(2 * n, 1 / (2 * n))).astype(int) % n for n in grid.shape)  # offset n is never used
    symbol = fft.rfft2(love_coefficients(grid, modulus)[i[:, None], j])
    return Response(symbol, grid.shape, (2 * grid.nx, 2 * grid.ny), modulus)


def gaussian_heights(shape: tuple[int, int], seed: int) -> tuple[np.ndarray, float]:
    """Return heights of unit variance on a torus, and their root mean square slope."""
    q = 2 * np.pi * np.hypot(fft.fftfreq(shape[0])[:, None], fft.rfftfreq(shape[1]))
    noise = fft.rfft2(np.random.default_rng([seed, *shape]).standard_normal(shape))
    heights = fft.irfft2(noise * np.exp(-((q * LENGTH) ** 2) / 8), shape)
    return heights / heights.std(), 2 / LENGTH


def measure_cells(tolerances: Iterable[float], with_peers: bool, quick: bool) -> list[Row]:
    """Return rows of periodic cells, elastic with the peer, and yielding."""
    rows = []
    for shape in QUICK_SHAPES if quick else SHAPES:
        grid = Grid(*shape, 1.0, 1.0)
        influence = Influence(grid, 1.0, periodic=True)
        q = np.pi * np.hypot(fft.fftfreq(shape[0])[:, None], fft.rfftfreq(shape[1]))
        symbols = periodic_symbol(grid, 1.0), np.divide(1.0, q, out=np.zeros_like(q), where=q > 0)
        ours, theirs = (Response(symbol, shape, shape, 1.0) for symbol in symbols)
        peer = Tamaas(grid, theirs, periodic=True) if with_peers else None
        heights, slope = gaussian_heights(shape, 20261)
        for share, tolerance, limit in [(s, t, h) for h in (math.inf, HARDNESS) for s in LOADS for t in tolerances]:
            load, cap = share * slope, limit * slope
            problem = f"{shape[0]}x{shape[1]}"
            name = case(boundary="periodic", mesh=problem, load=share, hardness=limit, tolerance=power(tolerance))
            calls: dict[str, Any] = {OURS: partial(solve_load, influence, heights, load, tolerance, None, cap)}
            if peer and limit == math.inf:
                judge = partial(theirs.residual_under, load, math.inf)
                setting, error = tune(peer, Problem(heights, 0.0), load, tolerance, tolerance, judge)
                calls["tamaas/periodic"] = partial(peer.solve, Problem(heights, 0.0), load, setting)
            seconds, results = race(calls, quick)
            solution = results[OURS]
            residual = ours.residual_under(load, cap, Problem(heights, 0.0), solution.pressure)
            rows.append(make_row(name, OURS, residual, seconds[OURS], solution.work))
            if "tamaas/periodic" in calls:
                rows.append(make_row(name, "tamaas/periodic", error, seconds["tamaas/periodic"], setting=setting))
    return rows


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
        self.influence, self.displacement = Influence(grid, MODULUS), half_space(grid, MODULUS)
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
                    trials[peer] = tune(solver, problem, load, tolerance, first, mesh.displacement.residual)
                    tuned[peer, kind, level] = trials[peer][0] / tolerance
                    calls[peer] = partial(solver.solve, problem, load, trials[peer][0])
            seconds, results = race(calls, quick, least=3 if level == "50" else 1)
            ours, error = results[OURS], mesh.displacement.residual(problem, results[OURS].pressure)
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
        calls |= {(peer, setting): partial(solver.solve, problem, load, setting) for peer, solver in mesh.peers.items()}
    seconds, results = race(calls, quick)
    for (method, setting), solution in results.items():
        pressure, work = (solution.pressure, solution.work) if method == OURS else (solution, None)
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
