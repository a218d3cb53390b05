"""Compiled passes over the fields of a contact solve, each of which reads and writes every array once.

Every sum has one partial sum per column. This vectorises without reordering a sum, and the rounding error grows with
the number of rows only. All fields are (nx, ny) and contiguous.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation.cache import compiled


@compiled()
def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of a b."""
    nx, ny = a.shape
    partial = np.zeros(ny)
    for i in range(nx):
        for j in range(ny):
            partial[j] += a[i, j] * b[i, j]
    return partial.sum()


@compiled()
def total(a: np.ndarray) -> float:
    """Sum of a."""
    nx, ny = a.shape
    partial = np.zeros(ny)
    for i in range(nx):
        for j in range(ny):
            partial[j] += a[i, j]
    return partial.sum()


@compiled()
def mean_between(values: np.ndarray, pressure: np.ndarray, cap: float) -> tuple[float, int]:
    """Mean of the values where 0 < p < cap, and the number of such nodes."""
    nx, ny = values.shape
    partial = np.zeros(ny)
    count = np.zeros(ny, dtype=np.int64)
    for i in range(nx):
        for j in range(ny):
            inside = (pressure[i, j] > 0) & (pressure[i, j] < cap)
            partial[j] += values[i, j] if inside else 0.0
            count[j] += inside
    nodes = count.sum()
    return partial.sum() / max(nodes, 1), nodes


@compiled()
def assess(
    pressure: np.ndarray,
    gap: np.ndarray,
    offset: float,
    diagonal: float,
    cap: float,
    misfit: np.ndarray,
    free: np.ndarray,
) -> float:
    """Squared residual; also writes which nodes are free and the misfit, -w at free nodes and zero elsewhere.

    pressure : (nx, ny) [Pa] p
    gap, offset : (nx, ny) [m] and [m]; w = gap + offset
    diagonal, cap : B_00 [m/Pa] and the highest pressure [Pa]
    misfit, free : (nx, ny) results

    A node is free if a short step along its misfit keeps 0 <= p <= cap. The residual of a node is
    B_00 p - clip(B_00 p - w, 0, B_00 cap), which is min(B_00 p, w) without a cap.
    """
    nx, ny = pressure.shape
    partial = np.zeros(ny)
    highest = diagonal * cap
    for i in range(nx):
        for j in range(ny):
            p = pressure[i, j]
            w = gap[i, j] + offset
            own = diagonal * p  # displacement by the node's own pressure
            target = min(max(own - w, 0.0), highest)
            partial[j] += (own - target) * (own - target)
            may_move = ((p > 0) | (w < 0)) & ((p < cap) | (w > 0))
            free[i, j] = may_move
            misfit[i, j] = -w if may_move else 0.0
    return partial.sum()


@compiled()
def conjugate(descent: np.ndarray, factor: float, step: np.ndarray, free: np.ndarray, direction: np.ndarray) -> None:
    """direction <- descent + factor step on the free nodes, zero elsewhere."""
    nx, ny = descent.shape
    for i in range(nx):
        for j in range(ny):
            direction[i, j] = descent[i, j] + factor * step[i, j] if free[i, j] else 0.0


@compiled()
def balance(direction: np.ndarray, uniform_descent: np.ndarray) -> None:
    """direction <- direction - factor uniform_descent, so that its sum is zero."""
    nx, ny = direction.shape
    factor = total(direction) / total(uniform_descent)
    for i in range(nx):
        for j in range(ny):
            direction[i, j] -= factor * uniform_descent[i, j]


