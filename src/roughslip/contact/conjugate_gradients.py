"""Contact on large meshes: bound-constrained conjugate gradients, with B applied by FFT.

Symbols: B is the influence matrix, p the pressures, u_bar the interference, and w = B p - u_bar + plane the gap.
The cap is the highest pressure. F are the nodes whose pressure may move ("free"). The stencil M approximates
the inverse of B. One iteration, with one product B t:

    - misfit: r = -w on F, zero elsewhere
    - preconditioning: s = M r on F
    - direction: d = s + beta t on F, with beta = -(s' B t) / (t' B t) of the last step t, not negative
    - step: t = clip(p + lambda d, 0, cap) - p, with a length lambda that the last steps suggest
    - line search: theta = (r' t) / (t' B t), as far as the bounds allow
    - move: p <- p + theta t, w <- w + theta B t

With a given sum of pressures, s and d have zero sum, and a common shift of the free pressures restores the sum
after the clip. Along strips and belts s is corrected for long waves, in `blocks`. The plane is then unknown, and is
set so that the mean gap in contact is zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.contact import blocks, kernels
from roughslip.contact.influence import ROUGH, ROUNDED, Influence
from roughslip.contact.problem import Problem, nearest, plane_at_bounds, shifted, with_sum
from roughslip.errors import ConvergenceError

# Nearly full contact of a rough surface of 256 x 256 nodes takes some 70 at 1e-10.
PRODUCT_LIMIT = 2000

# lambda is multiplied by theta to this power. With 0.5 and 1 solves take 1 to 6 % more products.
ADAPTION = 0.75

# After so many steps in turn with theta below SHORT, nodes near their bounds hold each other, and a step of gradient
# projection parts them. A length that only has to adapt takes three. Without it 1 of 1200 random problems has no end.
SHORT, PATIENCE = 0.5, 5

# A given sum is restored where its error exceeds this share. A long theta multiplies the rounding of a small step, and
# steps that restore the sum on their way end where they no longer lower the energy.
SUM_ERROR = 1e-12

# Misfits and products are in single precision where displacements [m] are among its numbers, squares too.
LEAST_SINGLE = 1e-18

# Steps are multiplied in single precision, which leaves an error of ROUNDING of the residual at which the gap was last
# computed in double precision. It is computed again at REFRESH of that residual.
ROUNDING = 1e-6
REFRESH = 1e-5

# To tolerances from LOOSE on gaps are computed in single precision too, whose error is below a tenth of them, 3e-7 of
# B p. Gaps that steps of single precision have moved err as little, and need not be computed anew.
LOOSE = 1e-5

# Meshes up to COARSEST nodes start from zero, because coarser meshes would cost more than they save.
COARSEST = 64 * 64

# Residual of a guess on the coarser meshes. A smaller one gains nothing, because the error of the mesh dominates.
COARSE_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Solution:
    """Pressures and gaps with their residual.

    pressure : (nx, ny) [Pa]
    gap : (nx, ny) [m] B p - u_bar + plane, computed anew or with as small an error
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
    displacement: np.ndarray | None = None,
) -> Solution:
    """Solve a contact problem to a relative residual.

    problem : what to solve
    tolerance : [-] bound of the residual, for a gap computed anew from the pressure
    guess : (nx, ny) [Pa] where to start
    enough : whether a pressure and its gap, both (nx, ny), are known well enough to stop before the tolerance
    displacement : (nx, ny) [m] B guess where it is known, which saves a product

    Returns the solution. Raises ConvergenceError.

    Method: bound-constrained conjugate gradients, Vollebregt, J. Comput. Phys. 257 (2014) 333; with a sum, directions
    of zero sum, Polonsky and Keer, Wear 231 (1999) 206. There are three differences. The preconditioner is a stencil,
    which needs no second convolution. The line is searched along the step after its clip, so every step takes one
    product, and the energy never rises. The next direction is conjugated by that product, which remains valid when the
    set of free nodes changes.
    """
    iteration = _Iteration(problem, tolerance, guess, displacement)
    wanted, exact = tolerance, 1.0  # exact: the residual when the gap was last computed anew
    while True:
        residual = iteration.assess()
        if enough is not None and enough(iteration.pressure, iteration.gap):
            if not iteration.is_loose or problem.influence.rough_convolution is not None:
                iteration.compute_gap()
                residual = exact = iteration.assess()
            if enough(iteration.pressure, iteration.gap):
                return iteration.solution(residual)
        if residual <= wanted:
            wanted /= 2  # where the gap computed anew gives more, iterate before computing it once more
            if iteration.put_on_bounds():
                residual = exact = iteration.assess()
                if residual <= tolerance:
                    return iteration.solution(residual)
        elif residual <= REFRESH * exact and wanted < ROUNDING * exact:
            iteration.compute_gap()
            residual = exact = iteration.assess()
        iteration.advance(residual, tolerance)


