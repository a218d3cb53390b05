"""Each compiled pass against its formula in NumPy, on a mesh of several lanes of which the last is not full."""

import math

import numpy as np
import pytest

from roughslip.contact import kernels

SHAPE = (23, 17)
DIAGONAL, OFFSET = 0.25, 0.125


@pytest.fixture(scope="module", params=[(math.inf, np.float32), (0.7, np.float32), (0.7, np.float64)])
def fields(request):
    """Cap, then pressures at, between and off the bounds, gaps of both signs, and steps; some nodes meet exactly."""
    cap, precision = request.param
    rng = np.random.default_rng(5)
    pressure = np.clip(rng.uniform(-0.5, 1.0, SHAPE), 0.0, cap)
    gap = np.round(8 * rng.standard_normal(SHAPE)) / 8  # so that gap + offset is often zero, and B_00 p - w too
    step, product, descent = (rng.standard_normal(SHAPE).astype(precision) for _ in range(3))
    return cap, pressure, gap, step, product, descent, rng.random(SHAPE) < 0.6


def test_sums_and_means(fields):
    cap, pressure, gap, step, product, _, _ = fields
    rounding = 1e-13 * pressure.size
    assert kernels.inner(pressure, gap) == pytest.approx(np.sum(pressure * gap), abs=rounding)
    assert kernels.inner(step, product) == pytest.approx(np.sum(step.astype(float) * product), abs=rounding)
    assert kernels.positive_square(gap, 0.3) == pytest.approx(np.sum(np.maximum(gap - 0.3, 0.0) ** 2), abs=rounding)
    inside = (pressure > 0) & (pressure < cap)
    mean, count = kernels.mean_between(gap, pressure, cap)
    assert (mean, count) == (pytest.approx(gap[inside].mean(), abs=rounding), np.count_nonzero(inside))
    assert kernels.mean_between(gap, np.zeros(SHAPE), cap) == (0.0, 0)


def test_misfits_and_free_nodes(fields):
    """The residual of a node is B_00 p - clip(B_00 p - w, 0, B_00 H); a free node may take a step along -w."""
    cap, pressure, gap, step, *_ = fields
    misfit, free = np.full(SHAPE, np.nan, step.dtype), np.empty(SHAPE, dtype=np.bool_)
    square = kernels.assess(pressure, gap, OFFSET, DIAGONAL, cap, misfit, free)
    w = gap + OFFSET
    unmet = DIAGONAL * pressure - np.clip(DIAGONAL * pressure - w, 0.0, DIAGONAL * cap)
    assert square == pytest.approx(np.sum(unmet**2), rel=1e-13)
    moved = np.clip(pressure - 1e-9 * np.sign(w), 0.0, cap)  # a short step; where w is zero a node between may move
    expected = np.where(w != 0, moved != pressure, (pressure > 0) & (pressure < cap))
    np.testing.assert_array_equal(free, expected)
    np.testing.assert_array_equal(misfit, np.where(expected, -w, 0.0).astype(step.dtype))
    heights = np.maximum(gap, 0.0) - 0.5  # any interference: it scales alone
    for scale in (1.0, 1e-200, 1e200):  # whose squares vanish or overflow
        ratio = kernels.square_ratio(scale * gap, pressure, scale * DIAGONAL, scale * heights, cap)
        unmet = DIAGONAL * pressure - np.clip(DIAGONAL * pressure - gap, 0.0, DIAGONAL * cap)
        largest = max(np.sum(np.maximum(heights, 0.0) ** 2), np.sum((DIAGONAL * pressure) ** 2))
        assert ratio == pytest.approx(np.sum(unmet**2) / largest, rel=1e-12)
    low = np.full(SHAPE, -1.0)  # no height above the plane: the second scale
    ratio = kernels.square_ratio(gap, pressure, DIAGONAL, low, cap)
    assert ratio == pytest.approx(np.sum(unmet**2) / np.sum((DIAGONAL * pressure) ** 2), rel=1e-12)


