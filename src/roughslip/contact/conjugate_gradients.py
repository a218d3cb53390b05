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
after the clip. Along a periodic belt s is corrected for long waves (`blocks`). The plane is then unknown, and is set so
that the mean gap in contact is zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.contact import blocks, kernels
from roughslip.contact.influence import Influence
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
        mean, between, _, _ = kernels.sums(pressure, gap, self.cap)
        if between:
            return -mean
        pressed = pressure > 0  # all at the cap and with the given sum: any plane that reaches these and no others
        if not pressed.any():
            return math.nan  # the load is lost in the rounding of the heights
        return -float(gap[pressed].max() if pressed.all() else (gap[pressed].max() + gap[~pressed].min()) / 2)

    @cached_property
    def scale(self) -> float:
        """The scale of residuals [m] at a given plane, ||max(u_bar, 0)||."""
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
    iteration = _Iteration(problem, guess, displacement)
    wanted, exact = tolerance, 1.0  # exact: the residual when the gap was last computed in double precision
    while True:
        residual = iteration.assess()
        if enough is not None and enough(iteration.pressure, iteration.gap):
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


def approximate(problem: Problem, tolerance: float, guess: np.ndarray | None) -> np.ndarray:
    """Pressures (nx, ny) [Pa] to a relative residual that is not checked anew. Raises ConvergenceError."""
    iteration = _Iteration(problem, guess)
    while (residual := iteration.assess()) > tolerance:
        iteration.advance(residual, tolerance)
    return iteration.pressure


