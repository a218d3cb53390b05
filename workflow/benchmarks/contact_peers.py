"""Other solvers of the contact problem, used as documented, with their tolerance as the only setting.

A peer is set up once for a mesh. `solve(problem, load, setting)` solves one problem from a cold start, and returns the
pressure (nx, ny) [Pa], zero if the method failed. `load` [Pa] is the mean pressure at the solution, for methods whose
input it is.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from roughslip.grid import Grid

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
            found = system.dual_minimize_proxy(-problem.plane, np.zeros(self.grid.shape), **options)
        return np.nan_to_num(np.asarray(found.x).reshape(self.grid.shape)) / self.grid.cell_area


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
