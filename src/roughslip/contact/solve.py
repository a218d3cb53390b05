"""Contact of a rough half-space with a rigid plane: at heights of the plane, or under given loads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from roughslip.contact import conjugate_gradients, dense_solver
from roughslip.contact.edge import contact_shares
from roughslip.contact.influence import Influence
from roughslip.contact.problem import Problem
from roughslip.errors import ParameterError, real
from roughslip.results import described, result
from roughslip.validation import finite, gate, positive

# The dense method takes about 7 ps k^3 for k nodes of positive interference, conjugate gradients 0.2 us per node of the
# mesh to 1e-4 and 0.45 us to 1e-10. They cost the same at k^3 = 3e4 to 7e4 nodes of the mesh. From about DENSE_LIMIT
# nodes on the matrix leaves the cache, and the dense method takes 10 to 20 ps k^3.
DENSE_SHARE = 60_000
DENSE_LIMIT = 550

# A start from the loads below takes 0.5 to 0.6 of the time of one from coarser meshes where loads grow by 12 %, as much
# where they grow by 47 %, and more on meshes of 512 x 512 nodes. Meshes that have no coarser ones always gain.
CLOSE = 1.25

Start = tuple[np.ndarray | None, np.ndarray | None]  # p [Pa] and B p [m], (nx, ny) each, or None where not known


@result
class ContactSolution:
    """Pressures and gaps of one surface and one plane."""

    pressure: np.ndarray = described(
        "contact pressure, never negative nor above the hardness, exactly zero off contact", "Pa", "x y"
    )
    gap: np.ndarray = described(
        "gap between the deformed surface and the plane, zero in contact up to the residual", "m", "x y"
    )
    plastic_displacement: np.ndarray = described(
        "permanent displacement u_plastic; zero below the hardness", "m", "x y"
    )
    plane: float = described(
        "height of the plane relative to the heights of the surface; zero where interferences were given", "m"
    )
    residual: float = described("relative residual of these fields, with gap - u_plastic = B p - u_bar computed anew")
    work: int = described('Cholesky factors ("dense") or products with B ("fft")')
    method: str = described('"none" (no contact), "dense" or "fft')
    hardness_pa: float = described("H, the highest pressure", "Pa", default=math.inf)
    periodic: bool = described("whether the surface is a periodic cell", default=False)

    @property
    def signed_gap(self) -> np.ndarray:
        """(nx, ny) [m] B p - u_bar: the gap, and where the surface yields minus the plastic displacement."""
        return self.gap if math.isinf(self.hardness_pa) else self.gap - self.plastic_displacement

    @property
    def contact(self) -> np.ndarray:
        """(nx, ny) where the pressure is positive."""
        return self.pressure > 0

    @property
    def area_fraction(self) -> float:
        """Share of the nodes in contact [-]."""
        return np.count_nonzero(self.pressure) / self.pressure.size

    @property
    def shares(self) -> np.ndarray:
        """(nx, ny) [-] share of each cell in contact, `contact_shares`; their mean is the area without mesh error."""
        return contact_shares(self.pressure, self.hardness_pa, self.periodic)

    @property
    def yielded_share(self) -> float:
        """Share [-] of the real area that bears the hardness; zero without contact."""
        return float(np.count_nonzero(self.pressure == self.hardness_pa) / max(self.shares.sum(), 1e-300))

    @property
    def mean_pressure(self) -> float:
        """Normal force per nominal area [Pa]."""
        return float(self.pressure.mean())


@gate
def solve(
    influence: Influence,
    interference: np.ndarray,
    tolerance: float = 1e-10,
    hardness_pa: float = math.inf,
    penetration_m: float | None = None,
) -> ContactSolution:
    """Solve the contact of a surface with a plane at a given height.

    Find 0 <= p <= H and u_plastic >= 0 such that::

        gap = B p + u_plastic - u_bar >= 0,    p gap = 0,    (H - p) u_plastic = 0.

    influence : B of the mesh, a free half-space
    interference : (nx, ny) [m] u_bar, height of the surface over the plane; with a penetration, heights over any level
    tolerance : [-] largest residual accepted, relative to the interference
    hardness_pa : H, the highest pressure [Pa]; infinite for elastic contact
    penetration_m : [m] depth of the plane below the highest node, without deformation

    Raises ParameterError for input that is not finite or has the wrong shape, and for a periodic cell, whose energy at
    a fixed plane may have no minimum: use solve_load. Raises ConvergenceError where the residual stays above the
    tolerance.
    """
    interference = _field("interference", interference, influence)
    _check(influence, tolerance, hardness_pa, at_plane=True)
    if penetration_m is None:
        return _solve(influence, interference, tolerance, (None, None), hardness_pa)
    plane = float(interference.max()) - finite("penetration_m", penetration_m).item()
    return replace(_solve(influence, interference - plane, tolerance, (None, None), hardness_pa), plane=plane)


def _solve(
    influence: Influence, interference: np.ndarray, tolerance: float, start: Start, hardness_pa: float
) -> ContactSolution:
    """`solve` for valid arguments."""
    candidates, how = int(np.count_nonzero(interference > 0)), (hardness_pa, influence.periodic)
    nothing = np.zeros(interference.shape)
    if candidates == 0:
        return ContactSolution(nothing, 0.0 - interference, nothing, 0.0, 0.0, 0, "none", *how)
    if dense_pays(candidates, interference.size):
        pressure, gap, residual, work = dense_solver.solve(influence, interference)
        if residual <= tolerance and pressure.max() <= hardness_pa:
            return ContactSolution(pressure, gap, nothing, 0.0, residual, work, "dense", *how)
        start = np.minimum(pressure, hardness_pa), None
    return _iterated(Problem(influence, interference, hardness_pa), tolerance, start)


def dense_pays(candidates: int, nodes: int) -> bool:
    """Whether the dense method is the faster for so many nodes of positive interference, and has the memory."""
    return nodes <= dense_solver.SMALL or (candidates <= DENSE_LIMIT and candidates**3 <= DENSE_SHARE * nodes)


@gate
def solve_load(
    influence: Influence,
    heights: np.ndarray,
    mean_pressure_pa: float,
    tolerance: float = 1e-10,
    hardness_pa: float = math.inf,
) -> ContactSolution:
    """Solve the contact of a surface under a given load, and find the height of the plane.

    influence : B of the mesh, a free half-space or a periodic cell
    heights : (nx, ny) [m] z
    mean_pressure_pa : force per nominal area [Pa], positive and below the hardness

    Other arguments and errors as in solve. A load of no contact, which is none, and one of full contact, at which every
    node has the hardness, are refused by these names. In a periodic cell the height of the plane is relative to the
    mean of the deformed surface.
    """
    load = positive("mean_pressure_pa", mean_pressure_pa, "Pa")
    (solution,) = solve_loads(influence, heights, [load], tolerance, hardness_pa)
    return solution


@gate
def sweep(
    influence: Influence,
    heights: np.ndarray,
    planes: Sequence[float] | np.ndarray,
    tolerance: float = 1e-10,
    hardness_pa: float = math.inf,
) -> list[ContactSolution]:
    """Solve one surface against planes of several heights, each solve starting from those above.

    influence : B of the mesh, a free half-space
    heights : (nx, ny) [m] z
    planes : (k,) [m] heights h_p of the plane, in any order
    tolerance, hardness_pa : as in solve

    Returns the k solutions in the order of the planes; they agree with single solves to the tolerance. Raises as solve.

    The start is extrapolated from two planes above. As the plane descends no pressure falls, so the extrapolation has
    none below zero, and its displacement is extrapolated with it, which saves a product. Extrapolation from one plane
    takes a tenth more products, from three planes or in p^2 or p - gap / B_00 as many. What remains is the linear
    convergence after the contact has been found.
    """
    heights, planes = _field("heights", heights, influence), finite("planes", planes, 1)
    _check(influence, tolerance, hardness_pa, at_plane=True)
    solutions: dict[float, ContactSolution] = {}
    for plane in sorted(set(planes.tolist()), reverse=True):
        interference = heights - plane
        start = _extrapolated(list(solutions.values())[-2:], interference, plane)
        solutions[plane] = replace(_solve(influence, interference, tolerance, start, hardness_pa), plane=plane)
    return [solutions[plane] for plane in planes.tolist()]


def _extrapolated(above: Sequence[ContactSolution], interference: np.ndarray, plane: float) -> Start:
    """Pressure and displacement at a plane, linearly from two planes above it, or those of one."""
    if not above:
        return None, None
    planes = [solution.plane for solution in above]
    pressure = _on_line(planes, [solution.pressure for solution in above], plane)
    if pressure.min() < 0:
        return np.maximum(pressure, 0.0), None
    gap = _on_line(planes, [solution.signed_gap for solution in above], plane)  # B p - u_bar is linear in the plane
    return pressure, gap + interference if len(above) == 2 else gap + (interference + (plane - planes[0]))


def _on_line(places: Sequence[float], fields: Sequence[np.ndarray], place: float) -> np.ndarray:
    """A field at a place, on the line through those at two places, or that of one."""
    if len(fields) == 1:
        return fields[0]
    share = (place - places[1]) / (places[1] - places[0])
    return fields[1] + share * (fields[1] - fields[0])


@gate
def solve_loads(
    influence: Influence,
    heights: np.ndarray,
    mean_pressures_pa: Sequence[float] | np.ndarray,
    tolerance: float = 1e-10,
    hardness_pa: float = math.inf,
) -> list[ContactSolution]:
    """Solve one surface under several loads, each solve starting from the loads below where these are close.

    influence : B of the mesh, a free half-space or a periodic cell
    heights : (nx, ny) [m] z
    mean_pressures_pa : (k,) [Pa] force per nominal area, in any order
    tolerance, hardness_pa : as in solve_load

    Returns the k solutions in the order of the loads; they agree with single solves to the tolerance. Raises as
    solve_load, and before anything is solved where one of the loads is refused.
    """
    heights, loads = _field("heights", heights, influence), finite("mean_pressures_pa", mean_pressures_pa, 1).tolist()
    _check(influence, tolerance, hardness_pa)
    for load in loads:
        if not 0 < load < hardness_pa:
            kind = "no contact" if load <= 0 else "full contact, at which every node has the hardness, or of more"
            raise ParameterError(
                f"a mean pressure of {load:g} Pa is a load of {kind}: it must be positive and below the hardness "
                f"{hardness_pa:g} Pa"
            )
    solutions: dict[float, ContactSolution] = {}
    for load in sorted(set(loads)):
        below, start = list(solutions)[-2:], None
        if below and (load <= CLOSE * below[-1] or heights.size <= conjugate_gradients.COARSEST):
            start = np.maximum(_on_line(below, [solutions[lower].pressure for lower in below], load), 0.0)
        solutions[load] = _under(influence, heights, load, tolerance, start, hardness_pa)
    return [solutions[load] for load in loads]


def _under(
    influence: Influence,
    heights: np.ndarray,
    load: float,
    tolerance: float,
    start: np.ndarray | None,
    hardness_pa: float,
) -> ContactSolution:
    """`solve_load` for valid arguments, from pressures (nx, ny) of any sum; that of the load counts."""
    highest = float(heights.max())  # from which displacements far below the heights are counted without rounding
    pressure_sum = load * influence.grid.size
    if start is not None and start.any():
        start = start / start.max()
        start *= pressure_sum / start.sum()
    solution = _iterated(Problem(influence, heights - highest, hardness_pa, pressure_sum), tolerance, (start, None))
    return replace(solution, plane=highest + solution.plane)


def _iterated(problem: Problem, tolerance: float, start: Start) -> ContactSolution:
    """Solve by conjugate gradients, from a start or from the solution on coarser meshes."""
    pressure, displacement = start
    if pressure is None or not pressure.any():
        pressure, displacement = conjugate_gradients.guess(problem), None
    found = conjugate_gradients.solve(problem, tolerance, pressure, displacement=displacement)
    gap, plastic = found.gap, np.zeros(found.gap.shape)
    if problem.cap < math.inf:
        plastic = np.where(found.pressure == problem.cap, np.maximum(-gap, 0.0), 0.0)
        gap = gap + plastic
    how = found.products, "fft", problem.cap, problem.influence.periodic
    return ContactSolution(found.pressure, gap, plastic, found.plane, found.residual, *how)


def _check(influence: Influence, tolerance: float, hardness_pa: float, at_plane: bool = False) -> None:
    if at_plane and influence.periodic:
        raise ParameterError("a periodic cell has no pressures at a fixed plane, but under a load: use solve_load")
    if not 0 < real("tolerance", tolerance) < 1:
        raise ParameterError(f"the tolerance of a contact solve must lie in (0, 1), not {tolerance}")
    if not real("hardness_pa", hardness_pa) > 0:
        raise ParameterError(f"hardness_pa must be positive, not {hardness_pa} Pa")


def _field(name: str, values: np.ndarray, influence: Influence) -> np.ndarray:
    values = finite(name, values, 2)
    if values.shape != influence.grid.shape:
        raise ParameterError(f"the {name} has the shape {values.shape}, the mesh has {influence.grid.shape}")
    return np.ascontiguousarray(values)
