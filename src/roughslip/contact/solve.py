"""Contact of a rough half-space with a rigid plane: at one height, at several, or under a given load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from roughslip.contact import conjugate_gradients, dense_solver
from roughslip.contact.influence import Influence
from roughslip.contact.kernels import square_ratio
from roughslip.contact.problem import Problem
from roughslip.contact.solution import ContactSolution, ContactSweep, curve_of
from roughslip.errors import ConvergenceError, ParameterError, real
from roughslip.validation import finite, gate

# The dense method takes about 4 ps k^3 for k nodes of positive interference, conjugate gradients 0.55 us per node of
# the mesh. They cost the same at k^3 = 1.4e5 nodes of the mesh, k = 830 on 64 x 64. From about DENSE_LIMIT nodes on the
# matrix leaves the cache, and the dense method takes 7 ps k^3 and more.
DENSE_SHARE = 140_000
DENSE_LIMIT = 900

# Nodes up to which the dense method always pays; pressures, gap and residual then come from one compiled call, which
# saves a third of the time at 100.
SMALL = 256

# A start from the loads below takes 0.5 to 0.6 of the time of one from coarser meshes where loads grow by 12 %, as much
# where they grow by 47 %, and more on meshes of 512 x 512 nodes. Meshes that have no coarser ones always gain.
CLOSE = 1.25

# A load that displaces the node that bears it by less [m], or more than the inverse, is beyond doubles when squared.
LEAST_DISPLACEMENT = 1e-140

# Conjugate gradients run on the rows and columns that can touch if these have less than this share of the nodes.
CROPPED_SHARE = 0.7


@gate
def solve(
    influence: Influence,
    interference: np.ndarray,
    tolerance: float = 1e-10,
    initial_pressure: np.ndarray | None = None,
    hardness_pa: float = math.inf,
    penetration_m: float | None = None,
) -> ContactSolution:
    """Solve the contact of a surface with a plane at a given height.

    Find 0 <= p <= H and u_plastic >= 0 such that::

        gap = B p + u_plastic - u_bar >= 0,    p gap = 0,    (H - p) u_plastic = 0.

    influence : B of the mesh, a free half-space
    interference : (nx, ny) [m] u_bar, height of the surface over the plane; with a penetration, heights over any level
    tolerance : [-] largest residual accepted, relative to the interference
    initial_pressure : (nx, ny) [Pa] a guess, not negative; used on large meshes only
    hardness_pa : H, the highest pressure [Pa]; infinite for elastic contact
    penetration_m : [m] depth of the plane below the highest node, without deformation

    Raises ParameterError for input that is not finite or has the wrong shape, and for a periodic cell, whose energy at
    a fixed plane may have no minimum: use solve_load. Raises ConvergenceError where the residual stays above the
    tolerance.
    """
    initial_pressure = None if initial_pressure is None else finite("initial_pressure", initial_pressure, 2)
    interference = finite("interference", interference, 2)
    _check_free(influence)
    interference = _field("interference", interference, influence)
    _check(tolerance, hardness_pa)
    start = _Start(_guess(initial_pressure, influence))
    if penetration_m is None:
        return _solve(influence, interference, tolerance, start, hardness_pa)
    plane = float(interference.max()) - finite("the penetration", penetration_m).item()
    return replace(_solve(influence, interference - plane, tolerance, start, hardness_pa), plane=plane)


@dataclass(frozen=True)
class _Start:
    """Where an iteration starts.

    pressure, displacement : (nx, ny) [Pa] and [m] p and B p, or None where they are not known
    """

    pressure: np.ndarray | None
    displacement: np.ndarray | None = None

    def on(self, box: tuple[slice, slice]) -> _Start:
        """The start on a part of the mesh, outside of which there is no pressure."""
        parts = (
            None if field is None else np.ascontiguousarray(field[box]) for field in (self.pressure, self.displacement)
        )
        return _Start(*parts)


def _solve(
    influence: Influence, interference: np.ndarray, tolerance: float, start: _Start, hardness_pa: float
) -> ContactSolution:
    """`solve` for valid arguments."""
    if interference.size <= SMALL:
        pressure, gap, residual, work, nodes = dense_solver.solve_small(influence, interference)
        if residual <= tolerance and (hardness_pa == math.inf or pressure.max() <= hardness_pa):
            how = work, "dense" if nodes else "none", nodes, "none"
            return ContactSolution(pressure, gap, np.zeros(pressure.shape), 0.0, residual, *how, hardness_pa)
        start = _Start(np.minimum(pressure, hardness_pa))
    touching = interference > 0
    candidates = int(np.count_nonzero(touching))
    if candidates == 0:
        nothing = np.zeros(influence.grid.shape)
        return ContactSolution(nothing, 0.0 - interference, nothing, 0.0, 0.0, 0, "none", 0, "none", hardness_pa)
    if interference.size > SMALL and _dense_pays(candidates, interference.size):
        pressure, work = dense_solver.solve(influence, interference)
        if hardness_pa == math.inf or pressure.max() <= hardness_pa:
            gap = influence.apply(pressure) - interference
            how = work, "dense", candidates, "none"
            return _checked(pressure, gap, 0.0, how, influence, interference, hardness_pa, tolerance)
        start = _Start(np.minimum(pressure, hardness_pa))
    box = _box(touching)
    if touching[box].size <= CROPPED_SHARE * touching.size:
        part = np.ascontiguousarray(interference[box])
        iterate, kind = _iterate(Problem(influence.on(part.shape), part, hardness_pa), tolerance / 2, start.on(box))
        pressure = np.zeros(touching.shape)
        pressure[box] = iterate.pressure
        gap = influence.apply(pressure) - interference
    else:
        iterate, kind = _iterate(Problem(influence, interference, hardness_pa), tolerance, start)
        pressure, gap = iterate.pressure, iterate.gap
    how = iterate.products, "fft", iterate.pressure.size, kind
    return _checked(pressure, gap, 0.0, how, influence, interference, hardness_pa, tolerance)


def dense_pays(interference: np.ndarray) -> bool:
    """Whether the dense method is the faster for interferences (nx, ny), and has the memory it needs."""
    return interference.size <= SMALL or _dense_pays(int(np.count_nonzero(interference > 0)), interference.size)


def _dense_pays(candidates: int, nodes: int) -> bool:
    return candidates <= DENSE_LIMIT and candidates**3 <= DENSE_SHARE * nodes


@gate
def solve_load(
    influence: Influence,
    heights: np.ndarray,
    mean_pressure_pa: float,
    tolerance: float = 1e-10,
    initial_pressure: np.ndarray | None = None,
    hardness_pa: float = math.inf,
) -> ContactSolution:
    """Solve the contact of a surface under a given load, and find the height of the plane.

    influence : B of the mesh, a free half-space or a periodic cell
    heights : (nx, ny) [m] z
    mean_pressure_pa : force per nominal area [Pa], positive and below the hardness
    initial_pressure : (nx, ny) [Pa] a guess, not negative

    Other arguments and errors as in solve. A load of no contact, which is none, and one of full contact, at which every
    node has the hardness, are refused by these names. A load that the highest node bears alone takes no iteration. In a
    periodic cell the height of the plane is relative to the mean of the
    deformed surface.
    """
    initial_pressure = None if initial_pressure is None else finite("initial_pressure", initial_pressure, 2)
    heights = finite("heights", heights, 2)
    heights = _field("heights", heights, influence)
    _check(tolerance, hardness_pa)
    initial_pressure = _guess(initial_pressure, influence)
    pressure_sum = sum_of_pressures(mean_pressure_pa, hardness_pa, influence)
    highest = float(heights.max())  # from which displacements far below the heights are counted without rounding
    lone = _lone_node(influence, heights - highest, pressure_sum, hardness_pa)
    if lone is not None:
        return replace(lone, plane=highest + lone.plane)
    if initial_pressure is not None and initial_pressure.any():  # of any sum: that of the load counts
        initial_pressure = initial_pressure / initial_pressure.max()
        initial_pressure *= pressure_sum / initial_pressure.sum()
    problem = Problem(influence, heights - highest, hardness_pa, pressure_sum)
    iterate, kind = _iterate(problem, tolerance, _Start(initial_pressure))
    how = iterate.products, "fft", heights.size, kind
    interference, plane = problem.interference - iterate.plane, highest + iterate.plane
    return _checked(iterate.pressure, iterate.gap, plane, how, influence, interference, hardness_pa, tolerance)


def sum_of_pressures(mean_pressure_pa: float, hardness_pa: float, influence: Influence) -> float:
    """Sum of the pressures of a load [Pa]; ParameterError for a load of no contact or of full contact."""
    if not mean_pressure_pa > 0:
        raise ParameterError(f"the mean pressure must be positive: {mean_pressure_pa} Pa is a load of no contact")
    if mean_pressure_pa > hardness_pa:
        raise ParameterError(
            f"the mean pressure {mean_pressure_pa:g} Pa is more than the hardness {hardness_pa:g} Pa on the whole "
            "apparent area: no contact has this load; give less load, or a larger hardness or area"
        )
    if not mean_pressure_pa < hardness_pa:
        raise ParameterError(
            f"the mean pressure must be finite and below the hardness {hardness_pa:g} Pa: {mean_pressure_pa:g} Pa is a "
            "load of full contact, at which every node has the hardness and the plane no one height"
        )
    total = mean_pressure_pa * influence.grid.size
    displacement = total * influence.diagonal  # of a node that bears all of it
    if not LEAST_DISPLACEMENT < displacement < 1 / LEAST_DISPLACEMENT:
        kind = "no contact" if displacement < 1 else "full contact"
        raise ParameterError(
            f"the mean pressure {mean_pressure_pa:g} Pa is a load of {kind} for every surface: it displaces a node by "
            f"{displacement:.1g} m, whose square is beyond the numbers of a computer"
        )
    return total


def _lone_node(
    influence: Influence, interference: np.ndarray, pressure_sum: float, hardness_pa: float
) -> ContactSolution | None:
    """The contact in which the highest node bears the whole load; None where the load is, or may be, for more nodes.

    interference : (nx, ny) [m] heights below the highest node
    """
    if interference.size < 2 or pressure_sum > hardness_pa:
        return None
    displacement = influence.diagonal * pressure_sum
    if np.count_nonzero(interference > -2 * displacement) > 1:  # no other node rises by more beside it
        return None
    pressure = np.zeros(interference.shape)
    pressure.flat[interference.argmax()] = pressure_sum
    gap = influence.apply(pressure) - displacement - interference
    how = 1, "dense", 1, "none"
    return _checked(pressure, gap, -displacement, how, influence, interference + displacement, hardness_pa, 1e-10)


@gate
def sweep(
    influence: Influence,
    heights: np.ndarray,
    planes: Sequence[float] | np.ndarray,
    tolerance: float = 1e-10,
    hardness_pa: float = math.inf,
) -> ContactSweep:
    """Solve one surface against planes of several heights, each solve starting from those above.

    influence : B of the mesh, a free half-space
    heights : (nx, ny) [m] z
    planes : (k,) [m] heights h_p of the plane, in any order
    tolerance, hardness_pa : as in solve

    Returns the curve, with the k solutions in the order of the planes; they agree with single solves to the tolerance.
    Raises as solve.

    The start is extrapolated from two planes above. As the plane descends no pressure falls, so the extrapolation has
    none below zero, and its displacement is extrapolated with it, which saves a product. Extrapolation from one plane
    takes a tenth more products, from three planes or in p^2 or p - gap / B_00 as many. What remains is the linear
    convergence after the contact has been found.
    """
    planes = finite("planes", planes, 1)
    heights = finite("heights", heights, 2)
    _check_free(influence)
    heights = _field("heights", heights, influence)
    if not all(math.isfinite(real("the height of a plane", plane)) for plane in planes):
        raise ParameterError(f"the planes must be at finite heights, not {list(map(float, planes))} m")
    _check(tolerance, hardness_pa)
    solutions: dict[float, ContactSolution] = {}
    above: list[ContactSolution] = []
    for plane in sorted({float(plane) for plane in planes}, reverse=True):
        start = _extrapolated(above[-2:], heights, plane)
        solution = _solve(influence, heights - plane, tolerance, start, hardness_pa)
        above.append(replace(solution, plane=plane))
        solutions[plane] = above[-1]
    return curve_of([solutions[float(plane)] for plane in planes])


def _extrapolated(above: Sequence[ContactSolution], heights: np.ndarray, plane: float) -> _Start:
    """Pressure and displacement at a plane, linearly from two planes above it, or those of one."""
    if not above:
        return _Start(None)
    fields = [(solution.pressure, solution.signed_gap + heights - solution.plane) for solution in above]
    planes = [solution.plane for solution in above]
    pressure, displacement = (_on_line(planes, values, plane) for values in zip(*fields, strict=True))
    return _Start(np.maximum(pressure, 0.0), displacement if pressure.min() >= 0 else None)


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
) -> ContactSweep:
    """Solve one surface under several loads, each solve starting from the loads below where these are close.

    influence : B of the mesh, a free half-space or a periodic cell
    heights : (nx, ny) [m] z
    mean_pressures_pa : (k,) [Pa] force per nominal area, in any order
    tolerance, hardness_pa : as in solve_load

    Returns the curve, with the k solutions in the order of the loads; they agree with single solves to the tolerance.
    Raises as solve_load, and before anything is solved where one of the loads is refused.
    """
    heights = finite("heights", heights, 2)
    mean_pressures_pa = finite("mean_pressures_pa", mean_pressures_pa, 1)
    for load in mean_pressures_pa:
        sum_of_pressures(load, hardness_pa, influence)
    solutions: dict[float, ContactSolution] = {}
    for load in sorted({float(load) for load in mean_pressures_pa}):
        below = list(solutions)[-2:]
        start = None
        if below and (load <= CLOSE * below[-1] or heights.size <= conjugate_gradients.COARSEST):
            start = np.maximum(_on_line(below, [solutions[lower].pressure for lower in below], load), 0.0)
        solutions[load] = solve_load(influence, heights, load, tolerance, start, hardness_pa)
    return curve_of([solutions[float(load)] for load in mean_pressures_pa])


def _iterate(problem: Problem, tolerance: float, start: _Start) -> tuple[conjugate_gradients.Solution, str]:
    """Solve by conjugate gradients. Returns the solution and the kind of start."""
    if start.pressure is not None and start.pressure.any():
        iterate = conjugate_gradients.solve(problem, tolerance, start.pressure, displacement=start.displacement)
        return iterate, "given"
    guess = conjugate_gradients.guess(problem)
    return conjugate_gradients.solve(problem, tolerance, guess), "zero" if guess is None else "nested"


def _checked(
    pressure: np.ndarray,
    gap: np.ndarray,
    plane: float,
    how: tuple[int, str, int, str],
    influence: Influence,
    interference: np.ndarray,
    hardness_pa: float,
    tolerance: float,
) -> ContactSolution:
    """The result, after a check of its residual. Where the surface yields, the gap is without plastic displacement.

    gap : (nx, ny) [m] B p - u_bar
    how : work, method, nodes and start of ContactSolution
    """
    residual = math.sqrt(square_ratio(gap, pressure, influence.diagonal, interference, hardness_pa))
    if not residual <= tolerance:
        raise ConvergenceError(
            f"the contact residual is above the tolerance {tolerance:.1e}, and rounding allows about 1e-14: try a "
            "larger tolerance; scene key: numerics.contact_tolerance",
            residual,
            how[0],
        )
    plastic = np.zeros(gap.shape)
    if hardness_pa < math.inf:
        plastic = np.where(pressure == hardness_pa, np.maximum(-gap, 0.0), 0.0)
        gap = gap + plastic
    return ContactSolution(pressure, gap, plastic, plane, residual, *how, hardness_pa, influence.periodic)


def _box(nodes: np.ndarray) -> tuple[slice, slice]:
    """The rows and columns from the first to the last of the nodes."""
    rows, columns = np.flatnonzero(nodes.any(axis=1)), np.flatnonzero(nodes.any(axis=0))
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def _check_free(influence: Influence) -> None:
    if influence.periodic:
        raise ParameterError("a periodic cell has no pressures at a fixed plane, but under a load: use solve_load")


def _check(tolerance: float, hardness_pa: float) -> None:
    if not 0 < real("the tolerance", tolerance) < 1:
        raise ParameterError(f"the tolerance of a contact solve must lie in (0, 1), not {tolerance}")
    if not real("the hardness", hardness_pa) > 0:
        raise ParameterError(f"the hardness must be positive, not {hardness_pa} Pa")


def _guess(values: np.ndarray | None, influence: Influence) -> np.ndarray | None:
    if values is None:
        return None
    pressure = _field("initial pressure", values, influence)
    if (pressure < 0).any():
        raise ParameterError(f"the initial pressure must not be negative, not {pressure.min():.3g} Pa")
    return pressure


def _field(name: str, values: np.ndarray, influence: Influence) -> np.ndarray:
    if values.shape != influence.grid.shape:
        raise ParameterError(f"the {name} has the shape {values.shape}, the mesh has {influence.grid.shape}")
    return np.ascontiguousarray(values)
