"""The influence matrix against quadrature, its products, the far field of a strip, the material.

Each compiled pass against its formula in NumPy, on a mesh of several lanes of which the last is not full."""

import math

import numpy as np
import pytest

from roughslip.contact import kernels
from roughslip.contact.convolution import Convolution, NarrowConvolution
from roughslip.contact.influence import (
    PATCH_RADIUS,
    ROUGH,
    ROUNDED,
    Influence,
    Material,
    at_displaced_planes,
    column_influence,
    displacement,
    love_coefficients,
)
from roughslip.grid import Grid


def gauss_legendre(x: float, y: float, dx: float, dy: float) -> float:
    """1/pi times the integral of 1/r over a cell at the origin, seen from far away: a sum of positive terms."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    r = np.hypot(x - nodes[:, None] * dx / 2, y - nodes * dy / 2)
    return float((weights[:, None] * weights / r).sum() * dx * dy / (4 * math.pi))


@pytest.mark.parametrize(("dx", "dy"), [(1.0, 1.0), (1.0, 20.0)])
def test_far_coefficients_keep_all_digits(dx: float, dy: float) -> None:
    """At 2000 cells the difference of four corners would lose r^2/(dx dy), that is 9 digits."""
    coefficients = love_coefficients(Grid(2000, 20, dx, dy), 1.0)
    for i, j in [(100, 3), (1999, 0), (1999, 19), (1500, 7)]:
        assert coefficients[i, j] == pytest.approx(gauss_legendre(i * dx, j * dy, dx, dy), rel=4e-15)


@pytest.mark.parametrize(
    ("grid", "coarser"),
    [
        (Grid(8, 7, 1.0, 1.0), Grid(4, 4, 2.0, 2.0)),
        (Grid(8, 8, 1.0, 3.0), Grid(4, 8, 2.0, 3.0)),
        (Grid(1, 8, 1.0, 1.0), Grid(1, 4, 1.0, 2.0)),
    ],
)
def test_coarser_cells_are_of_twice_the_edge_and_no_longer_than_broad(grid: Grid, coarser: Grid) -> None:
    """An axis with one node, or with cells twice as long as those of the other, keeps its cells."""
    assert Influence(grid, 1.0).coarser.grid == coarser


@pytest.mark.parametrize("aspect", [0.01, 0.2, 1.0, 30.0])
def test_approximate_inverse(aspect: float) -> None:
    """The pressures lift one cell of the patch alone, and as a stencil are diagonally dominant."""
    influence = Influence(Grid(2, 2, 1.0, aspect), 2.0)
    stencil = influence.approximate_inverse
    width = 2 * PATCH_RADIUS + 1
    patch = Influence(Grid(width, width, 1.0, aspect), 2.0)
    lift = np.zeros((width, width))
    lift[PATCH_RADIUS, PATCH_RADIUS] = 1.0
    np.testing.assert_allclose(patch.apply(stencil), lift, atol=1e-13)
    others = stencil[lift == 0]
    assert np.all(others < 0)
    assert stencil[PATCH_RADIUS, PATCH_RADIUS] > -others.sum()


def test_plane_strain_modulus() -> None:
    assert Material(210e9, 0.3).plane_strain_modulus_pa == pytest.approx(210e9 / 0.91, rel=1e-15)
    assert Material(1.0, 0.5).plane_strain_modulus_pa == pytest.approx(4 / 3, rel=1e-15)


@pytest.mark.parametrize("way", [Convolution, NarrowConvolution])
@pytest.mark.parametrize("precision", [np.float64, np.float32])
@pytest.mark.parametrize("most_columns", [600, 5])
@pytest.mark.parametrize(
    ("shape", "torus"),
    [((5, 7), (5, 7)), ((4, 6), (8, 12)), ((6, 1), (12, 1)), ((150, 5), (299, 9)), ((30, 40), (60, 81))],
)
def test_product_with_an_even_circulant(
    way: type,
    precision: type,
    most_columns: int,
    shape: tuple[int, int],
    torus: tuple[int, int],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also in parts of the spectrum. Against numpy's transform of the whole torus, to some log2(n) roundings."""
    monkeypatch.setattr("roughslip.contact.convolution.MOST_COLUMNS", most_columns)
    monkeypatch.setattr("roughslip.contact.convolution.PART", 4)
    rng = np.random.default_rng(1)
    kernel = rng.random(torus)
    kernel += np.roll(kernel[::-1], 1, axis=0)
    kernel += np.roll(kernel[:, ::-1], 1, axis=1)
    symbol = np.fft.rfft2(kernel).real
    field, padded = rng.standard_normal(shape), np.zeros(torus)
    padded[: shape[0], : shape[1]] = field
    expected = np.fft.irfft2(symbol * np.fft.rfft2(padded), torus)[: shape[0], : shape[1]]
    result = np.full(shape, np.nan)
    product = way(symbol, shape, torus, precision)
    for _ in range(2):  # scratch left from one product does not enter the next
        product(field, result)
        np.testing.assert_allclose(result, expected, rtol=0, atol=50 * np.finfo(precision).eps * np.abs(symbol).max())


