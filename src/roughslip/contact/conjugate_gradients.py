"""Contact on large meshes: bound-constrained conjugate gradients, with B applied by FFT.

Symbols: B is the influence matrix, p the pressures, u_bar the interference, and w = B p - u_bar + plane the gap.
The cap is the highest pressure. F are the nodes whose pressure may move ("free"). The stencil M approximates
the inverse of B. One iteration:

    - misfit: r = -w on F, zero elsewhere
    - preconditioning: s = M r on F
    - direction: d = s + beta d on F, with beta = -(s' B d) / (d' B d), not negative
    - line search: alpha = (r' d) / (d' B d)
    - projection: p <- clip(p + alpha d, 0, cap), w <- w + alpha B d + B (what the clip changed)

With a given sum of pressures, s and d have zero sum, and a common shift of the free pressures restores the sum after
the clip. The plane is then unknown, and is set so that the mean gap in contact is zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roughslip.contact import kernels
from roughslip.contact.influence import Influence
from roughslip.errors import ConvergenceError

# Nearly full contact of a rough surface of 512 x 512 nodes, the hardest of those measured, takes 134 at 1e-10.
PRODUCT_LIMIT = 2000

# Products after which the energy may no longer rise. It does so once to six times in a solve. Preventing it from the
# start takes up to a fifth more products.
PATIENCE = 200


@dataclass(frozen=True)
class Problem:
    """Find 0 <= p <= cap of least energy p'Bp/2 - p'u_bar; with a sum of pressures, among those of that sum.

    influence : B of the mesh
    interference : (nx, ny) [m] u_bar; finite, and positive somewhere unless a sum is given
    cap : highest pressure [Pa], or infinity
    pressure_sum : sum of p over the nodes [Pa], which is the force over the area of a cell; None for a fixed plane
    """

    influence: Influence
    interference: np.ndarray
    cap: float = math.inf
    pressure_sum: float | None = None

    def plane(self, pressure: np.ndarray, gap: np.ndarray) -> float:
        """Height [m] of the plane for which the mean gap of the nodes between the bounds is zero."""
        if self.pressure_sum is None:
            return 0.0
        mean, between = kernels.mean_between(gap, pressure, self.cap)
        if between:
            return -mean
        pressed = pressure > 0  # all at the cap and with the given sum: any plane that reaches these and no others
        return -float(gap[pressed].max() if pressed.all() else (gap[pressed].max() + gap[~pressed].min()) / 2)

    def scale(self, pressure: np.ndarray, plane: float) -> float:
        """The scale of residuals [m]: ||max(u_bar - plane, 0)||, or B_00 ||p|| where that is more."""
        if self.pressure_sum is None:  # the second is never more at the solution
            return self._scale_of_the_given_plane
        own_displacement = self.influence.diagonal * math.sqrt(kernels.inner(pressure, pressure))
        return max(math.sqrt(kernels.positive_square(self.interference, plane)), own_displacement)

    @cached_property
    def _scale_of_the_given_plane(self) -> float:
        return math.sqrt(kernels.positive_square(self.interference, 0.0))


@dataclass(frozen=True)
class Solution:
    """Pressures and gaps with their residual.

    pressure : (nx, ny) [Pa]
    gap : (nx, ny) [m] B p - u_bar + plane, computed anew; negative only where p = cap
    plane : [m] relative to the heights u_bar, zero where it is given
    residual : [-] relative, of these fields
    products : number of products with B
    """

    pressure: np.ndarray
    gap: np.ndarray
    plane: float
    residual: float
    products: int


def solve(
    problem: Problem,
    tolerance: float,
    guess: np.ndarray | None = None,
    enough: Callable[[np.ndarray, np.ndarray], bool] | None = None,
) -> Solution:
    """Solve a contact problem to a relative residual.

    problem : what to solve
    tolerance : [-] bound of the residual, for a gap computed anew from the pressure
    guess : (nx, ny) [Pa] where to start
    enough : whether a pressure and its gap, both (nx, ny), are known well enough to stop before the tolerance

    Returns the solution. Raises ConvergenceError.

    Method: bound-constrained conjugate gradients, Vollebregt, J. Comput. Phys. 257 (2014) 333; with a sum, directions
    of zero sum, Polonsky and Keer, Wear 231 (1999) 206. There are three differences. The preconditioner is a stencil,
    which needs no second convolution. The next direction is conjugated by the known product B d, which remains valid
    when the set of free nodes changes. After PATIENCE products a step that meets a bound may not raise the energy.
    """
    iteration = _Iteration(problem, guess)
    wanted = tolerance
    while True:
        residual = iteration.assess()
        if enough is not None and enough(iteration.pressure, iteration.gap):
            return iteration.solution(residual)
        if residual <= wanted:
            wanted /= 2  # where the gap computed anew gives more, iterate before computing it once more
            if iteration.put_on_bounds():
                residual = iteration.assess()
                if residual <= tolerance:
                    return iteration.solution(residual)
        if iteration.products >= PRODUCT_LIMIT or not math.isfinite(residual):
            raise _failure(tolerance, residual, iteration.products)
        iteration.precondition()
        slope = iteration.choose_direction()
        length = iteration.search_line(slope)
        if length is None:
            raise _failure(tolerance, residual, iteration.products)
        iteration.project(length)


class _Iteration:
    """Fields of a solve, and the steps that change them.

    pressure, gap : (nx, ny) p [Pa] and B p - u_bar [m], without the plane
    misfit, descent, direction, product : (nx, ny) r, s, d and B d
    uniform_descent : (nx, ny) M 1 on F, of which a multiple makes the sum of a direction zero
    free : (nx, ny) whether a node may move
    lift : (nx, ny) M 1 on the free nodes, with a force
    new_pressure, new_gap, excess : (nx, ny) the fields after a step, and what the clip changed
    curvature : d' B d; zero where there is no earlier direction
    products : number of products with B
    """

    def __init__(self, problem: Problem, guess: np.ndarray | None) -> None:
        self.problem, self.products, self.curvature, self.plane = problem, 0, 0.0, 0.0
        self.pressure, self.gap = self._start(guess)
        fields = (np.zeros_like(self.gap) for _ in range(8))
        self.misfit, self.descent, self.uniform_descent, self.direction, self.product, *fields_of_step = fields
        self.new_pressure, self.new_gap, self.excess = fields_of_step
        self.free = np.zeros(self.gap.shape, dtype=np.bool_)

    def assess(self) -> float:
        """Find the plane, the misfit and the free nodes. Returns the relative residual."""
        problem = self.problem
        self.plane = problem.plane(self.pressure, self.gap)
        square = kernels.assess(
            self.pressure, self.gap, self.plane, problem.influence.diagonal, problem.cap, self.misfit, self.free
        )
        scale = problem.scale(self.pressure, self.plane)
        return math.sqrt(square) / scale if scale > 0 else math.nan

    def put_on_bounds(self) -> bool:
        """Put nodes that approach a bound on it, so that contact and yield are exact, and compute the gap anew.

        Returns False, and changes no pressure, where no node between the bounds is left to carry the rest of the sum.
        """
        cap, pressure_sum = self.problem.cap, self.problem.pressure_sum
        self.curvature = 0.0
        target = self.pressure - (self.gap + self.plane) / self.problem.influence.diagonal
        pressure = np.where(target <= 0, 0.0, np.where(target >= cap, cap, self.pressure))
        between = (pressure > 0) & (pressure < cap)
        shifted = pressure if pressure_sum is None else _shifted(pressure, between, cap, pressure_sum)
        if shifted is None:
            return False
        self.pressure, self.gap = shifted, self._multiply(shifted) - self.problem.interference
        return True

    def solution(self, residual: float) -> Solution:
        """The present fields."""
        return Solution(self.pressure, self.gap + self.plane, self.plane, residual, self.products)

    def precondition(self) -> None:
        """s = M r on the free nodes; with a given sum, less a multiple of M 1, so that the sum of s is zero."""
        stencil = self.problem.influence.approximate_inverse
        kernels.stencil_product(stencil, self.misfit, self.free, self.descent)
        if self.problem.pressure_sum is not None:
            kernels.stencil_product(stencil, self.free.astype(np.float64), self.free, self.uniform_descent)
            kernels.balance(self.descent, self.uniform_descent)

    def choose_direction(self) -> float:
        """d = s + beta d, conjugate to the last direction, or s where that does not descend.

        Returns the slope r' d, by which the energy falls per unit of step.
        """
        beta = 0.0
        if self.curvature > 0:
            beta = max(0.0, -kernels.inner(self.descent, self.product) / self.curvature)
        slope = kernels.conjugate(self.descent, beta, self.direction, self.misfit, self.free)
        if self.problem.pressure_sum is not None:
            kernels.balance(self.direction, self.uniform_descent)
            slope = kernels.inner(self.misfit, self.direction)
        if slope <= 0:
            slope = kernels.conjugate(self.descent, 0.0, self.direction, self.misfit, self.free)
        return slope

    def search_line(self, slope: float) -> float | None:
        """alpha = (r' d) / (d' B d), or None where rounding leaves no positive curvature."""
        self._multiply(self.direction, self.product)
        self.curvature = kernels.inner(self.direction, self.product)
        return slope / self.curvature if self.curvature > 0 else None

    def project(self, length: float) -> None:
        """p <- clip(p + alpha d, 0, cap), with the gap that belongs to it."""
        problem, shift, met = self.problem, 0.0, True
        if problem.pressure_sum is not None:
            shift, met = kernels.shift_to_sum(
                self.pressure, length, self.direction, problem.cap, problem.pressure_sum, self.free, False
            )
        if met:
            self._advance(length, shift)
        else:  # the free nodes cannot carry the sum, so further nodes must come into contact
            self._step_along_gap(problem.influence.diagonal)
            self.curvature = 0.0
        self.pressure, self.new_pressure = self.new_pressure, self.pressure
        self.gap, self.new_gap = self.new_gap, self.gap

    def _advance(self, length: float, shift: float) -> None:
        """Step along the direction; where a bound stops it, the gap takes a second product."""
        step = self.pressure, length, self.direction, self.problem.cap, shift, self.free
        changed = kernels.advance(*step, self.new_pressure, self.excess)
        kernels.add_multiple(self.gap, length, self.product, self.new_gap)
        if changed:
            self.new_gap += self._multiply(self.excess)
            if self.products > PATIENCE:
                self._prevent_rise_of_energy()

    def _prevent_rise_of_energy(self) -> None:
        """Where the energy rose, go back to its minimum on the way, or take a step of gradient projection instead.

        That step has the length 1 / largest eigenvalue of B, for which the energy always falls.
        """
        change, gap_change = self.new_pressure - self.pressure, self.new_gap - self.gap
        slope, curvature = -float(kernels.inner(self.gap, change)), float(kernels.inner(change, gap_change))
        if slope >= curvature:
            return
        if slope > 0:
            fraction = slope / curvature
            self.new_pressure[:] = self.pressure + fraction * change
            self.new_gap[:] = self.gap + fraction * gap_change
        else:
            self._step_along_gap(self.problem.influence.largest_eigenvalue)

    def _step_along_gap(self, compliance: float) -> None:
        """A projected step against the gap, p - gap / compliance [m/Pa]."""
        self.new_pressure[:] = _nearest(self.problem, self.pressure - self.gap / compliance)
        self.new_gap[:] = self._multiply(self.new_pressure) - self.problem.interference

    def _start(self, guess: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and gap of the guess; at a fixed plane it is scaled by an exact line search along itself."""
        u_bar, cap, pressure_sum = self.problem.interference, self.problem.cap, self.problem.pressure_sum
        if guess is None or not guess.any():
            if pressure_sum is None:
                return np.zeros_like(u_bar), -u_bar
            guess = np.full_like(u_bar, pressure_sum / u_bar.size)
        pressure = np.minimum(np.maximum(guess, 0.0), cap)
        if pressure_sum is not None:
            shifted = _shifted(pressure, pressure > 0, cap, pressure_sum)
            pressure = _nearest(self.problem, pressure) if shifted is None else shifted
        displacement = self._multiply(pressure)
        energy = kernels.inner(pressure, displacement)
        if pressure_sum is None and energy > 0:
            scale = kernels.inner(pressure, u_bar) / energy
            if 0 < scale * float(pressure.max()) <= cap:
                pressure, displacement = scale * pressure, scale * displacement
        return pressure, displacement - u_bar

    def _multiply(self, pressure: np.ndarray, result: np.ndarray | None = None) -> np.ndarray:
        """B p, counted; written into the result where one is given, because large new arrays are slow."""
        self.products += 1
        return self.problem.influence.apply(pressure, result)


def _failure(tolerance: float, residual: float, products: int) -> ConvergenceError:
    return ConvergenceError(
        f"the contact pressures did not reach the relative residual {tolerance:.1e}; try a larger tolerance (rounding"
        " allows about 1e-14), or cells nearer to square",
        residual,
        products,
    )


def _shifted(pressure: np.ndarray, nodes: np.ndarray, cap: float, pressure_sum: float) -> np.ndarray | None:
    """Pressures shifted at the nodes until the sum is as wanted; None where these nodes cannot carry it."""
    shift, met = kernels.shift_to_sum(pressure, 0.0, pressure, cap, pressure_sum, nodes, False)
    return np.where(nodes, np.minimum(np.maximum(pressure + shift, 0.0), cap), pressure) if met else None


def _nearest(problem: Problem, trial: np.ndarray) -> np.ndarray:
    """The allowed pressures nearest to a trial."""
    shift = 0.0
    if problem.pressure_sum is not None:
        nodes = np.ones(trial.shape, dtype=np.bool_)
        shift, _ = kernels.shift_to_sum(trial, 0.0, trial, problem.cap, problem.pressure_sum, nodes, True)
    return np.minimum(np.maximum(trial + shift, 0.0), problem.cap)