@compiled()
def clipped_step(
    pressure: np.ndarray,
    length: float,
    direction: np.ndarray,
    cap: float,
    shift: float,
    free: np.ndarray,
    misfit: np.ndarray,
    step: np.ndarray,
) -> tuple[float, int]:
    """Write the step from p to p + length d, plus the shift where that is positive and free, clipped to [0, cap].

    Returns inner(misfit, step) and the number of nodes that were clipped.
    """
    nx, ny = pressure.shape
    partial = np.zeros(ny)
    count = np.zeros(ny, dtype=np.int64)
    for i in range(nx):
        for j in range(ny):
            p = pressure[i, j]
            trial = p + length * direction[i, j]
            moved = trial + shift if free[i, j] & (trial > 0) else trial
            allowed = min(max(moved, 0.0), cap)
            count[j] += allowed != moved
            step[i, j] = allowed - p
            partial[j] += misfit[i, j] * (allowed - p)
    return partial.sum(), count.sum()


@compiled()
def room(pressure: np.ndarray, step: np.ndarray, cap: float) -> float:
    """How many times a step fits between the bounds."""
    nx, ny = pressure.shape
    most = 0.0
    for i in range(nx):
        for j in range(ny):
            t = step[i, j]
            if t != 0:
                most = max(most, -t / pressure[i, j] if t < 0 else t / (cap - pressure[i, j]))
    return 1 / most


@compiled()
def move(
    pressure: np.ndarray, gap: np.ndarray, factor: float, step: np.ndarray, product: np.ndarray, cap: float
) -> None:
    """p <- p + factor step, between the bounds, and gap <- gap + factor product."""
    nx, ny = pressure.shape
    for i in range(nx):
        for j in range(ny):
            pressure[i, j] = min(max(pressure[i, j] + factor * step[i, j], 0.0), cap)
            gap[i, j] += factor * product[i, j]


@compiled()
def shift_to_sum(
    pressure: np.ndarray,
    length: float,
    direction: np.ndarray,
    cap: float,
    pressure_sum: float,
    free: np.ndarray,
    everywhere: bool,
) -> tuple[float, bool]:
    """The shift for which clip(p + length d + shift, 0, cap) has the sum `pressure_sum`, and whether there is one.

    everywhere : whether all nodes are shifted, or only the free nodes with positive p + length d

    Method: the sum is piecewise linear in the shift and never falls, so Newton's method is used, within a bracket.
    """
    nx, ny = pressure.shape
    shift, low, high = 0.0, -np.inf, np.inf
    for _ in range(200):
        sum_, between, top, bottom = 0.0, 0, -np.inf, np.inf
        for i in range(nx):
            for j in range(ny):
                trial = pressure[i, j] + length * direction[i, j]
                if everywhere | (free[i, j] & (trial > 0)):
                    value = trial + shift
                    top, bottom = max(top, trial), min(bottom, trial)
                    sum_ += min(max(value, 0.0), cap)
                    between += (value > 0) & (value < cap)
                else:
                    sum_ += min(max(trial, 0.0), cap)
        missing = pressure_sum - sum_
        if abs(missing) <= 4e-16 * pressure_sum:
            return shift, True
        if missing > 0:
            low = shift
        else:
            high = shift
        step = missing / between if between > 0 else np.inf
        if low < shift + step < high:
            shift += step
        elif np.isfinite(low) and np.isfinite(high):
            shift = (low + high) / 2
        elif missing < 0:
            shift = -top  # all at zero
        else:  # all at the cap, or without one the highest with the whole sum
            shift = cap - bottom if np.isfinite(cap) else pressure_sum - top
        if not (low < shift < high):
            break
    rounding = 1e-15 * between * max(abs(top), abs(bottom))
    return shift, abs(missing) <= 1e-12 * pressure_sum + rounding


@compiled()
def positive_square(interference: np.ndarray, plane: float) -> float:
    """||max(u_bar - plane, 0)||^2."""
    nx, ny = interference.shape
    partial = np.zeros(ny)
    for i in range(nx):
        for j in range(ny):
            height = max(interference[i, j] - plane, 0.0)
            partial[j] += height * height
    return partial.sum()


