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

EPSILON = float(np.finfo(np.float64).eps)


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
        pressures, gaps, residuals, factors = solve_each(influence, interference[None])
        return pressures[0], gaps[0], float(residuals[0]), int(factors[0])
    nodes = np.nonzero(interference > 0)
    found, count, is_solved = complementary_solution(gathered(influence.coefficients, *nodes), interference[nodes])
    pressure = np.zeros(interference.shape)
    pressure[nodes] = found
    gap = influence.apply(pressure) - interference
    square = square_ratio(gap, pressure, influence.diagonal, interference, math.inf)
    if not is_solved:
        raise _failure(square, count)
    return pressure, gap, math.sqrt(square), count


def solve_each(
    influence: Influence, interferences: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What `solve` returns of many surfaces on a mesh of at most SMALL nodes.

    interferences : (k, nx, ny) [m], each positive somewhere

    Returns pressures and gaps (k, nx, ny) [Pa] and [m], residuals (k,) and numbers of factors (k,). Raises as `solve`.
    """
    pressures, gaps = np.zeros((2, *interferences.shape))
    squares, factors = np.empty(len(pressures)), np.empty(len(pressures), dtype=np.int64)
    interferences = np.ascontiguousarray(interferences)
    end = _each(influence.mirrored, influence.coefficients, interferences, pressures, gaps, squares, factors)
    if end < len(pressures):
        raise _failure(squares[end], int(factors[end]))
    return pressures, gaps, np.sqrt(squares), factors


def _failure(square: float, factors: int) -> ConvergenceError:
    return ConvergenceError(
        "no set of pressed nodes has pressures and gaps of the right sign: try other heights, such as these with a "
        "rounding error added",
        math.sqrt(square),
        factors,
        scene_keys="seed",
    )


# Compiled code below takes plain loops, as each function of numpy takes longer to compile than the method itself.


@compiled()
def _each(
    mirrored: np.ndarray,
    coefficients: np.ndarray,
    interferences: np.ndarray,
    pressures: np.ndarray,
    gaps: np.ndarray,
    squares: np.ndarray,
    factors: np.ndarray,
) -> int:
    """Write what is found of each surface. Returns the first that is not solved, their number where all are.

    pressures : zeros
    """
    surfaces, nx, ny = interferences.shape
    i, j, kept = np.empty((3, nx * ny), dtype=np.int64)
    load = np.empty(nx * ny)
    for k in range(surfaces):
        interference, pressure, gap, count = interferences[k], pressures[k], gaps[k], 0
        for row in range(nx):
            for column in range(ny):
                if interference[row, column] > 0:
                    i[count], j[count], load[count] = row, column, interference[row, column]
                    count += 1
        matrix = gathered(coefficients, i[:count], j[:count])
        found, factors[k], is_solved = complementary_solution(matrix, load[:count])
        pressed = 0
        for node in range(count):
            if found[node] > 0:
                pressure[i[node], j[node]] = found[node]
                kept[pressed] = i[node] * ny + j[node]
                pressed += 1
        direct_sum(mirrored, kept[:pressed], pressure, gap)
        for row in range(nx):
            for column in range(ny):
                gap[row, column] -= interference[row, column]
        squares[k] = square_ratio(gap, pressure, coefficients[0, 0], interference, np.inf)
        if not is_solved:
            return k
    return surfaces


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
    largest = 0.0
    for k in range(n):
        largest = max(largest, abs(load[k]))
    slack = 10 * n * EPSILON * largest
    x, w, upper, nodes = np.zeros(n), np.empty(n), np.empty((n, n)), np.empty(n, dtype=np.int64)
    _gauss_seidel(matrix, load, x, w)
    pressed = x > 0
    minimum, patience, factors, is_solved = n + 1, PATIENCE, 0, False
    while factors < 100 + 10 * n and not is_solved:
        factors += 1
        count = 0
        for k in range(n):
            if pressed[k]:
                nodes[count] = k
                count += 1
        if not _solve_on(nodes[:count], matrix, load, x, upper):
            break
        _misfit(matrix, load, x, w)
        count = 0
        for k in range(n):
            if x[k] * matrix[k, k] < -slack if pressed[k] else w[k] < -slack:
                nodes[count] = k
                count += 1
        if count < minimum:
            minimum, patience = count, PATIENCE
        elif patience > 0:
            patience -= 1
        for m in range(count if patience > 0 else 1):
            k = nodes[count - 1 - m]
            pressed[k] = not pressed[k]
        is_solved = count == 0
    for k in range(n):
        x[k] = max(x[k], 0.0)
    return x, factors, is_solved


# In the loops below the inner one runs along a row without a sum, so it vectorises without reordering arithmetic.


@compiled()
def _gauss_seidel(matrix: np.ndarray, load: np.ndarray, x: np.ndarray, w: np.ndarray) -> None:
    """Write x after projected Gauss-Seidel sweeps from zero, until they change no sign."""
    n = load.size
    for k in range(n):
        w[k] = -load[k]
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


@compiled()
def _misfit(matrix: np.ndarray, load: np.ndarray, x: np.ndarray, w: np.ndarray) -> None:
    """Write w = matrix x - load."""
    for k in range(load.size):
        w[k] = -load[k]
    for k in range(load.size):
        if x[k] != 0:
            column, factor = matrix[k], x[k]
            for m in range(load.size):
                w[m] += column[m] * factor


@compiled()
def _solve_on(nodes: np.ndarray, matrix: np.ndarray, load: np.ndarray, x: np.ndarray, upper: np.ndarray) -> bool:
    """Solve matrix[nodes, nodes] x[nodes] = load[nodes] by Cholesky, x = 0 elsewhere; False if not definite."""
    n = nodes.size
    for k in range(x.size):
        x[k] = 0.0
    for row in range(n):
        current, own = upper[row, row:n], nodes[row]
        for m in range(n - row):
            current[m] = matrix[own, nodes[row + m]]
        x[own] = load[own]
        for k in range(row):
            previous = upper[k, row:n]
            factor = previous[0]
            for m in range(n - row):
                current[m] -= factor * previous[m]
            x[own] -= factor * x[nodes[k]]
        if not current[0] > 0:
            return False
        scale = 1 / math.sqrt(current[0])
        for m in range(n - row):
            current[m] *= scale
        x[own] *= scale
    for row in range(n - 1, -1, -1):
        own = nodes[row]
        for m in range(row + 1, n):
            x[own] -= upper[row, m] * x[nodes[m]]
        x[own] /= upper[row, row]
    return True