@pytest.mark.parametrize("shape", [(1200, 10), (640, 7)])
def test_a_rough_product_errs_by_less_than_it_may(shape) -> None:
    """Of even forces, of forces at one end, and of single ones: those at the other end are the farthest apart."""
    influence, generator = Influence(Grid(*shape, 2e-6, 2e-6), 2.0), np.random.default_rng(2)
    for pressure in (np.ones(shape), np.outer(np.arange(shape[0]) < shape[0] / 5, np.ones(shape[1])),
                     np.where(generator.random(shape) < 0.2, generator.random(shape), 0.0)):  # fmt: skip
        exact, rough = influence.apply(pressure), influence.apply(pressure, error=ROUGH)
        assert 1e-5 < np.abs(rough - exact).max() / np.abs(exact).max() < ROUGH
        np.testing.assert_allclose(influence.apply(pressure, error=ROUNDED), exact, atol=ROUNDED * exact.max())


STRIP = Grid(24, 5, 2e-6, 3e-6)
OF_STRIP = Influence(STRIP, 2.3e11)


@pytest.mark.parametrize(("spacing", "reach"), [(1, 1), (3, 1), (3, 4)])
def test_a_column_moves_the_mean_of_the_others_as_the_full_influence_does(spacing, reach):
    """An identity: means over pairs of rows. The first columns of the kernel count for nothing."""
    force = 7.0
    pressure = np.zeros(STRIP.shape)
    pressure[0] = force / (STRIP.ny * STRIP.cell_area)
    expected = OF_STRIP.apply(pressure).mean(axis=1)[::spacing] / force
    kernel = column_influence(OF_STRIP, spacing, reach)
    assert kernel.shape == expected.shape
    assert np.all(kernel[:reach] == 0.0)
    np.testing.assert_allclose(kernel[reach:], expected[reach:], rtol=1e-12)


def test_displacements_are_sums_over_the_columns_and_nothing_wraps_around():
    rng = np.random.default_rng(1)
    kernel, force = rng.uniform(1, 2, 12), rng.standard_normal((2, 3, 9))
    distance = np.abs(np.subtract.outer(np.arange(9), np.arange(9)))
    np.testing.assert_allclose(displacement(kernel, force), force @ kernel[distance], rtol=0, atol=1e-13)


def test_quantities_linear_in_the_height_of_the_plane_are_found_at_any():
    """Within the planes and below the lowest; above the highest they are kept, and never fall below zero."""
    planes = np.array([3.0, 1.0, 0.5])
    column = np.arange(4.0)
    values = np.stack([10.0 - 2.0 * planes[:, None] + column, 4.0 - planes[:, None] + 0.0 * column])
    moved = np.array([[-2.9, -0.4, 0.0, 0.3], [1.9, 0.5, -0.6, -0.9], [1.0, 0.1, -0.2, 0.0]])
    height = np.minimum(planes[:, None] + moved, 3.0)
    expected = np.stack([10.0 - 2.0 * height + column, 4.0 - height])
    np.testing.assert_allclose(at_displaced_planes(values, planes, moved), expected, rtol=1e-14)
    np.testing.assert_array_equal(at_displaced_planes(values[:, :1], planes[:1], moved[:1]), values[:, :1])  # one plane
    falling = np.array([[5.0], [1.0]])  # a quantity that grew upwards would turn negative below
    assert at_displaced_planes(falling, np.array([1.0, 0.0]), np.array([[0.0], [-2.0]]))[1, 0] == 0.0


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


@pytest.mark.parametrize("sign", [1.0, -1.0])  # of beta before it is cut at zero
def test_a_direction_is_conjugate_to_the_last_step_and_keeps_the_sum(fields, sign):
    """s + beta t with beta = -s' B t / t' B t; under a load s and the direction have no mean over the free nodes."""
    *_, step, product, descent, free = fields
    t, b, s = step.astype(float), sign * product.astype(float), np.where(free, descent, 0.0).astype(float)
    for keeps, mean in ((False, 0.0), (True, s[free].mean())):
        beta = max(0.0, -np.sum((s - mean * free) * b) / 3.0)
        expected = beta, (s + beta * t)[free].mean() if keeps else 0.0
        assert kernels.conjugation(s, t, b, 3.0, free, keeps) == pytest.approx(expected, rel=1e-10)
        assert kernels.conjugation(s, t, b, 0.0, free, keeps) == pytest.approx((0.0, mean), rel=1e-10)


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
    kernels.stencil_product(stencil, field, nodes, np.zeros((2, nx + 4, ny + 4)), result)
    np.testing.assert_allclose(result, np.where(nodes, expected, 0.0), rtol=0, atol=1e-14)
