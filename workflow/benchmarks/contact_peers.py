"""Public solvers of the contact problem, each as its documentation says and with its tolerance as the one knob.

A peer is made once for a mesh, with its operator and plans; what then solves one surface is timed. All start cold.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Iterator
from typing import Protocol

import numpy as np

from roughslip.grid import Grid
from workflow.benchmarks.contact_problem import MODULUS, Convolution, Problem

MOST_ITERATIONS = 2000
MOST_LOADS = 40


class Peer(Protocol):
    """A solver on one mesh."""

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """Solve one problem from a cold start.

        load : the mean pressure at the solution [Pa], for methods that take it
        setting : the method's own tolerance
        counting : whether the count must be right; where counting costs time it is not done otherwise

        Returns pressure (nx, ny) [Pa], zero where the method gave up with an error, and applications of B.
        """

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """(nx, ny) [m] B p as the method computes it."""


class PolonskyKeer:
    """Conjugate gradients restarted at every node that comes into contact, in plain numpy.

    Polonsky and Keer, Wear 231 (1999) 206, at fixed penetration: the gap is not shifted, the load not scaled.
    """

    def __init__(self, grid: Grid) -> None:
        self.displacement = Convolution(grid, MODULUS)

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """Stops when the pressures change by less than `setting` of their sum, as the paper does."""
        interference = problem.interference
        pressure = np.maximum(interference, 0.0) / self.displacement.coefficients[0, 0]
        direction, length, conjugate, before = np.zeros_like(pressure), 0.0, False, 1.0
        for iteration in range(MOST_ITERATIONS):
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
                return pressure, 2 * iteration + 2
        return pressure, 2 * MOST_ITERATIONS


class Tamaas:
    """Tamaas' PolonskyKeerRey on the free half-space (`registerNonPeriodic`), handed the exact load: its best case.

    The solver object and its array of heights are made once; a problem overwrites the heights.
    """

    def __init__(self, grid: Grid) -> None:
        import tamaas

        tamaas.initialize(1)
        tamaas.set_log_level(tamaas.LogLevel.error)
        sizes = [grid.nx * grid.dx, grid.ny * grid.dy]
        self.model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, sizes, list(grid.shape))
        self.model.E, self.model.nu = MODULUS, 0.0
        tamaas.ModelFactory.registerNonPeriodic(self.model, "free")
        self.free = self.model.operators["free"]
        self.counted = _counting_operator(tamaas, self.model, self.free)
        self.model.operators["counted"] = self.counted
        self.heights = np.zeros(grid.shape)
        self.solvers = {}
        for operator in ("free", "counted"):
            self.solvers[operator] = tamaas.PolonskyKeerRey(self.model, self.heights, 1e-10)
            self.solvers[operator].setIntegralOperator(operator)
            self.solvers[operator].max_iter = MOST_ITERATIONS

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """(nx, ny) [m] B p by its operator."""
        self.model.traction[...] = pressure
        self.free(self.model.traction, self.model.displacement)
        return np.array(self.model.displacement)

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """Hands over the load; `setting` is the solver's own tolerance."""
        solver = self._start(problem, setting, counting)
        try:
            self._find(solver, problem, load, setting)
        except (ArithmeticError, RuntimeError):  # such as "a contact area of a single node"
            self.model.traction[...] = 0.0
        return np.nan_to_num(np.array(self.model.traction)), self.counted.count

    def _start(self, problem: Problem, setting: float, counting: bool) -> object:
        solver = self.solvers["counted" if counting else "free"]
        solver.tolerance = setting
        self.counted.count = 0
        self.heights[...] = problem.heights
        self.model.traction[...] = 0.0
        return solver

    def _find(self, solver: object, problem: Problem, load: float, setting: float) -> None:
        solver.solve(load)


class TamaasAtPenetration(Tamaas):
    """Tamaas where the plane is given and the load is not.

    Its constraint on the mean gap ends in NaN with the operator of the free half-space (2.9), and the mean gap of a
    penetration is not known anyway. So its user searches the load: secants on the height of the plane, which follows
    from the displacement as its documentation says; each solve starts from the pressures of the last.
    """

    def _find(self, solver: object, problem: Problem, load: float, setting: float) -> None:
        overlap = np.maximum(problem.interference, 0.0)
        reach, edge = overlap.max(), problem.grid.nx * problem.grid.dx
        last, load = 0.0, 3 * MODULUS * overlap.mean() / edge  # of a punch as large as the mesh about a third of it
        last_excess = float(problem.heights.max()) - problem.plane
        for _ in range(MOST_LOADS):
            solver.solve(load)
            operator = self.counted if solver is self.solvers["counted"] else self.free
            operator(self.model.traction, self.model.displacement)
            contact = self.model.traction > 0
            excess = float((problem.heights - self.model.displacement)[contact].mean()) - problem.plane
            if abs(excess) <= setting * reach or excess == last_excess:
                return
            slope = (excess - last_excess) / (load - last)
            last, load, last_excess = load, max(load - excess / slope, load / 10), excess


