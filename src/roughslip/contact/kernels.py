"""Compiled passes over the fields of a contact solve, each of which reads and writes every array once.

Sums are of PIECE nodes at a time, in the order of the compiler, and then of the pieces. So their rounding error grows
with the number of pieces only. All fields are (nx, ny) and contiguous. Pressures, gaps and sums are in double
precision; misfits and steps may be in single precision.
"""

from __future__ import annotations

import numpy as np

from roughslip.compilation.cache import compiled

PIECE = 1024
FLAT = 512  # numbers of a padded mesh that a stencil takes at a time; 256 and 2048 take longer
NEGLIGIBLE = 1e-12  # displacement of a node by its own pressure, over its gap
SUM_ROUNDING = 1e-14  # error of a shifted sum, a hundredth of that at which an iteration restores it

# A clipped step is taken whole where the energy is least beyond this share of it, so that nodes stay on their bounds.
# Shares of 0.7 to 0.9 take as many products, 0.5 takes a tenth more.
WHOLE = 0.8


@compiled(fastmath={"reassoc"})
def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of a b, whose products may be too small for single precision."""
    flat_a, flat_b, total = a.reshape(-1), b.reshape(-1), 0.0
    for first in range(0, a.size, PIECE):
        x, y, part = flat_a[first : first + PIECE], flat_b[first : first + PIECE], 0.0
        for k in range(x.size):
            part += np.float64(x[k]) * np.float64(y[k])
        total += part
    return total


@compiled(fastmath={"reassoc"})
def sums(pressure: np.ndarray, gap: np.ndarray, cap: float) -> tuple[float, int, float, float]:
    """Mean of the gap where 0 < p < cap, the number of such nodes, and the sums of p and p^2."""
    p, w = pressure.reshape(-1), gap.reshape(-1)
    between = total = square = nodes = 0.0
    for first in range(0, p.size, PIECE):
        x, y = p[first : first + PIECE], w[first : first + PIECE]
        of_gap = of_p = of_square = number = 0.0
        for k in range(x.size):
            inside = (x[k] > 0) & (x[k] < cap)
            of_gap += y[k] if inside else 0.0
            number += 1.0 if inside else 0.0
            of_p += x[k]
            of_square += x[k] * x[k]
        between, total, square, nodes = between + of_gap, total + of_p, square + of_square, nodes + number
    return between / max(nodes, 1.0), int(nodes), total, square


@compiled(fastmath={"reassoc"})
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
    square, highest = 0.0, diagonal * cap
    for first in range(0, pressure.size, PIECE):
        end, part = first + PIECE, 0.0
        p, w, r, moves = flat_p[first:end], flat_w[first:end], flat_r[first:end], flat_free[first:end]
        for k in range(p.size):
            above = w[k] + offset
            own = diagonal * p[k]  # displacement by the node's own pressure
            target = min(max(own - above, 0.0), highest)
            part += (own - target) * (own - target)
            may_move = ((p[k] > 0) | (above < 0)) & ((p[k] < cap) | (above > 0))
            moves[k] = may_move
            r[k] = -above if may_move else 0.0
        square += part
    return square


@compiled(fastmath={"reassoc"})
def conjugation(
    descent: np.ndarray, step: np.ndarray, product: np.ndarray, curvature: float, free: np.ndarray, of_zero_sum: bool
) -> tuple[float, float]:
    """beta and mean of the next direction d = s + beta t - mean on the free nodes, conjugate to the last step t.

    descent : (nx, ny) s, zero off the free nodes
    of_zero_sum : whether d, and s before it is conjugated, lose their means over the free nodes

    beta = -inner(s, product) / curvature, from the product of the step and its curvature, not negative; zero where
    there is no earlier step.
    """
    if not of_zero_sum:
        return max(0.0, -inner(descent, product) / curvature) if curvature > 0 else 0.0, 0.0
    s, t, b, moves = descent.reshape(-1), step.reshape(-1), product.reshape(-1), free.reshape(-1)
    s_sum = t_sum = number = overlap = lifted = 0.0
    for first in range(0, s.size, PIECE):
        end = first + PIECE
        x, y, z, inside = s[first:end], t[first:end], b[first:end], moves[first:end]
        of_s = of_t = count = of_overlap = of_lifted = 0.0
        for k in range(x.size):
            of_s += x[k]
            of_t += y[k] if inside[k] else 0.0
            count += 1.0 if inside[k] else 0.0
            of_overlap += np.float64(x[k]) * np.float64(z[k])
            of_lifted += np.float64(z[k]) if inside[k] else 0.0
        s_sum, t_sum, number = s_sum + of_s, t_sum + of_t, number + count
        overlap, lifted = overlap + of_overlap, lifted + of_lifted
    share = 1 / max(number, 1.0)
    mean = share * s_sum
    beta = max(0.0, -(overlap - mean * lifted) / curvature) if curvature > 0 else 0.0
    return beta, mean + share * beta * t_sum


@compiled()
def trials(
    pressure: np.ndarray,
    length: float,
    descent: np.ndarray,
    step: np.ndarray,
    beta: float,
    mean: float,
    free: np.ndarray,
    trial: np.ndarray,
) -> None:
    """trial <- p + length d on the free nodes, with d of `conjugation`; p elsewhere, infinite where that is a cap."""
    s, t, moves, result = descent.reshape(-1), step.reshape(-1), free.reshape(-1), trial.reshape(-1)
    p = pressure.reshape(-1)
    for k in range(p.size):
        moved = p[k] + length * (s[k] + beta * t[k] - mean)
        held = p[k] if p[k] == 0 else np.inf
        result[k] = moved if moves[k] else held


@compiled(fastmath={"reassoc"})
def clipped_step(
    pressure: np.ndarray,
    length: float,
    descent: np.ndarray,
    beta: float,
    mean: float,
    free: np.ndarray,
    shift: float,
    cap: float,
    misfit: np.ndarray,
    step: np.ndarray,
) -> tuple[float, int]:
    """step <- the way from p to its trial of `trials`, plus the shift where that is positive, clipped to [0, cap].

    Returns inner(misfit, step) and the number of nodes that were clipped.
    """
    p, s, moves = pressure.reshape(-1), descent.reshape(-1), free.reshape(-1)
    r, t = misfit.reshape(-1), step.reshape(-1)
    slope = clipped = 0.0
    for k in range(p.size):
        tried = p[k] + length * (s[k] + beta * t[k] - mean)
        moved = tried + shift if tried > 0 else tried
        allowed = min(max(moved, 0.0), cap)
        change = allowed - p[k] if moves[k] else 0.0
        t[k] = change
        slope += r[k] * change
        clipped += 1.0 if (allowed != moved) & moves[k] else 0.0
    return slope, int(clipped)


@compiled()
def on_bounds(
    pressure: np.ndarray, gap: np.ndarray, offset: float, diagonal: float, cap: float, result: np.ndarray
) -> None:
    """result <- clip(p - w / B_00, 0, cap) where this or p is a bound, else p: nodes change between contact and gap."""
    p, w, bounded = pressure.reshape(-1), gap.reshape(-1), result.reshape(-1)
    for k in range(p.size):
        target = min(max(p[k] - (w[k] + offset) / diagonal, 0.0), cap)
        is_between = (p[k] > 0) & (p[k] < cap) & (target > 0) & (target < cap)
        bounded[k] = p[k] if is_between else target


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


@compiled(fastmath={"reassoc"})
def shift_to_sum(trial: np.ndarray, cap: float, pressure_sum: float, everywhere: bool) -> tuple[float, bool]:
    """The shift for which clip(trial + shift, 0, cap) has the sum `pressure_sum`, and whether there is one.

    everywhere : whether all nodes are shifted, or only those of positive trials

    Method: the sum is piecewise linear in the shift and never falls, so Newton's method is used, within a bracket.
    """
    tried = trial.reshape(-1)
    shift, low, high, top, bottom = 0.0, -np.inf, np.inf, -np.inf, np.inf
    for _ in range(200):
        total = between = 0.0
        for first in range(0, tried.size, PIECE):
            x, part, count = tried[first : first + PIECE], 0.0, 0.0
            for k in range(x.size):
                value = x[k] + shift if everywhere | (x[k] > 0) else x[k]
                part += min(max(value, 0.0), cap)
                count += 1.0 if (value > 0) & (value < cap) else 0.0
            total, between = total + part, between + count
        missing = pressure_sum - total
        if abs(missing) <= SUM_ROUNDING * pressure_sum:
            return shift, True
        if missing > 0:
            low = shift
        else:
            high = shift
        step = missing / between if between > 0 else np.inf
        if low < shift + step < high:
            shift += step
            continue
        if top < bottom:  # found once, where Newton's method needs them
            for value in tried:
                if value < np.inf and (everywhere or value > 0):
                    top, bottom = max(top, value), min(bottom, value)
        if np.isfinite(low) and np.isfinite(high):
            shift = (low + high) / 2
        elif missing < 0:
            shift = -top  # all at zero
        else:  # all at the cap, or without one the highest with the whole sum
            shift = cap - bottom if np.isfinite(cap) else pressure_sum - top
        if not (low < shift < high):
            break
    return shift, abs(missing) <= 1e-12 * pressure_sum


@compiled()
def take_step(
    pressure: np.ndarray,
    gap: np.ndarray,
    offset: float,
    diagonal: float,
    cap: float,
    slope: float,
    clipped: bool,
    step: np.ndarray,
    product: np.ndarray,
) -> tuple[float, float]:
    """Search the line along a step and move by it. Returns the curvature t' B t and theta; theta 0 where it stays.

    A clipped step is taken whole where the energy is least beyond WHOLE of it, another as far as the bounds allow.
    """
    curvature = inner(step, product)
    if not (slope > 0 and curvature > 0):
        return curvature, 0.0
    theta = factor = slope / curvature
    if clipped and theta > WHOLE:
        factor = 1.0
    elif theta > 1:
        factor = min(theta, room(pressure, step, cap))
    move(pressure, gap, offset, diagonal, cap, factor, step, product)
    return curvature, theta


@compiled(fastmath={"reassoc"})
def positive_square(interference: np.ndarray, plane: float) -> float:
    """||max(u_bar - plane, 0)||^2."""
    heights, total = interference.reshape(-1), 0.0
    for first in range(0, heights.size, PIECE):
        x, part = heights[first : first + PIECE], 0.0
        for k in range(x.size):
            height = max(x[k] - plane, 0.0)
            part += height * height
        total += part
    return total


@compiled(fastmath={"contract"})
def stencil_product(
    stencil: np.ndarray, field: np.ndarray, nodes: np.ndarray, padded: np.ndarray, result: np.ndarray
) -> None:
    """Write a stencil of 5 x 5 nodes, even on both axes, applied to a field at the given nodes; zero elsewhere.

    The field is zero outside the mesh, and may be the result. It is copied into the first part of `padded` :
    (2, nx + 4, ny + 4), whose border is zero, so that sums run over rows of a narrow mesh, into the second part.
    """
    nx, ny = field.shape
    width, zero = ny + 4, field.dtype.type(0.0)
    for i in range(nx):
        for j in range(ny):
            padded[0, i + 2, j + 2] = field[i, j]
    flat, total = padded[0].reshape(-1), padded[1].reshape(-1)
    w00, w01, w02 = stencil[2, 2], stencil[2, 3], stencil[2, 4]
    w10, w11, w12 = stencil[3, 2], stencil[3, 3], stencil[3, 4]
    w20, w21, w22 = stencil[4, 2], stencil[4, 3], stencil[4, 4]
    sums = np.empty(3 * FLAT, stencil.dtype)
    for first in range(0, nx * width - 4, FLAT - 4):
        length = min(FLAT, nx * width - first)
        e, a = flat[first : first + length], flat[first + width : first + width + length]
        c, b = flat[first + 2 * width :][:length], flat[first + 3 * width :][:length]
        f, out = flat[first + 4 * width :][:length], total[first : first + length - 4]
        for k in range(length):
            near, far = a[k] + b[k], e[k] + f[k]
            sums[k] = w00 * c[k] + w10 * near + w20 * far
            sums[FLAT + k] = w01 * c[k] + w11 * near + w21 * far
            sums[2 * FLAT + k] = w02 * c[k] + w12 * near + w22 * far
        for k in range(length - 4):
            farther = sums[2 * FLAT + k] + sums[2 * FLAT + k + 4]
            out[k] = sums[k + 2] + (sums[FLAT + k + 1] + sums[FLAT + k + 3] + farther)
    for i in range(nx):
        row, wanted, values = result[i], nodes[i], total[i * width : i * width + ny]
        for j in range(ny):
            row[j] = values[j] if wanted[j] else zero


@compiled(error_model="numpy")
def square_ratio(
    gap: np.ndarray, pressure: np.ndarray, diagonal: float, interference: np.ndarray, hardness: float
) -> float:
    """Square of the relative residual: how far pressures and gaps are from the conditions of contact.

    gap : (nx, ny) [m] w = B p - u_bar, to which plastic displacement has not been added
    pressure : (nx, ny) [Pa]
    diagonal : B_00 [m/Pa]
    interference : (nx, ny) [m] u_bar
    hardness : H [Pa], the highest pressure

    The residual is ||B_00 p - clip(B_00 p - w, 0, B_00 H)|| / max(||max(u_bar, 0)||, B_00 ||p||) [-]. Without H the
    numerator is ||min(w, B_00 p)||. The second scale is larger in a periodic cell only, whose mean pressure has no
    displacement. On a free half-space u_bar = B p + u_plastic >= B_00 p in contact.
    """
    nx, ny = pressure.shape
    largest = 0.0  # scaled by it, squares neither overflow nor vanish
    for i in range(nx):
        for j in range(ny):
            largest = max(largest, interference[i, j], diagonal * pressure[i, j])
    unmet, heights, displacements = np.zeros(ny), np.zeros(ny), np.zeros(ny)
    inverse = 1 / largest
    for i in range(nx):
        for j in range(ny):
            own = diagonal * pressure[i, j]
            step = (own - min(max(own - gap[i, j], 0.0), diagonal * hardness)) * inverse
            height = max(interference[i, j], 0.0) * inverse
            unmet[j] += step * step
            heights[j] += height * height
            displacements[j] += (own * inverse) * (own * inverse)
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