@compiled()
def stencil_product(stencil: np.ndarray, field: np.ndarray, nodes: np.ndarray, result: np.ndarray) -> None:
    """Write a stencil of 5 x 5 nodes, even on both axes, applied to a field at the given nodes; zero elsewhere.

    The field is zero outside the mesh.
    """
    nx, ny = field.shape
    pair = np.zeros(ny + 4)  # a row between two zeros on either side
    inside = pair[2 : ny + 2]
    for i in range(nx):
        row, wanted = result[i], nodes[i]
        row[:] = 0.0
        if not wanted.any():
            continue
        for far in range(3):  # rows at equal distances are added before they are weighed
            before, after = i >= far, far > 0 and i + far < nx
            if before and after:
                one, other = field[i - far], field[i + far]
                for j in range(ny):
                    inside[j] = one[j] + other[j]
            elif before or after:
                one = field[i - far if before else i + far]
                for j in range(ny):
                    inside[j] = one[j]
            else:
                continue
            w0, w1, w2 = stencil[2 + far, 2], stencil[2 + far, 3], stencil[2 + far, 4]
            for j in range(ny):
                row[j] += w0 * pair[j + 2] + w1 * (pair[j + 1] + pair[j + 3]) + w2 * (pair[j] + pair[j + 4])
        for j in range(ny):
            row[j] = row[j] if wanted[j] else 0.0


def relative_residual(
    gap: np.ndarray,
    pressure: np.ndarray,
    diagonal: float,
    interference: np.ndarray,
    hardness_pa: float = math.inf,
) -> float:
    """How far pressures and gaps are from the conditions of contact; zero at the solution only.

    gap : (nx, ny) [m] w = B p - u_bar, to which plastic displacement has not been added
    pressure : (nx, ny) [Pa]
    diagonal : B_00 [m/Pa]
    interference : (nx, ny) [m] u_bar
    hardness_pa : H [Pa], the highest pressure

    Returns ||B_00 p - clip(B_00 p - w, 0, B_00 H)|| / max(||max(u_bar, 0)||, B_00 ||p||) [-]. Without H the numerator
    is ||min(w, B_00 p)||. The second scale is larger in a periodic cell only, whose mean pressure has no displacement.
    On a free half-space u_bar = B p + u_plastic >= B_00 p in contact.
    """
    return math.sqrt(_square_ratio(gap, pressure, diagonal, interference, hardness_pa))


@compiled(error_model="numpy")
def _square_ratio(
    gap: np.ndarray, pressure: np.ndarray, diagonal: float, interference: np.ndarray, hardness: float
) -> float:
    nx, ny = pressure.shape
    largest = 0.0  # scaled by it, squares neither overflow nor vanish
    for i in range(nx):
        for j in range(ny):
            largest = max(largest, interference[i, j], diagonal * pressure[i, j])
    unmet, heights, displacements = np.zeros(ny), np.zeros(ny), np.zeros(ny)
    for i in range(nx):
        for j in range(ny):
            own = diagonal * pressure[i, j]
            step = (own - min(max(own - gap[i, j], 0.0), diagonal * hardness)) / largest
            height = max(interference[i, j], 0.0) / largest
            unmet[j] += step * step
            heights[j] += height * height
            displacements[j] += (own / largest) ** 2
    return unmet.sum() / max(heights.sum(), displacements.sum())


@compiled()
def gap_errors(pressure: np.ndarray, gap: np.ndarray, cap: float) -> tuple[float, float]:
    """Largest -w of nodes below the cap, and largest w of nodes under pressure; neither is negative."""
    nx, ny = gap.shape
    up, down = np.zeros(ny), np.zeros(ny)
    for i in range(nx):
        for j in range(ny):
            up[j] = max(up[j], -gap[i, j] if pressure[i, j] < cap else 0.0)
            down[j] = max(down[j], gap[i, j] if pressure[i, j] > 0 else 0.0)
    return up.max(), down.max()
