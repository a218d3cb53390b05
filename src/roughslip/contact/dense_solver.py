"""Contact at up to about a thousand nodes: guess the set of pressed nodes, then factorise B on it."""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.contact.influence import Influence, direct_sum, gathered
from roughslip.contact.kernels import square_ratio
from roughslip.errors import ConvergenceError

# Nodes of a mesh up to which pressures, gap and residual come from one compiled call: a third of the time less at 100.
SMALL = 256

# Projected Gauss-Seidel sweeps before the first factor at most. Without them the first factors have far too many nodes,
# which takes 8 to 20 times as long at 90 to 200 nodes.
SWEEPS = 8

# Exchanges of all violating nodes that may fail to reduce their number before nodes are exchanged one by one.
PATIENCE = 10


def solve(influence: Influence, interference: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, int]:
    """Pressures of the contact problem, exact to rounding.

    influence : B of the mesh
    interference : (nx, ny) [m] finite, positive somewhere

    Returns pressure and gap B p - u_bar, both (nx, ny) [Pa] and [m], the relative residual of elastic contact, and the
    number of Cholesky factors. Raises ConvergenceError.

    Only nodes of positive interference enter. B has positive entries, so B p > 0 once any node is pressed. Where
    u_bar <= 0 the gap B p - u_bar is then positive, and p = 0.
    """
    if interference.size <= SMALL:
        pressure, gap, square, factors, is_solved = _small(influence.mirrored, influence.coefficients, interference)
    else:
        pressure, factors, is_solved = _pressures(influence.coefficients, interference)
        gap = influence.apply(pressure) - interference
        square = square_ratio(gap, pressure, influence.diagonal, interference, math.inf)
    if not is_solved:
        raise _failure(square, factors)
    return pressure, gap, math.sqrt(square), factors


