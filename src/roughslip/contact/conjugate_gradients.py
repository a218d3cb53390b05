"""Contact on large meshes: conjugate gradients over the pressed nodes, bounded by p >= 0, with B applied by FFT."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from roughslip.contact.influence import Influence
from roughslip.contact.residual import inner, relative_residual
from roughslip.errors import ConvergenceError

# Ten times what the hardest of 60 000 random surfaces (cells of aspect up to 300) took at a tolerance of 1e-10.
PRODUCT_LIMIT = 1000


def solve(
    influence: Influence, interference: np.ndarray, tolerance: float, initial_pressure: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, int]:
    """Pressures and gaps of the contact problem to a relative residual.

    influence : B of the mesh
    interference : (nx, ny) [m] finite, positive somewhere
    tolerance : bound of relative_residual, met by a gap computed afresh from the pressure
    initial_pressure : (nx, ny) [Pa] a guess, not negative

    Returns pressure (nx, ny) [Pa], gap (nx, ny) [m] and the number of products with B. Raises ConvergenceError.

    Method: bound-constrained conjugate gradients, Vollebregt, J. Comput. Phys. 257 (2014) 333. A step is exact along a
    direction on the nodes that are pressed or penetrate; pressures that turn negative are set to zero. Two differences:
    the preconditioner is a stencil and costs no second convolution, and the next direction is conjugated by the product
    B d at hand, which still holds after the set has changed.
    """
    pressure, gap, work = _start(influence, interference, initial_pressure)
    direction = product = None
    while True:
        residual = relative_residual(gap, pressure, influence.diagonal, interference)
        if residual <= tolerance:
            # Nodes that are on their way out of contact count as out; then the gap once more, without its recurrence.
            pressure = np.where(influence.diagonal * pressure > gap, pressure, 0.0)
            gap = influence.apply(pressure) - interference
            work += 1
            residual = relative_residual(gap, pressure, influence.diagonal, interference)
            if residual <= tolerance:
                return pressure, gap, work
            direction = None
        if work >= PRODUCT_LIMIT or not math.isfinite(residual):
            raise ConvergenceError(
                f"the contact pressures did not reach the relative residual {tolerance:.1e}; try a larger tolerance"
                " (rounding allows about 1e-14), or cells nearer to square",
                residual,
                work,
            )
        active = (pressure > 0) | (gap < 0)
        misfit = np.where(active, -gap, 0.0)
        descent = _stencil_product(influence.approximate_inverse, misfit, active)
        if direction is None or product is None:
            direction = descent
        else:
            conjugation = max(0.0, -inner(descent, product) / inner(direction, product))
            direction = np.where(active, descent + conjugation * direction, 0.0)
            if inner(misfit, direction) <= 0:
                direction = descent
        product = influence.apply(direction)
        length = inner(misfit, direction) / inner(direction, product)
        trial = pressure + length * direction
        pressure = np.maximum(trial, 0.0)
        gap += length * product
        work += 1
        if (trial < 0).any():
            gap += influence.apply(pressure - trial)
            work += 1


def _start(
    influence: Influence, interference: np.ndarray, guess: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, int]:
    """The guess, scaled by an exact line search along itself, or no pressure; its gap; products spent."""
    pressure = np.zeros(influence.grid.shape) if guess is None else np.where(interference > 0, guess, 0.0)
    if not pressure.any():
        return pressure, -interference, 0
    displacement = influence.apply(pressure)
    scale = inner(pressure, interference) / inner(pressure, displacement)
    return scale * pressure, scale * displacement - interference, 1


@njit(cache=True)
def _stencil_product(stencil: np.ndarray, field: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """The stencil applied to a field, at the given nodes alone; the field is zero off the mesh."""
    nx, ny = field.shape
    reach = stencil.shape[0] // 2
    result = np.zeros((nx, ny))
    for i in range(nx):
        for k in range(max(0, i - reach), min(nx, i + reach + 1)):
            for shift in range(-reach, reach + 1):
                weight = stencil[k - i + reach, shift + reach]
                target = result[i, max(0, -shift) : ny - max(0, shift)]
                source = field[k, max(0, shift) : ny + min(0, shift)]
                for j in range(target.size):
                    target[j] += weight * source[j]
        for j in range(ny):
            if not nodes[i, j]:
                result[i, j] = 0.0
    return result
