"""Compiled passes over the fields of a contact solve, each of which reads and writes every array once.

Every sum has LANES partial sums. This vectorises without reordering a sum, on narrow meshes too, and the rounding error
grows with the nodes of a lane only. All fields are (nx, ny) and contiguous. Pressures, gaps and sums are in double
precision; misfits and steps may be in single precision.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.validation import gate

LANES = 128
NEGLIGIBLE = 1e-12  # displacement of a node by its own pressure, over its gap


@compiled()
def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of a b, whose products may be too small for single precision."""
    flat_a, flat_b = a.reshape(-1), b.reshape(-1)
    partial = np.zeros(LANES)
    for first in range(0, a.size, LANES):
        x, y = flat_a[first : first + LANES], flat_b[first : first + LANES]
        for k in range(x.size):
            partial[k] += np.float64(x[k]) * np.float64(y[k])
    return partial.sum()


@compiled()
def total(a: np.ndarray) -> float:
    """Sum of a."""
    flat = a.reshape(-1)
    partial = np.zeros(LANES)
    for first in range(0, a.size, LANES):
        x = flat[first : first + LANES]
        for k in range(x.size):
            partial[k] += x[k]
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
    flat_p, flat_w = pressure.reshape(-1), gap.reshape(-1)
    flat_r, flat_free = misfit.reshape(-1), free.reshape(-1)
    partial = np.zeros(LANES)
    highest = diagonal * cap
    for first in range(0, pressure.size, LANES):
        end = first + LANES
        p, w, r, moves = flat_p[first:end], flat_w[first:end], flat_r[first:end], flat_free[first:end]
        for k in range(p.size):
            above = w[k] + offset
            own = diagonal * p[k]  # displacement by the node's own pressure
            target = min(max(own - above, 0.0), highest)
            partial[k] += (own - target) * (own - target)
            may_move = ((p[k] > 0) | (above < 0)) & ((p[k] < cap) | (above > 0))
            moves[k] = may_move
            r[k] = -above if may_move else 0.0
    return partial.sum()


@compiled()
def conjugate(
    descent: np.ndarray,
    step: np.ndarray,
    product: np.ndarray,
    curvature: float,
    free: np.ndarray,
    direction: np.ndarray,
) -> None:
    """direction <- descent + beta step on the free nodes, zero elsewhere.

    beta = -inner(descent, product) / curvature, from the product of the step and its curvature, neither negative; zero
    where there is no earlier step.
    """
    beta = max(0.0, -inner(descent, product) / curvature) if curvature > 0 else 0.0
    s, t, moves, d = descent.reshape(-1), step.reshape(-1), free.reshape(-1), direction.reshape(-1)
    rounded = direction.dtype.type(beta)
    for k in range(d.size):
        d[k] = s[k] + rounded * t[k] if moves[k] else direction.dtype.type(0.0)


@compiled()
def balance(direction: np.ndarray, uniform_descent: np.ndarray) -> None:
    """direction <- direction - factor uniform_descent, so that its sum is zero."""
    d, uniform = direction.reshape(-1), uniform_descent.reshape(-1)
    factor = total(direction) / total(uniform_descent)
    for k in range(d.size):
        d[k] -= factor * uniform[k]


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
    flat_p, flat_d, flat_free = pressure.reshape(-1), direction.reshape(-1), free.reshape(-1)
    flat_r, flat_t = misfit.reshape(-1), step.reshape(-1)
    partial = np.zeros(LANES)
    count = np.zeros(LANES, dtype=np.int64)
    for first in range(0, pressure.size, LANES):
        end = first + LANES
        p, d, moves, r, t = (
            flat_p[first:end],
            flat_d[first:end],
            flat_free[first:end],
            flat_r[first:end],
            flat_t[first:end],
        )
        for k in range(p.size):
            trial = p[k] + length * d[k]
            moved = trial + shift if moves[k] & (trial > 0) else trial
            allowed = min(max(moved, 0.0), cap)
            count[k] += allowed != moved
            t[k] = allowed - p[k]
            partial[k] += r[k] * (allowed - p[k])
    return partial.sum(), count.sum()


@compiled()
def on_bounds(pressure: np.ndarray, gap: np.ndarray, offset: float, diagonal: float, cap: float) -> np.ndarray:
    """Pressures, those on a bound that approach it: p - w / B_00 <= 0, or >= cap; arguments as of `assess`."""
    result = np.empty_like(pressure)
    p, w, trial = pressure.reshape(-1), gap.reshape(-1), result.reshape(-1)
    for k in range(p.size):
        target = p[k] - (w[k] + offset) / diagonal
        trial[k] = 0.0 if target <= 0 else (cap if target >= cap else p[k])
    return result


@compiled()
def room(pressure: np.ndarray, step: np.ndarray, cap: float) -> float:
    """How many times a step fits between the bounds."""
    nx, ny = pressure.shape
    maximum = 0.0
    for i in range(nx):
        for j in range(ny):
            t = step[i, j]
            if t != 0:
                maximum = max(maximum, -t / pressure[i, j] if t < 0 else t / (cap - pressure[i, j]))
    return 1 / maximum