def guess(problem: Problem) -> np.ndarray | None:
    """Pressures (nx, ny) [Pa] to start from, or None where zero is the better start.

    They are the solution on cells of twice the edge, which starts in the same way.
    """
    u_bar, influence = problem.interference, problem.influence
    if u_bar.size <= COARSEST:
        return None
    coarser, (nx, ny) = influence.coarser, u_bar.shape
    halved = coarser.grid.nx < nx, coarser.grid.ny < ny
    coarse_u_bar = _pair_means(u_bar) if halved[0] else u_bar
    coarse_u_bar = np.ascontiguousarray(_pair_means(coarse_u_bar.T).T) if halved[1] else coarse_u_bar
    pressure_sum = None if problem.pressure_sum is None else problem.pressure_sum * coarse_u_bar.size / u_bar.size
    if pressure_sum is None and not (coarse_u_bar > 0).any():
        return None
    coarse = Problem(coarser, coarse_u_bar, problem.cap, pressure_sum)
    try:
        iteration = _Iteration(coarse, COARSE_TOLERANCE, guess(coarse))
        while (residual := iteration.assess()) > COARSE_TOLERANCE:
            iteration.advance(residual, COARSE_TOLERANCE)
    except ConvergenceError:  # the solve on the fine mesh may still succeed
        return None
    pressure = np.repeat(iteration.pressure, 2, 0)[:nx] if halved[0] else iteration.pressure
    pressure = np.ascontiguousarray(np.repeat(pressure, 2, 1)[:, :ny]) if halved[1] else pressure
    return pressure if pressure_sum is not None else np.where(u_bar > 0, pressure, 0.0)