def solve_each(influence: Influence, interferences: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pressures of many surfaces on a mesh of at most SMALL nodes, each as by `solve`.

    interferences : (k, nx, ny) [m], each positive somewhere

    Returns pressures (k, nx, ny) [Pa], residuals (k,) and numbers of factors (k,). Raises as `solve`.
    """
    pressures = np.empty(interferences.shape)
    squares, factors = np.empty(len(pressures)), np.empty(len(pressures), dtype=np.int64)
    end = _each(influence.mirrored, influence.coefficients, interferences, pressures, squares, factors)
    if end < len(pressures):
        raise _failure(squares[end], int(factors[end]))
    return pressures, np.sqrt(squares), factors


def _failure(square: float, factors: int) -> ConvergenceError:
    return ConvergenceError(
        "no set of pressed nodes has pressures and gaps of the right sign: try other heights, such as these with a "
        "rounding error added; scene key: seed",
        math.sqrt(square),
        factors,
    )


@compiled()
def _each(
    mirrored: np.ndarray,
    coefficients: np.ndarray,
    interferences: np.ndarray,
    pressures: np.ndarray,
    squares: np.ndarray,
    factors: np.ndarray,
) -> int:
    """Write what `_small` finds of each surface. Returns the first that is not solved, their number where all are."""
    for k in range(len(interferences)):
        pressure, _, squares[k], factors[k], is_solved = _small(mirrored, coefficients, interferences[k])
        if not is_solved:
            return k
        pressures[k] = pressure
    return len(interferences)


@compiled(error_model="numpy")
def _small(
    mirrored: np.ndarray, coefficients: np.ndarray, interference: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, int, bool]:
    pressure, factors, is_solved = _pressures(coefficients, interference)
    gap = np.empty_like(pressure)
    direct_sum(mirrored, np.flatnonzero(pressure), pressure, gap)
    gap -= interference
    return pressure, gap, square_ratio(gap, pressure, coefficients[0, 0], interference, np.inf), factors, is_solved


@compiled()
def _pressures(coefficients: np.ndarray, interference: np.ndarray) -> tuple[np.ndarray, int, bool]:
    i, j = np.nonzero(interference > 0)
    load = np.empty(i.size)
    for k in range(i.size):
        load[k] = interference[i[k], j[k]]
    solution, factors, is_solved = complementary_solution(gathered(coefficients, i, j), load)
    pressure = np.zeros(interference.shape)
    for k in range(i.size):
        pressure[i[k], j[k]] = solution[k]
    return pressure, factors, is_solved


@compiled()
def complementary_solution(matrix: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, int, bool]:
    """The x >= 0 with w = matrix x - load >= 0 and x w = 0, for a symmetric positive definite matrix.

    matrix : (n, n)
    load : (n,)

    Returns x (n,), the number of Cholesky factors, and whether x was found.

    Method: block principal pivoting, Judice and Pires, Comput. Oper. Res. 21 (1994) 587. All nodes that violate a sign
    change sides at once. When their number has not fallen for PATIENCE exchanges, only the last of them does (Murty),
    which cannot cycle. On 60 000 random contacts the first rule took 5 factors at most. The inverse of an influence
    matrix has (observed, not proven) negative off-diagonal entries, so nodes only leave a set that is too large.
    """
    n = load.size
    slack = 10 * n * np.finfo(np.float64).eps * np.max(np.abs(load))
    x, pressed = _gauss_seidel(matrix, load)
    violating = np.empty(n, dtype=np.bool_)
    minimum, patience, factors = n + 1, PATIENCE, 0
    while factors < 100 + 10 * n:
        factors += 1
        if not _solve_on(np.flatnonzero(pressed), matrix, load, x):
            break
        w = _misfit(matrix, load, x)
        for k in range(n):
            violating[k] = x[k] * matrix[k, k] < -slack if pressed[k] else w[k] < -slack
        count = int(np.count_nonzero(violating))
        if count == 0:
            return np.maximum(x, 0.0), factors, True
        if count < minimum:
            minimum, patience = count, PATIENCE
        elif patience > 0:
            patience -= 1
        if patience == 0:
            violating[: np.flatnonzero(violating)[-1]] = False
        pressed ^= violating
    return np.maximum(x, 0.0), factors, False


# In the loops below the inner one runs along a row without a sum, so it vectorises without reordering arithmetic.


@compiled()
def _gauss_seidel(matrix: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x after projected Gauss-Seidel sweeps from zero, until they change no sign, and where it is positive."""
    n = load.size
    x = np.zeros(n)
    w = -load
    for _ in range(SWEEPS):
        same = True
        for k in range(n):
            change = max(-w[k] / matrix[k, k], -x[k])
            if change != 0:
                before = x[k]
                x[k] = before + change
                same &= (before > 0) == (x[k] > 0)
                column = matrix[k]
                for m in range(n):
                    w[m] += column[m] * change
        if same:
            break
    return x, x > 0


@compiled()
def _misfit(matrix: np.ndarray, load: np.ndarray, x: np.ndarray) -> np.ndarray:
    """w = matrix x - load."""
    w = -load
    for k in np.flatnonzero(x):
        column, factor = matrix[k], x[k]
        for m in range(load.size):
            w[m] += column[m] * factor
    return w


@compiled()
def _solve_on(nodes: np.ndarray, matrix: np.ndarray, load: np.ndarray, x: np.ndarray) -> bool:
    """Solve matrix[nodes, nodes] x[nodes] = load[nodes] by Cholesky, x = 0 elsewhere; False if not definite."""
    n = nodes.size
    y = load[nodes]
    upper = np.empty((n, n))
    x[:] = 0.0
    for row in range(n):
        current = upper[row, row:]
        for m in range(n - row):
            current[m] = matrix[nodes[row], nodes[row + m]]
        for k in range(row):
            previous = upper[k, row:]
            factor = previous[0]
            for m in range(n - row):
                current[m] -= factor * previous[m]
            y[row] -= factor * y[k]
        if not current[0] > 0:
            return False
        scale = 1 / np.sqrt(current[0])
        for m in range(n - row):
            current[m] *= scale
        y[row] *= scale
    for row in range(n - 1, -1, -1):
        for m in range(row + 1, n):
            y[row] -= upper[row, m] * y[m]
        y[row] /= upper[row, row]
        x[nodes[row]] = y[row]
    return True
