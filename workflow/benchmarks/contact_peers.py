"""Public solvers of the contact problem, used as documented, with their tolerance as the only setting.

The operator and the transforms of a peer are set up once for a mesh. Solving one surface, from a cold start, is timed.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from roughslip.grid import Grid
from workflow.benchmarks.contact_problem import MODULUS, Convolution, Judge, Problem

MOST_ITERATIONS = 2000
STEP = 4.0  # from one setting to the next: one or two iterations
MOST_TRIALS = 10


class Peer(Protocol):
    """A solver on one mesh."""

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """Solve one problem from a cold start.

        load : [Pa] mean pressure at the solution, for methods whose input it is
        setting : the method's own tolerance
        counting : whether the count must be right; counting may cost time

        Returns pressure (nx, ny) [Pa], zero if the method failed, and applications of B.
        """


class PolonskyKeer:
    """Conjugate gradients in plain numpy, restarted at every node that comes into contact.

    Polonsky and Keer, Wear 231 (1999) 206, at fixed penetration: the gap is not shifted and the load is not scaled.
    """

    def __init__(self, grid: Grid) -> None:
        self.displacement = Convolution(grid, MODULUS)

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """Stop, as the paper does, when the pressures change by less than `setting` times their sum."""
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
    """Tamaas' PolonskyKeerRey on the free half-space (`registerNonPeriodic`) at the exact load, its best case.

    The solver and its array of heights are made once; each problem overwrites the heights.
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

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """Solve at the given load."""
        solver = self.solvers["counted" if counting else "free"]
        solver.tolerance = setting
        self.counted.count = 0
        self.heights[...] = problem.heights
        self.model.traction[...] = 0.0
        try:
            solver.solve(load)
        except (ArithmeticError, RuntimeError):  # for example, a contact area of a single node
            self.model.traction[...] = 0.0
        return np.nan_to_num(np.array(self.model.traction)), self.counted.count


def _counting_operator(tamaas: object, model: object, inner: Callable) -> object:
    """Wrap the operator to count its applications, which costs some microseconds each."""

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
    """ContactMechanics: the dual problem at a given offset, by Bugnicourt's conjugate gradients without restart."""

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

    def solve(self, problem: Problem, load: float, setting: float, counting: bool = False) -> tuple[np.ndarray, int]:
        """Solve at the given plane; `setting` bounds the gap in contact over the largest interference."""
        self.count = 0
        with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            system = self.make_system(self.topography(problem.heights, self.sizes), self.substrate)
            found = system.dual_minimize_proxy(
                -problem.plane,
                np.zeros(self.grid.shape),
                solver="ccg-without-restart",
                gtol=setting * float(problem.interference.max()),
                maxiter=MOST_ITERATIONS,
            )
        return np.nan_to_num(np.asarray(found.x).reshape(self.grid.shape)) / self.grid.cell_area, self.count


PEERS: dict[str, Callable[[Grid], Peer]] = {
    "tamaas/load": Tamaas,
    "contactmechanics/bugnicourt": ContactMechanics,
    "polonsky-keer": PolonskyKeer,
}


class Trial(NamedTuple):
    """A solve at a setting: the residual that it reached, and its applications of B."""

    setting: float
    residual: float
    work: int


def tune(peer: Peer, problem: Problem, load: float, tolerance: float, first: float, judge: Judge) -> Trial:
    """Return the loosest setting of a peer that meets the tolerance, to STEP; if none does, that of least residual.

    first : the setting to start from, which is loosened while it meets the tolerance, or else tightened until it does
    """
    trials: list[Trial] = []
    for number in range(MOST_TRIALS):
        factor = STEP if trials and trials[0].residual <= tolerance else 1 / STEP
        setting = first * factor**number
        pressure, work = peer.solve(problem, load, setting, counting=True)
        trials.append(Trial(setting, judge.residual(problem, pressure), work))
        if number and (trials[-1].residual <= tolerance) != (trials[0].residual <= tolerance):
            break
    met = [trial for trial in trials if trial.residual <= tolerance]
    return max(met, default=min(trials, key=lambda trial: trial.residual))