class _Iteration:
    """Fields of a solve, and the steps that change them.

    pressure, gap : (nx, ny) p [Pa] and B p - u_bar [m], without the plane
    misfit, descent, product : (nx, ny) r, s, B t, in single precision; `levelled` is P r of a belt
    stencil : (5, 5) M, in the same precision
    padded : (nx + 4, ny + 4) r between two rows and columns of zeros
    along, across, exchange : edges of blocks, and C between them at a share of free nodes
    step : (nx, ny) t, in single precision at a fixed plane; a step in double precision keeps the sum
    trial : (nx, ny) [Pa] p + lambda d
    free : (nx, ny) whether a node may move
    sum, share : of the pressures [Pa], and of nodes between the bounds, where a sum is given
    length, usual_length : lambda, and lambda of the last step that was not short
    short_steps : number of short steps in turn
    curvature : t' B t; zero where there is no earlier step
    products : number of products with B
    """

    def __init__(self, problem: Problem, guess: np.ndarray | None, displacement: np.ndarray | None = None) -> None:
        self.problem, self.products, self.curvature = problem, 0, 0.0
        self.plane, self.sum, self.share, self.exchange_share = 0.0, 0.0, 0.0, 0.0
        self.length, self.usual_length, self.short_steps = 1.0, 1.0, 0
        self.pressure, self.gap = self._start(guess, displacement)
        shape, given = self.gap.shape, problem.pressure_sum is not None
        largest = problem.influence.diagonal * float(self.pressure.max())
        is_single = not given or LEAST_SINGLE < largest < 1 / LEAST_SINGLE
        precision = np.float32 if is_single else np.float64
        self.stencil = problem.influence.approximate_inverse.astype(precision)
        self.misfit, self.descent, self.product = (np.zeros(shape, precision) for _ in range(3))
        self.padded = np.zeros((shape[0] + 4, shape[1] + 4), precision)
        self.along, self.across = blocks.block_edges(problem.influence)
        self.exchange = np.zeros((1, 1))
        belt = given and max(self.along.size, self.across.size) > 2
        self.levelled = np.zeros(shape, precision) if belt else self.misfit
        self.step = np.zeros(shape, np.float64 if given else precision)
        self.trial = np.empty(shape)
        self.free = np.zeros(shape, dtype=np.bool_)

    def assess(self) -> float:
        """Find the plane, the misfit and the free nodes. Returns the relative residual.

        It is relative to ||max(u_bar - plane, 0)||, or to B_00 ||p|| where that is more; only under a load it may be.
        """
        problem, diagonal = self.problem, self.problem.influence.diagonal
        if problem.pressure_sum is None:
            scale = problem.scale
        else:
            mean, between, self.sum, square = kernels.sums(self.pressure, self.gap, problem.cap)
            self.plane = -mean if between else problem.plane(self.pressure, self.gap)
            self.share = between / self.gap.size
            heights = kernels.positive_square(problem.interference, self.plane)
            scale = math.sqrt(max(heights, diagonal**2 * square))
        fields = self.misfit, self.free
        square = kernels.assess(self.pressure, self.gap, self.plane, diagonal, problem.cap, *fields)
        return math.sqrt(square) / scale if scale > 0 else math.nan

    def compute_gap(self) -> None:
        """Compute the gap anew, in double precision."""
        self.gap = self._multiply(self.pressure) - self.problem.interference

    def put_on_bounds(self) -> bool:
        """Put nodes that approach a bound on it, so that contact and yield are exact, and compute the gap anew.

        Returns False, and changes no pressure, where no node between the bounds is left to carry the rest of the sum.
        """
        cap, pressure_sum = self.problem.cap, self.problem.pressure_sum
        self.curvature = 0.0
        pressure = kernels.on_bounds(self.pressure, self.gap, self.plane, self.problem.influence.diagonal, cap)
        if pressure_sum is not None:
            shifted = _shifted(pressure, (pressure > 0) & (pressure < cap), cap, pressure_sum)
            if shifted is None:
                return False
            pressure = shifted
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
        self._multiply(self.step, self.product, rounded=True)
        state = self.pressure, self.gap, self.plane, self.problem.influence.diagonal, self.problem.cap
        self.curvature, theta = kernels.take_step(*state, slope, clipped, self.step, self.product)
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
        self.pressure = _with_sum(self.problem, self.pressure, self.free & (self.pressure > 0))
        self.curvature, self.length = 0.0, self.usual_length
        self.compute_gap()
        return True

    def choose_step(self) -> tuple[float, bool]:
        """t = clip(p + lambda d, 0, cap) - p, or where that does not descend a step of gradient projection.

        Returns the slope r' t, by which the energy falls per unit of theta, and whether the clip changed the step.
        """
        problem = self.problem
        if self.levelled is not self.misfit and not 0.9 < self.share / (self.exchange_share or math.inf) < 1.1:
            self.exchange_share = max(self.share, 1 / self.gap.size)
            count = (self.along.size - 1) * (self.across.size - 1)
            self.exchange = blocks.exchange(problem.influence, count, self.exchange_share)
        if self.short_steps < PATIENCE:
            nodes = self.stencil, self.misfit, self.free, self.padded, self.descent
            belt = self.along, self.across, self.exchange, self.levelled
            before = self.step, self.product, self.curvature, self.pressure, self.length
            slope, clipped = _search(*nodes, *belt, *before, problem.cap, problem.pressure_sum or 0.0, self.trial)
            if slope > 0:
                return slope, clipped > 0
        # The free nodes cannot carry the sum, so that further nodes must come into contact; or d is of no use.
        self.length, self.short_steps = self.usual_length, 0
        trial = self.pressure - self.gap / problem.influence.diagonal
        self.step[:] = _nearest(problem, trial) - self.pressure
        return -kernels.inner(self.gap + self.plane, self.step.astype(np.float64, copy=False)), True

    def _start(self, guess: np.ndarray | None, displacement: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and gap of the guess; at a fixed plane it is scaled by an exact line search along itself."""
        u_bar, cap, pressure_sum = self.problem.interference, self.problem.cap, self.problem.pressure_sum
        if guess is None or not guess.any():
            if pressure_sum is None:
                return np.zeros_like(u_bar), -u_bar
            guess = np.full_like(u_bar, pressure_sum / u_bar.size)
            displacement = np.zeros_like(u_bar) if self.problem.influence.periodic else None
        pressure = np.minimum(np.maximum(guess, 0.0), cap)
        pressure = _with_sum(self.problem, pressure, pressure > 0)
        if displacement is None or not np.array_equal(pressure, guess):
            displacement = self._multiply(pressure)
        energy = kernels.inner(pressure, displacement)
        if pressure_sum is None and energy > 0:
            scale = kernels.inner(pressure, u_bar) / energy
            if 0 < scale * float(pressure.max()) <= cap:
                pressure, displacement = scale * pressure, scale * displacement
        return pressure, displacement - u_bar

    def _multiply(self, pressure: np.ndarray, result: np.ndarray | None = None, rounded: bool = False) -> np.ndarray:
        """B p, counted; written into the result where one is given, because large new arrays are slow."""
        self.products += 1
        return self.problem.influence.apply(pressure, result, rounded)


@compiled()
def _search(
    stencil: np.ndarray,
    misfit: np.ndarray,
    free: np.ndarray,
    padded: np.ndarray,
    descent: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
    exchange: np.ndarray,
    levelled: np.ndarray,
    step: np.ndarray,
    product: np.ndarray,
    curvature: float,
    pressure: np.ndarray,
    length: float,
    cap: float,
    pressure_sum: float,
    trial: np.ndarray,
) -> tuple[float, int]:
    """Write the next step t. Returns its slope r' t, zero where the free nodes cannot carry the sum, and its clips.

    pressure_sum : [Pa] the given sum, zero for none
    """
    force, number = np.zeros(1), np.ones(1)
    if exchange.size > 1:
        force, number = blocks.block_sums(misfit, free, along, across)
    if exchange.size > 1 and number.min() > blocks.LEAST_SHARE * number.mean():
        blocks.add_to_blocks(misfit, -force / number, free, along, across, levelled)
        kernels.stencil_product(stencil, levelled, free, padded, descent)
        mean = blocks.block_sums(descent, free, along, across)[0] / number
        blocks.add_to_blocks(descent, (exchange * force).sum(axis=1) - mean, free, along, across, descent)
    else:
        kernels.stencil_product(stencil, misfit, free, padded, descent)
    given, shift, met = pressure_sum > 0, 0.0, True
    kernels.trials(pressure, length, descent, step, product, curvature, free, given, trial)
    if given:
        shift, met = kernels.shift_to_sum(trial, cap, pressure_sum, False)
    return kernels.clipped_step(pressure, trial, shift, cap, misfit, step) if met else (0.0, 0)


def _failure(tolerance: float, residual: float, products: int) -> ConvergenceError:
    if math.isnan(residual):
        text = (
            "the load is lost in the rounding of the heights, as several nodes of one height share it: give more load"
        )
        return ConvergenceError(text, residual, products)
    return ConvergenceError(
        f"the contact pressures did not reach the relative residual {tolerance:.1e}, of which rounding allows about "
        "1e-14: try a larger tolerance; scene key: numerics.contact_tolerance",
        residual,
        products,
    )


def _shifted(pressure: np.ndarray, nodes: np.ndarray, cap: float, pressure_sum: float) -> np.ndarray | None:
    """Pressures shifted at the nodes, where they are positive, until the sum is as wanted; None where it cannot be.

    Elsewhere pressures are zero or the cap.
    """
    trial = np.where(nodes | (pressure == 0), pressure, np.inf)
    shift, met = kernels.shift_to_sum(trial, cap, pressure_sum, False)
    return np.where(nodes, np.minimum(np.maximum(pressure + shift, 0.0), cap), pressure) if met else None


def _with_sum(problem: Problem, pressure: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Pressures of the given sum: shifted at the nodes, or the allowed ones nearest, where these cannot carry it."""
    if problem.pressure_sum is None:
        return pressure
    shifted = _shifted(pressure, nodes, problem.cap, problem.pressure_sum)
    return _nearest(problem, pressure) if shifted is None else shifted


def _nearest(problem: Problem, trial: np.ndarray) -> np.ndarray:
    """The allowed pressures nearest to a trial."""
    shift = 0.0
    if problem.pressure_sum is not None:
        shift, _ = kernels.shift_to_sum(trial, problem.cap, problem.pressure_sum, True)
    return np.minimum(np.maximum(trial + shift, 0.0), problem.cap)