def _pair_means(field: np.ndarray) -> np.ndarray:
    """Means of neighbouring rows, first and second, third and fourth; an odd one at the end stays as it is."""
    means = field[::2].copy()
    means[: len(field) // 2] += field[1::2]
    means[: len(field) // 2] /= 2
    return means


class _Workspace(NamedTuple):
    """What a step is made of; compiled code takes it whole and writes into it.

    stencil : (5, 5) M, in the precision of misfits
    misfit, descent, product : (nx, ny) r, s, B t, in single precision where possible
    padded : (2, nx + 4, ny + 4) r between two rows and columns of zeros, and sums over its neighbours
    step : (nx, ny) t, in double precision, which keeps a given sum
    trial : (nx, ny) [Pa] p + lambda d
    free : (nx, ny) whether a node may move
    rows, edges : first length of a view of the fields of which blocks are columns, and their edges
    between : (2 m - 1,) [m/Pa] `Influence.between_blocks`
    local : LOCAL B_00 [m/Pa]
    """

    stencil: np.ndarray
    misfit: np.ndarray
    descent: np.ndarray
    product: np.ndarray
    padded: np.ndarray
    step: np.ndarray
    trial: np.ndarray
    free: np.ndarray
    rows: int
    edges: np.ndarray
    between: np.ndarray
    local: float


def _workspace(influence: Influence, precision: type[np.floating]) -> _Workspace:
    (nx, ny), (along, edges) = influence.grid.shape, blocks.block_edges(influence.grid)
    return _Workspace(
        stencil=influence.approximate_inverse.astype(precision),
        misfit=np.zeros((nx, ny), precision),
        descent=np.zeros((nx, ny), precision),
        product=np.zeros((nx, ny), precision),
        padded=np.zeros((2, nx + 4, ny + 4), precision),
        step=np.zeros((nx, ny)),
        trial=np.empty((nx, ny)),
        free=np.zeros((nx, ny), dtype=np.bool_),
        rows=1 if along else nx,
        edges=edges * ny if along else edges,
        between=influence.between_blocks,
        local=blocks.LOCAL * influence.diagonal,
    )


class _Iteration:
    """Fields of a solve, and the steps that change them.

    pressure, gap : (nx, ny) p [Pa] and B p - u_bar [m], without the plane
    work : arrays of the steps
    sum : of the pressures [Pa], where it is given
    length, usual_length : lambda, and lambda of the last step that was not short
    short_steps : number of short steps in turn
    curvature : t' B t; zero where there is no earlier step
    is_loose : whether gaps may be in single precision
    products : number of products with B
    """

    def __init__(
        self, problem: Problem, tolerance: float, guess: np.ndarray | None, displacement: np.ndarray | None = None
    ) -> None:
        self.problem, self.products, self.curvature = problem, 0, 0.0
        self.is_loose, self.plane, self.sum = tolerance >= LOOSE, 0.0, 0.0
        self.length, self.usual_length, self.short_steps = 1.0, 1.0, 0
        self.pressure, self.gap = self._start(guess, displacement)
        is_single = problem.pressure_sum is None or self._fits_single(self.pressure)
        self.work = _workspace(problem.influence, np.float32 if is_single else np.float64)

    def assess(self) -> float:
        """Find the plane, the misfit and the free nodes. Returns the relative residual.

        It is relative to ||max(u_bar - plane, 0)||, or to B_00 ||p|| where that is more; only under a load it may be.
        """
        problem, diagonal = self.problem, self.problem.influence.diagonal
        if problem.pressure_sum is None:
            scale = problem.scale
        else:
            mean, between, self.sum, square = kernels.sums(self.pressure, self.gap, problem.cap)
            self.plane = -mean if between else plane_at_bounds(self.pressure, self.gap)
            heights = kernels.positive_square(problem.interference, self.plane)
            scale = math.sqrt(max(heights, diagonal**2 * square))
        fields = self.pressure, self.gap, self.plane, diagonal, problem.cap, self.work.misfit, self.work.free
        return math.sqrt(kernels.assess(*fields)) / scale if scale > 0 else math.nan

    def compute_gap(self) -> None:
        """Compute the gap anew, to the precision that the tolerance asks for."""
        self.gap = self._displacement(self.pressure) - self.problem.interference

    def put_on_bounds(self) -> bool:
        """Put nodes that approach a bound on it, so that contact and yield are exact, and compute the gap anew.

        Returns False, and changes no pressure, where no node between the bounds is left to carry the rest of the sum.
        """
        cap, pressure_sum = self.problem.cap, self.problem.pressure_sum
        self.curvature = 0.0
        pressure = np.empty_like(self.pressure)
        kernels.on_bounds(self.pressure, self.gap, self.plane, self.problem.influence.diagonal, cap, pressure)
        if pressure_sum is not None:
            _, _, total, _ = kernels.sums(pressure, self.gap, cap)
            if abs(total - pressure_sum) > SUM_ERROR * pressure_sum:
                moved = shifted(pressure, (pressure > 0) & (pressure < cap), cap, pressure_sum)
                if moved is None:
                    return False
                pressure = moved
        self.pressure = pressure
        self.compute_gap()
        return True

    def solution(self, residual: float) -> Solution:
        """The present fields."""
        return Solution(self.pressure, self.gap + self.plane, self.plane, residual, self.products)

    def advance(self, residual: float, tolerance: float) -> None:
        """One iteration, after `assess`. Raises ConvergenceError where rounding leaves no step, and at the limit."""
        if self.products >= PRODUCT_LIMIT or not math.isfinite(residual):
            raise _failure(tolerance, residual, self.products)
        if self.restore_sum():
            return
        slope, clipped = self.choose_step()
        step, product = self.work.step, self.work.product
        self._multiply(step, product, ROUGH if self.is_loose else ROUNDED)
        state = self.pressure, self.gap, self.plane, self.problem.influence.diagonal, self.problem.cap
        self.curvature, theta = kernels.take_step(*state, slope, clipped, step, product)
        if not theta > 0:
            raise _failure(tolerance, residual, self.products)
        if theta >= SHORT:
            self.usual_length, self.short_steps = self.length, 0
        else:
            self.short_steps += 1
        self.length *= theta**ADAPTION

    def restore_sum(self) -> bool:
        """Restore a given sum of pressures, and compute the gap anew; False, and nothing, where the sum is right."""
        wanted = self.problem.pressure_sum
        if wanted is None or abs(self.sum - wanted) <= SUM_ERROR * wanted:
            return False
        self.pressure = with_sum(self.problem, self.pressure, self.work.free & (self.pressure > 0))
        self.curvature, self.length = 0.0, self.usual_length
        self.compute_gap()
        return True

    def choose_step(self) -> tuple[float, bool]:
        """t = clip(p + lambda d, 0, cap) - p, or where that does not descend a step of gradient projection.

        Returns the slope r' t, by which the energy falls per unit of theta, and whether the clip changed the step.
        """
        problem, work = self.problem, self.work
        if self.short_steps < PATIENCE:
            limits = problem.cap, problem.pressure_sum or 0.0
            slope, clipped = _search(work, self.pressure, self.curvature, self.length, *limits)
            if slope > 0:
                return slope, clipped > 0
        # The free nodes cannot carry the sum, so that further nodes must come into contact; or d is of no use.
        self.length, self.short_steps = self.usual_length, 0
        trial = self.pressure - self.gap / problem.influence.diagonal
        work.step[:] = nearest(problem, trial) - self.pressure
        return -kernels.inner(self.gap + self.plane, work.step), True

    def _start(self, guess: np.ndarray | None, displacement: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and gap of the guess; at a fixed plane it is scaled by an exact line search along itself."""
        u_bar, cap, pressure_sum = self.problem.interference, self.problem.cap, self.problem.pressure_sum
        highest = 0.0 if guess is None else float(guess.max())
        if guess is None or not highest > 0:
            if pressure_sum is None:
                return np.zeros_like(u_bar), -u_bar
            guess = np.full_like(u_bar, pressure_sum / u_bar.size)
            if self.problem.influence.periodic:
                return guess, -u_bar
        pressure, allowed = guess, guess.min() >= 0 and highest <= cap and pressure_sum is None
        if not allowed:
            pressure = with_sum(self.problem, np.minimum(np.maximum(guess, 0.0), cap), guess > 0)
        if displacement is None or not (allowed or np.array_equal(pressure, guess)):
            displacement = self._displacement(pressure)
        energy = kernels.inner(pressure, displacement)
        if pressure_sum is None and energy > 0:
            scale = kernels.inner(pressure, u_bar) / energy
            if 0 < scale * min(highest, cap) <= cap:
                pressure, displacement = scale * pressure, scale * displacement
        return pressure, displacement - u_bar

    def _displacement(self, pressure: np.ndarray) -> np.ndarray:
        """B p of whole pressures."""
        return self._multiply(pressure, error=ROUNDED if self.is_loose and self._fits_single(pressure) else 0.0)

    def _fits_single(self, pressure: np.ndarray) -> bool:
        return LEAST_SINGLE < self.problem.influence.diagonal * float(pressure.max()) < 1 / LEAST_SINGLE

    def _multiply(self, pressure: np.ndarray, result: np.ndarray | None = None, error: float = 0.0) -> np.ndarray:
        """B p, counted; written into the result where one is given, because large new arrays are slow."""
        self.products += 1
        return self.problem.influence.apply(pressure, result, error)


@compiled()
def _search(
    work: _Workspace, pressure: np.ndarray, curvature: float, length: float, cap: float, pressure_sum: float
) -> tuple[float, int]:
    """Write the next step t. Returns its slope r' t, zero where the free nodes cannot carry the sum, and its clips.

    curvature : of the last step
    length : lambda
    pressure_sum : [Pa] the given sum, zero for none
    """
    misfit, descent, step, free, rows = work.misfit, work.descent, work.step, work.free, work.rows
    given, shift, met = pressure_sum > 0, 0.0, True
    if work.between.size > 1:
        of_blocks, nodes = descent.reshape(rows, -1), free.reshape(rows, -1)
        means, numbers = blocks.block_means(misfit.reshape(rows, -1), nodes, work.edges)
        blocks.less_of_blocks(misfit.reshape(rows, -1), means, nodes, work.edges, of_blocks)
        kernels.stencil_product(work.stencil, descent, free, work.padded, descent)
        wanted = blocks.exchanged(work.between, means, numbers, work.local, given)
        means, _ = blocks.block_means(of_blocks, nodes, work.edges)
        blocks.less_of_blocks(of_blocks, means - wanted, nodes, work.edges, of_blocks)
    else:
        kernels.stencil_product(work.stencil, misfit, free, work.padded, descent)
    beta, mean = kernels.conjugation(descent, step, work.product, curvature, free, given)
    if given:
        kernels.trials(pressure, length, descent, step, beta, mean, free, work.trial)
        shift, met = kernels.shift_to_sum(work.trial, cap, pressure_sum, False)
    if not met:
        return 0.0, 0
    return kernels.clipped_step(pressure, length, descent, beta, mean, free, shift, cap, misfit, step)


def _failure(tolerance: float, residual: float, products: int) -> ConvergenceError:
    if math.isnan(residual):
        text = "the load is lost in the rounding of heights, as several nodes of one height share it: give more load"
        return ConvergenceError(text, residual, products)
    return ConvergenceError(
        f"the contact pressures did not reach the relative residual {tolerance:.1e}, of which rounding allows about "
        "1e-14: try a larger tolerance",
        residual,
        products,
        scene_keys="numerics.contact_tolerance",
    )