def test_directions(fields):
    """Conjugate to the last step on the free nodes, never against it; balanced to a sum of zero."""
    _, _, _, step, product, descent, free = fields
    direction = np.full(SHAPE, np.nan, step.dtype)
    overlap, tight = float(np.sum(descent.astype(float) * product)), 10 * np.finfo(step.dtype).eps
    for curvature, toward in ((2.0, product), (2.0, -product), (0.0, product)):
        beta = max(0.0, -kernels.inner(descent, toward) / curvature) if curvature else 0.0
        kernels.conjugate(descent, step, toward, curvature, free, direction)
        np.testing.assert_allclose(direction, np.where(free, descent + beta * step, 0.0), atol=tight * (1 + beta))
    assert overlap != 0.0
    if step.dtype == np.float64:
        uniform = np.where(free, np.abs(product), 0.0)
        before = direction.copy()
        kernels.balance(direction, uniform)
        np.testing.assert_allclose(direction, before - before.sum() / uniform.sum() * uniform, atol=1e-13)


def test_steps_are_clipped_and_moves_stay_within_the_bounds(fields):
    cap, pressure, gap, step, product, descent, free = fields
    written = np.empty(SHAPE, step.dtype)
    for shift in (0.0, 0.2):
        slope, clipped = kernels.clipped_step(pressure, 0.4, step, cap, shift, free, descent, written)
        trial = pressure + 0.4 * step.astype(float)
        trial = np.where(free & (trial > 0), trial + shift, trial)
        allowed = np.clip(trial, 0.0, cap)
        np.testing.assert_allclose(written, allowed - pressure, atol=4 * np.finfo(step.dtype).eps)
        assert slope == pytest.approx(np.sum(descent * (allowed - pressure)), rel=1e-6)
        assert clipped == np.count_nonzero(allowed != trial) > 0
    size = kernels.room(pressure, 0.5 * written, cap)  # the step of shift 0.2 ends on a bound, so twice its half fits
    assert size == pytest.approx(2.0, rel=1e-6)
    toward = (pressure - (gap + OFFSET) / DIAGONAL).copy()
    expected = np.where(toward <= 0, 0.0, np.where(toward >= cap, cap, pressure))
    np.testing.assert_array_equal(kernels.on_bounds(pressure, gap, OFFSET, DIAGONAL, cap), expected)
    p, w = pressure.copy(), gap.copy()
    kernels.move(p, w, OFFSET, DIAGONAL, cap, 0.5, written, product)
    np.testing.assert_allclose(p, np.clip(pressure + 0.5 * written, 0.0, cap), atol=1e-15)
    np.testing.assert_allclose(w, gap + 0.5 * product.astype(float), rtol=1e-15)


def test_a_move_puts_what_is_nearly_on_a_bound_on_it():
    """Within 2 eps of the cap, of zero by as much of the pressure, and pressures of 1e-12 of the gap."""
    eps = np.finfo(np.float32).eps
    pressure = np.array([[1.0, 1.0, 1.0, 1.0, 0.0, 0.0]])
    ends = np.array([[2.0 - 2 * eps, 2.0 - 6 * eps, 1.9 * eps, 4 * eps, 3e-12, 5e-12]])
    gap = np.array([[0.0, 0.0, 0.0, 0.0, 0.75, 0.75]])  # over a diagonal of 1/4 the limit is 4e-12
    step, product = (ends - pressure).astype(np.float32), np.zeros((1, 6), np.float32)
    kernels.move(pressure, gap, 0.25, 0.25, 2.0, 1.0, step, product)
    np.testing.assert_array_equal(pressure == [[2.0, 2.0, 0.0, 0.0, 0.0, 0.0]], [[True, False] * 3])


@pytest.mark.parametrize("shape", [SHAPE, (9, 1), (2, 150), (40, 3)])
def test_a_stencil_is_the_sum_over_its_neighbours(shape):
    """Even on both axes, zero outside the mesh, and at the nodes alone, of which whole rows may be none."""
    rng = np.random.default_rng(6)
    quarter = rng.standard_normal((3, 3))
    stencil = quarter[np.ix_([2, 1, 0, 1, 2], [2, 1, 0, 1, 2])]
    field, nodes = rng.standard_normal(shape), rng.random(shape) < 0.5
    nodes[shape[0] // 2 :] = False
    nodes[-1, 0] = True
    nx, ny = shape
    wide = np.pad(field, 2)
    expected = sum(stencil[a, b] * wide[a : a + nx, b : b + ny] for a in range(5) for b in range(5))
    result = np.full(shape, np.nan)
    kernels.stencil_product(stencil, field, nodes, np.zeros((nx + 4, ny + 4)), result)
    np.testing.assert_allclose(result, np.where(nodes, expected, 0.0), rtol=0, atol=1e-14)