@compiled()
def move(
    pressure: np.ndarray,
    gap: np.ndarray,
    offset: float,
    diagonal: float,
    cap: float,
    factor: float,
    step: np.ndarray,
    product: np.ndarray,
) -> None:
    """p <- p + factor step, between the bounds, and gap <- gap + factor product.

    Pressures that the step takes to a bound, but for its rounding, are on the bound. So are pressures of no weight
    against the gap. Short steps would never take them off, and the plane under a load is a mean over nodes in contact.
    """
    minimum = NEGLIGIBLE / diagonal
    p, w, t, lifted = pressure.reshape(-1), gap.reshape(-1), step.reshape(-1), product.reshape(-1)
    rounding = 2.0 * np.finfo(step.dtype).eps
    nearly = cap * (1.0 - rounding)
    for k in range(p.size):
        trial = p[k] + factor * t[k]
        at = cap if trial >= nearly else trial
        p[k] = at if at > max(rounding * p[k], minimum * (w[k] + offset)) else 0.0
        w[k] += factor * lifted[k]


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

    Method: the sum is piecewise linear in the shift and never falls, so Newton's method is used, within a bracket. The
    trials that are shifted are gathered once.
    """
    p, d, is_free = pressure.reshape(-1), direction.reshape(-1), free.reshape(-1)
    trials, shifted = np.empty(p.size), 0
    others, top, bottom = 0.0, -np.inf, np.inf
    for k in range(p.size):
        trial = p[k] + length * d[k]
        if everywhere | (is_free[k] & (trial > 0)):
            trials[shifted] = trial
            shifted += 1
            top, bottom = max(top, trial), min(bottom, trial)
        else:
            others += min(max(trial, 0.0), cap)
    shift, low, high = 0.0, -np.inf, np.inf
    for _ in range(200):
        sum_, between = others, 0
        for k in range(shifted):
            value = trials[k] + shift
            sum_ += min(max(value, 0.0), cap)
            between += (value > 0) & (value < cap)
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


@compiled(fastmath={"contract"})
def stencil_product(
    stencil: np.ndarray, field: np.ndarray, nodes: np.ndarray, padded: np.ndarray, result: np.ndarray
) -> None:
    """Write a stencil of 5 x 5 nodes, even on both axes, applied to a field at the given nodes; zero elsewhere.

    The field is zero outside the mesh. It is copied into `padded` : (nx + 4, ny + 4), whose border is zero, so that
    some rows of a narrow mesh are one row of the padded one.
    """
    nx, ny = field.shape
    width = ny + 4
    for i in range(nx):
        for j in range(ny):
            padded[i + 2, j + 2] = field[i, j]
    flat = padded.reshape(-1)
    w00, w01, w02 = stencil[2, 2], stencil[2, 3], stencil[2, 4]
    w10, w11, w12 = stencil[3, 2], stencil[3, 3], stencil[3, 4]
    w20, w21, w22 = stencil[4, 2], stencil[4, 3], stencil[4, 4]
    rows = max(1, LANES // ny)
    sums = np.empty(rows * width, stencil.dtype)
    for first in range(0, nx, rows):
        end = min(first + rows, nx)
        if not nodes[first:end].any():
            result[first:end] = 0.0
            continue
        length = (end - first) * width - 4
        start = (first + 2) * width + 2
        c = flat[start - 2 : start + length + 2]
        a, b = (
            flat[start - 2 - width : start + length + 2 - width],
            flat[start - 2 + width : start + length + 2 + width],
        )
        e = flat[start - 2 - 2 * width : start + length + 2 - 2 * width]
        f = flat[start - 2 + 2 * width : start + length + 2 + 2 * width]
        for k in range(length):
            sums[k] = (
                (w00 * c[k + 2] + w01 * (c[k + 1] + c[k + 3]) + w02 * (c[k] + c[k + 4]))
                + (w10 * (a[k + 2] + b[k + 2]) + w11 * ((a[k + 1] + a[k + 3]) + (b[k + 1] + b[k + 3])))
                + (w12 * ((a[k] + a[k + 4]) + (b[k] + b[k + 4])) + w20 * (e[k + 2] + f[k + 2]))
                + (
                    w21 * ((e[k + 1] + e[k + 3]) + (f[k + 1] + f[k + 3]))
                    + w22 * ((e[k] + e[k + 4]) + (f[k] + f[k + 4]))
                )
            )
        for i in range(first, end):
            row, wanted, base = result[i], nodes[i], (i - first) * width
            for j in range(ny):
                row[j] = sums[base + j] if wanted[j] else result.dtype.type(0.0)


@gate
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
    return math.sqrt(square_ratio(gap, pressure, diagonal, interference, hardness_pa))


@compiled(error_model="numpy")
def square_ratio(
    gap: np.ndarray, pressure: np.ndarray, diagonal: float, interference: np.ndarray, hardness: float
) -> float:
    """Square of relative_residual."""
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
