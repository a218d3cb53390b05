"""Contact on large meshes: conjugate gradients over the free nodes, bounded by 0 <= p <= cap, with B applied by FFT."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roughslip.contact import kernels
from roughslip.contact.influence import Influence
from roughslip.errors import ConvergenceError

# Nearly full contact of a rough surface of 512 x 512 nodes, the hardest of those measured, takes 134 at 1e-10.
PRODUCT_LIMIT = 2000

# Products after which the energy may no longer rise. It does so once to six times in a solve, and holding it from the
# start takes up to a fifth more products.
PATIENCE = 200


@dataclass(frozen=True)
class Problem:
    """Find 0 <= p <= cap of least energy p'Bp/2 - p'u_bar; with a force, among the pressures of that sum.

    influence : B of the mesh
    interference : (nx, ny) [m] u_bar; finite, and positive somewhere unless a force is given
    cap : highest pressure [Pa], or infinity
    force : sum of the pressures [Pa], or None where the plane stands still
    """

    influence: Influence
    interference: np.ndarray
    cap: float = math.inf
    force: float | None = None

    def plane(self, pressure: np.ndarray, gap: np.ndarray) -> float:
        """Height [m] of the plane over that of u_bar at which the mean gap of the nodes between the bounds is zero."""
        if self.force is None:
            return 0.0
        mean, between = kernels.mean_between(gap, pressure, self.cap)
        if between:
            return -mean
        pressed = pressure > 0  # all at the cap, with the sum asked for: any plane that reaches these and no others
        return -float(gap[pressed].max() if pressed.all() else (gap[pressed].max() + gap[~pressed].min()) / 2)

    def reach(self, pressure: np.ndarray, plane: float) -> float:
        """||max(u_bar, 0)||, or B_00 ||p|| if that is more [m]: what residuals are relative to."""
        if self.force is None:  # the second is never more at the solution
            return self._reach_of_the_given_plane
        lift = self.influence.diagonal * math.sqrt(kernels.inner(pressure, pressure))
        return max(math.sqrt(kernels.positive_square(self.interference, plane)), lift)

    @cached_property
    def _reach_of_the_given_plane(self) -> float:
        return math.sqrt(kernels.positive_square(self.interference, 0.0))


@dataclass(frozen=True)
class Solution:
    """pressure : (nx, ny) [Pa]
    gap : (nx, ny) [m] B p - u_bar + plane, taken afresh; negative only where p = cap
    plane : [m] over the height of u_bar, zero without a force
    residual : relative, of these very fields
    products : with B
    """

    pressure: np.ndarray
    gap: np.ndarray
    plane: float
    residual: float
    products: int


class _Products:
    """B p, counted; written into the result where one is given, since a new array costs the more the larger it is."""

    def __init__(self, influence: Influence) -> None:
        self.influence, self.count = influence, 0

    def __call__(self, pressure: np.ndarray, result: np.ndarray | None = None) -> np.ndarray:
        self.count += 1
        return self.influence.apply(pressure, result)


def solve(problem: Problem, tolerance: float, guess: np.ndarray | None = None) -> Solution:
    """Pressures and gaps of the contact problem to a relative residual.

    problem : what to solve
    tolerance : bound of the residual, met by a gap computed afresh from the pressure
    guess : (nx, ny) [Pa] where to start

    Raises ConvergenceError.

    Method: bound-constrained conjugate gradients, Vollebregt, J. Comput. Phys. 257 (2014) 333; with a force, directions
    of zero sum, Polonsky and Keer, Wear 231 (1999) 206. A step is exact along a direction on the free nodes, those that
    it may move; pressures beyond a bound are set to it. Three differences: the preconditioner is a stencil and costs no
    second convolution; the next direction is conjugated by the product B d at hand, which still holds after the set of
    free nodes has changed; and after PATIENCE products a step that meets a bound may not raise the energy any more.
    """
    influence, cap, force = problem.influence, problem.cap, problem.force
    multiply = _Products(influence)
    pressure, gap = _start(problem, guess, multiply)
    new_pressure, new_gap, misfit, descent, direction, product, excess = (np.zeros_like(gap) for _ in range(7))
    free = np.zeros(gap.shape, dtype=np.bool_)
    curvature, wanted = 0.0, tolerance
    while True:
        plane, residual = _assess(problem, pressure, gap, misfit, free)
        if residual <= wanted:
            settled = _settled(problem, pressure, gap + plane)
            wanted, curvature = wanted / 2, 0.0
            if settled is not None:
                pressure, gap = settled, multiply(settled) - problem.interference
                plane, residual = _assess(problem, pressure, gap, misfit, free)
                if residual <= tolerance:
                    return Solution(pressure, gap + plane, plane, residual, multiply.count)
        if multiply.count >= PRODUCT_LIMIT or not math.isfinite(residual):
            raise _failure(tolerance, residual, multiply.count)

        kernels.stencil_product(influence.approximate_inverse, misfit, free, descent)
        if force is not None:
            lift = np.empty_like(misfit)
            kernels.stencil_product(influence.approximate_inverse, free.astype(np.float64), free, lift)
            kernels.balance(descent, lift)
        factor = max(0.0, -kernels.inner(descent, product) / curvature) if curvature > 0 else 0.0
        slope = kernels.conjugate(descent, factor, direction, misfit, free)
        if force is not None:
            kernels.balance(direction, lift)
            slope = kernels.inner(misfit, direction)
        if slope <= 0:
            slope = kernels.conjugate(descent, 0.0, direction, misfit, free)
        multiply(direction, product)
        curvature = kernels.inner(direction, product)
        if not curvature > 0:
            raise _failure(tolerance, residual, multiply.count)
        length = slope / curvature

        shift, met = 0.0, True
        if force is not None:
            shift, met = kernels.shift_to_sum(pressure, length, direction, cap, force, free, False)
        if not met:  # the free nodes cannot carry the force, so the next to touch must help
            new_pressure[:] = _nearest(problem, pressure - gap / influence.diagonal)
            new_gap[:] = multiply(new_pressure) - problem.interference
            curvature = 0.0
        elif kernels.advance(pressure, gap, length, direction, product, cap, shift, free, new_pressure, new_gap):
            kernels.clipped(pressure, length, direction, new_pressure, excess)
            new_gap += multiply(excess)
            if multiply.count > PATIENCE:
                _hold_energy(problem, (pressure, gap), (new_pressure, new_gap), multiply)
        pressure, new_pressure, gap, new_gap = new_pressure, pressure, new_gap, gap


def _failure(tolerance: float, residual: float, products: int) -> ConvergenceError:
    return ConvergenceError(
        f"the contact pressures did not reach the relative residual {tolerance:.1e}; try a larger tolerance (rounding"
        " allows about 1e-14), or cells nearer to square",
        residual,
        products,
    )


def _start(problem: Problem, guess: np.ndarray | None, multiply: _Products) -> tuple[np.ndarray, np.ndarray]:
    """Pressure and gap: the guess, with neither cap nor force scaled by an exact line search along itself."""
    u_bar, cap, force = problem.interference, problem.cap, problem.force
    if guess is None or not guess.any():
        if force is None:
            return np.zeros_like(u_bar), -u_bar
        guess = np.full_like(u_bar, force / u_bar.size)
    pressure = np.minimum(np.maximum(guess, 0.0), cap)
    if force is not None:
        shifted = _shifted(pressure, pressure > 0, cap, force)
        pressure = _nearest(problem, pressure) if shifted is None else shifted
    displacement = multiply(pressure)
    energy = kernels.inner(pressure, displacement)
    if force is None and energy > 0:
        scale = kernels.inner(pressure, u_bar) / energy
        if 0 < scale * float(pressure.max()) <= cap:
            pressure, displacement = scale * pressure, scale * displacement
    return pressure, displacement - u_bar


def _assess(
    problem: Problem, pressure: np.ndarray, gap: np.ndarray, misfit: np.ndarray, free: np.ndarray
) -> tuple[float, float]:
    """The plane and the relative residual; writes the misfit and which nodes are free."""
    plane = problem.plane(pressure, gap)
    square = kernels.assess(pressure, gap, plane, problem.influence.diagonal, problem.cap, misfit, free)
    reach = problem.reach(pressure, plane)
    return plane, math.sqrt(square) / reach if reach > 0 else math.nan


def _settled(problem: Problem, pressure: np.ndarray, gap: np.ndarray) -> np.ndarray | None:
    """The pressures, with nodes that are on their way to a bound put on it: they tell what is in contact and yields.
    None if no node is left between the bounds that could carry the rest of the force."""
    cap, force = problem.cap, problem.force
    target = pressure - gap / problem.influence.diagonal
    settled = np.where(target <= 0, 0.0, np.where(target >= cap, cap, pressure))
    if force is None:
        return settled
    return _shifted(settled, (settled > 0) & (settled < cap), cap, force)


def _shifted(pressure: np.ndarray, nodes: np.ndarray, cap: float, force: float) -> np.ndarray | None:
    """Pressures shifted at the nodes until their sum is the force; None where these nodes cannot carry it."""
    shift, met = kernels.shift_to_sum(pressure, 0.0, pressure, cap, force, nodes, False)
    return np.where(nodes, np.minimum(np.maximum(pressure + shift, 0.0), cap), pressure) if met else None


def _nearest(problem: Problem, trial: np.ndarray) -> np.ndarray:
    """The allowed pressures nearest to a trial."""
    shift = 0.0
    if problem.force is not None:
        nodes = np.ones(trial.shape, dtype=np.bool_)
        shift, _ = kernels.shift_to_sum(trial, 0.0, trial, problem.cap, problem.force, nodes, True)
    return np.minimum(np.maximum(trial + shift, 0.0), problem.cap)


def _hold_energy(
    problem: Problem,
    now: tuple[np.ndarray, np.ndarray],
    new: tuple[np.ndarray, np.ndarray],
    multiply: _Products,
) -> None:
    """Change the new pressure and gap where the energy rose: to its least on the way there, or else by a step of
    gradient projection of length 1 / largest eigenvalue of B, for which it always falls."""
    pressure, gap = now
    change, lift = new[0] - pressure, new[1] - gap
    slope, curvature = -float(kernels.inner(gap, change)), float(kernels.inner(change, lift))
    if slope >= curvature:
        return
    if slope > 0:
        fraction = slope / curvature
        new[0][:] = pressure + fraction * change
        new[1][:] = gap + fraction * lift
        return
    new[0][:] = _nearest(problem, pressure - gap / problem.influence.largest_eigenvalue)
    new[1][:] = multiply(new[0]) - problem.interference
