"""Elastic contact of a rough half-space with a rigid plane: one plane, or several planes of one surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roughslip.contact import conjugate_gradients, dense
from roughslip.contact.influence import Influence
from roughslip.contact.residual import relative_residual
from roughslip.errors import ConvergenceError, ParameterError

# Nodes of positive interference up to which the dense method is used. Its time over that of conjugate gradients: 0.03
# at 150 nodes, 0.05 to 0.2 at 400, 0.25 at 900; they break even between 1200 and 1800 (64 x 64 to 1920 x 20).
DENSE_LIMIT = 1000


@dataclass(frozen=True)
class ContactSolution:
    """Pressures and gaps of one surface and one plane.

    pressure : (nx, ny) [Pa] never negative, exactly zero off contact
    gap : (nx, ny) [m] between the deformed surface and the plane, zero in contact up to the residual
    residual : ||min(gap, B_00 p)|| / ||max(u_bar, 0)|| of these very fields, gap = B p - u_bar taken afresh
    work : Cholesky factors ("dense") or products with B ("fft")
    method : "none" (no contact), "dense" or "fft"
    """

    pressure: np.ndarray
    gap: np.ndarray
    residual: float
    work: int
    method: str

    @property
    def contact(self) -> np.ndarray:
        """(nx, ny) where the pressure is positive."""
        return self.pressure > 0

    @property
    def area_fraction(self) -> float:
        """Nodes in contact per node."""
        return np.count_nonzero(self.pressure) / self.pressure.size

    @property
    def mean_pressure(self) -> float:
        """Normal force per nominal area [Pa]."""
        return float(self.pressure.mean())


def solve(
    influence: Influence,
    interference: np.ndarray,
    tolerance: float = 1e-10,
    initial_pressure: np.ndarray | None = None,
) -> ContactSolution:
    """Find p >= 0 with gap = B p - u_bar >= 0 and p gap = 0.

    influence : B of the mesh
    interference : (nx, ny) [m] u_bar, height of the surface over the plane
    tolerance : largest residual accepted, relative to the interference
    initial_pressure : (nx, ny) [Pa] a guess, not negative; used on large meshes only

    Returns the solution, by the dense method up to DENSE_LIMIT nodes of positive interference. A surface that does not
    reach the plane costs nothing. Raises ParameterError for input that is not finite or has the wrong shape,
    ConvergenceError where the residual stays above the tolerance.
    """
    interference = _field("interference", interference, influence)
    if not 0 < tolerance < 1:
        raise ParameterError(f"the tolerance of a contact solve must lie in (0, 1), not {tolerance}")
    if initial_pressure is not None:
        initial_pressure = _field("initial pressure", initial_pressure, influence)
        if (initial_pressure < 0).any():
            raise ParameterError("the initial pressure must not be negative")

    candidates = np.count_nonzero(interference > 0)
    if candidates == 0:
        return ContactSolution(np.zeros(influence.grid.shape), 0.0 - interference, 0.0, 0, "none")
    if candidates <= DENSE_LIMIT:
        method = "dense"
        pressure, work = dense.solve(influence, interference)
        gap = influence.apply(pressure) - interference
    else:
        method = "fft"
        pressure, gap, work = conjugate_gradients.solve(influence, interference, tolerance, initial_pressure)
    residual = relative_residual(gap, pressure, influence.diagonal, interference)
    if not residual <= tolerance:
        raise ConvergenceError(
            f"the contact residual is above the tolerance {tolerance:.1e}; rounding allows about 1e-14", residual, work
        )
    return ContactSolution(pressure, gap, residual, work, method)


def sweep(
    influence: Influence, heights: np.ndarray, planes: Sequence[float] | np.ndarray, tolerance: float = 1e-10
) -> list[ContactSolution]:
    """Solve one surface against planes of several heights, each solve starting from those above.

    influence : B of the mesh
    heights : (nx, ny) [m] z
    planes : (k,) [m] heights h_p of the plane, in any order

    Returns the k solutions in the order of the planes; they agree with single solves to the tolerance. Raises as solve.
    """
    heights = _field("heights", heights, influence)
    if not all(math.isfinite(plane) for plane in planes):
        raise ParameterError(f"the planes must be at finite heights, not {list(planes)} m")
    solutions: dict[float, ContactSolution] = {}
    guess = None
    descending = sorted(set(planes), reverse=True)
    for k, plane in enumerate(descending):
        if k > 1:  # extrapolate from the two planes above: a tenth fewer products than from one
            upper, lower = descending[k - 2], descending[k - 1]
            slope = (solutions[lower].pressure - solutions[upper].pressure) / (upper - lower)
            guess = np.maximum(solutions[lower].pressure + (lower - plane) * slope, 0.0)
        elif k > 0:
            guess = solutions[descending[0]].pressure
        solutions[plane] = solve(influence, heights - plane, tolerance, guess)
    return [solutions[plane] for plane in planes]


def _field(name: str, values: np.ndarray, influence: Influence) -> np.ndarray:
    field = np.ascontiguousarray(values, dtype=np.float64)
    if field.shape != influence.grid.shape:
        raise ParameterError(f"the {name} has the shape {field.shape}, the mesh has {influence.grid.shape}")
    if not np.isfinite(field).all():
        raise ParameterError(f"the {name} must be finite everywhere")
    return field