def _counting_operator(tamaas: object, model: object, inner: Callable) -> object:
    """The operator as one that counts how often it is applied; it costs some microseconds a time."""

    class Counting(tamaas.IntegralOperator):  # type: ignore[name-defined, misc]
        def __init__(self) -> None:
            super().__init__(model)
            self.count = 0

        def apply(self, source: np.ndarray, result: np.ndarray) -> None:
            self.count += 1
            inner(source, result)

        def __call__(self, source: np.ndarray, result: np.ndarray) -> None:
            self.apply(source, result)

        def updateFromModel(self) -> None:
            pass

        def getKind(self) -> object:
            return tamaas.IntegralOperator.neumann

        def getType(self) -> object:
            return tamaas.model_type.basic_2d

    return Counting()


class ContactMechanics:
    """ContactMechanics' dual problem at the given offset by Bugnicourt's conjugate gradients without restart."""

    def __init__(self, grid: Grid) -> None:
        import ContactMechanics
        from SurfaceTopography import Topography

        self.grid, self.sizes = grid, (grid.nx * grid.dx, grid.ny * grid.dy)
        self.substrate = ContactMechanics.FreeFFTElasticHalfSpace(grid.shape, MODULUS, self.sizes, fft="serial")
        self.make_system, self.topography = ContactMechanics.make_system, Topography
        self.count, self.apply = 0, self.substrate.evaluate_disp
        self.substrate.evaluate_disp = self._counted

    def _counted(self, forces: np.ndarray) -> np.ndarray:
        self.count += 1
        return self.apply(forces)

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """(nx, ny) [m] B p by its substrate, which takes forces."""
        return np.array(self.apply(-pressure * self.grid.cell_area))

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """`setting` is the bound of the gap in contact, relative to the largest interference."""
        self.count = 0
        with _silence():
            system = self.make_system(self.topography(problem.heights, self.sizes), self.substrate)
            forces = self._forces(system, problem, setting)
        return np.nan_to_num(np.asarray(forces).reshape(self.grid.shape)) / self.grid.cell_area, self.count

    def _forces(self, system: object, problem: Problem, setting: float) -> np.ndarray:
        start = np.zeros(self.grid.shape)
        bound = setting * float(problem.interference.max())
        found = system.dual_minimize_proxy(
            -problem.plane, start, solver="ccg-without-restart", gtol=bound, maxiter=MOST_ITERATIONS
        )
        return found.x


class ContactMechanicsPolonskyKeer(ContactMechanics):
    """Its default solver, `minimize_proxy`, at the given offset.

    Started from the overlap pressed cell by cell: from its own start it stalls on some meshes (128 x 128, median).
    """

    def _forces(self, system: object, problem: Problem, setting: float) -> np.ndarray:
        nx, ny = self.grid.shape
        overlap = np.maximum(problem.interference, 0.0)
        stiffness = self.grid.cell_area * MODULUS / np.sqrt(self.grid.cell_area)  # of a cell, in order of magnitude
        start = np.zeros((2 * nx, 2 * ny))
        start[:nx, :ny] = -stiffness * overlap
        bound = setting * float(overlap.max())
        found = system.minimize_proxy(
            offset=-problem.plane,
            initial_forces=start,
            pentol=bound,
            forcetol=stiffness * bound,
            thermotol=setting,
            maxiter=MOST_ITERATIONS,
        )
        return found.jac


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Their messages on the way are no news."""
    with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
        yield


PEERS: dict[str, Callable[[Grid], Peer]] = {
    "tamaas/load": Tamaas,
    "contactmechanics/bugnicourt": ContactMechanics,
    "tamaas/penetration": TamaasAtPenetration,
    "contactmechanics/polonsky-keer": ContactMechanicsPolonskyKeer,
    "polonsky-keer": PolonskyKeer,
}
