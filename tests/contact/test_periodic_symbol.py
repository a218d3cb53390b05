import math
from itertools import pairwise

import numpy as np
import pytest

from roughslip.contact.influence import love_coefficients
from roughslip.contact.periodic import periodic_symbol
from roughslip.errors import ParameterError
from roughslip.grid import Grid

GRIDS = [Grid(16, 5, 1.0, 0.3), Grid(7, 8, 0.2, 1.0), Grid(9, 1, 1.0, 1.0), Grid(1, 6, 1.0, 1.0), Grid(4, 6, 1.0, 30.0)]


def repeated_means(values: list[float]) -> float:
    """Limit of a sequence that alternates about it (Euler)."""
    while len(values) > 1:
        values = [(a + b) / 2 for a, b in pairwise(values)]
    return values[0]


def alias_sum(grid: Grid, i: int, j: int) -> float:
    """2 sum_G sinc sinc / |q + G| over squares of G, whose size changes the sign of what is left out."""
    partial = []
    for size in range(80, 88):
        m = np.arange(-size, size + 1)
        fx, fy = 2 * np.pi * (i / grid.nx + m)[:, None], 2 * np.pi * (j / grid.ny + m)
        wave = np.sinc(fx / (2 * np.pi)) * np.sinc(fy / (2 * np.pi)) / np.hypot(fx / grid.dx, fy / grid.dy)
        partial.append(2 * float(wave.sum()))
    return repeated_means(partial)


def kernel(grid: Grid) -> np.ndarray:
    """Displacement of every node under a unit pressure on node (0, 0)."""
    return np.fft.irfft2(periodic_symbol(grid, 1.0), grid.shape)


@pytest.mark.parametrize("grid", GRIDS)
def test_is_the_sum_over_aliases(grid: Grid) -> None:
    """2e-11: what 80 aliases and seven means leave. Measured 6e-12; with 200 aliases 7e-14."""
    symbol = periodic_symbol(grid, 1.0)
    assert symbol.shape == (grid.nx, grid.ny // 2 + 1)
    assert symbol[0, 0] == 0
    for i, j in np.ndindex(symbol.shape):
        if i or j:
            assert symbol[i, j] == pytest.approx(alias_sum(grid, i, j), rel=2e-11)


def test_is_the_sum_of_love_over_images() -> None:
    """Differences between nodes, of Love's coefficients summed over 21 x 21 and 63 x 63 images of the cell. What lies
    beyond a square of half-edge S differs from node to node by the second derivatives of 1/r, summed: c/S + O(S^-3).
    The first term is eliminated (S grows by 3), the second leaves a few 1e-6: measured 2.5e-6, and 3.3e-7 at twice
    the reach."""
    grid = Grid(4, 6, 1.0, 0.5)

    def images(reach: int) -> np.ndarray:
        love = love_coefficients(Grid(grid.nx * (reach + 1), grid.ny * (reach + 1), grid.dx, grid.dy), 1.0)
        image = np.arange(-reach, reach + 1)
        i = np.abs(np.arange(grid.nx)[:, None] - grid.nx * image)
        j = np.abs(np.arange(grid.ny)[:, None] - grid.ny * image)
        total = love[i[:, None, :, None], j[None, :, None, :]].sum(axis=(2, 3))
        return total - total.mean()

    extrapolated = (3 * images(31) - images(10)) / 2
    np.testing.assert_allclose(kernel(grid), extrapolated, rtol=0, atol=5e-6 * kernel(grid).max())


def test_large_cells_tend_to_the_free_half_space() -> None:
    """Differences of the influence near the load, cells of 32 and 64 nodes. What the images add curves with the third
    power of their distance, so that the misfit falls by 8."""
    love = love_coefficients(Grid(4, 4, 1.0, 1.0), 1.0)
    misfit = []
    for n in (32, 64):
        near = kernel(Grid(n, n, 1.0, 1.0))[:4, :4]
        misfit.append(np.abs((near - near[0, 0]) - (love - love[0, 0])).max())
    assert misfit[0] < 1e-3
    assert math.log2(misfit[0] / misfit[1]) == pytest.approx(3, abs=0.05)


def test_long_waves() -> None:
    """Lambda = 2 / (E* q) (1 - (q dx)^2 / 24 + O((q dx)^3)): the sinc of the wave; aliases come third."""
    n, modulus = 512, 3.0
    q = 2 * np.pi * np.arange(1, 5) / n
    symbol = periodic_symbol(Grid(n, 2, 1.0, 1.0), modulus)[1:5, 0]
    np.testing.assert_allclose(symbol * modulus * q / 2, 1 - q**2 / 24, rtol=0, atol=0.2 * q[-1] ** 3)


@pytest.mark.parametrize("aspect", [1e-6, 1e-2, 1.0, 30.0, 1e3])
@pytest.mark.parametrize("shape", [(1, 1), (2, 2), (1, 9), (16, 16), (31, 10)])
def test_is_positive_on_all_but_the_mean(shape: tuple[int, int], aspect: float) -> None:
    symbol = periodic_symbol(Grid(*shape, 1.0, aspect), 1.0)
    assert symbol[0, 0] == 0
    assert np.count_nonzero(symbol > 0) == symbol.size - 1


@pytest.mark.parametrize("aspect", [0.03, 1.0, 10.0])
def test_inverse_has_negative_off_diagonal_entries(aspect: float) -> None:
    """Found, not proven. The mean, which has no inverse, is left out; it would add the same to every entry."""
    symbol = periodic_symbol(Grid(16, 24, 1.0, aspect), 1.0)
    inverse = np.divide(1.0, symbol, out=np.zeros_like(symbol), where=symbol > 0)
    entries = np.fft.irfft2(inverse, (16, 24)).ravel()
    assert entries[0] > 0
    assert np.all(entries[1:] < 0)


def test_symmetries() -> None:
    grid = Grid(8, 8, 0.4, 1.0)
    full = np.fft.fft2(kernel(grid)).real
    turned = np.fft.fft2(kernel(Grid(8, 8, 1.0, 0.4))).real
    np.testing.assert_allclose(turned, full.T, rtol=1e-13, atol=1e-15 * full.max())
    np.testing.assert_allclose(full[1:], full[:0:-1], rtol=1e-13)


@pytest.mark.parametrize("metre", [1e-9, 1e9])
@pytest.mark.parametrize("pascal", [1e-12, 1e12])
def test_scales(metre: float, pascal: float) -> None:
    symbol = periodic_symbol(Grid(12, 10, 1.0, 0.7), 1.0)
    scaled = periodic_symbol(Grid(12, 10, metre, 0.7 * metre), pascal)
    np.testing.assert_allclose(scaled * pascal / metre, symbol, rtol=1e-14)


def test_a_wave_along_one_axis_does_not_see_the_other() -> None:
    strip = periodic_symbol(Grid(32, 1, 0.5, 7.0), 1.0)[:, 0]
    for ny, dy in [(5, 0.1), (8, 20.0)]:
        np.testing.assert_allclose(periodic_symbol(Grid(32, ny, 0.5, dy), 1.0)[:, 0], strip, rtol=1e-14)


@pytest.mark.parametrize("modulus", [0.0, -1.0, math.inf, math.nan])
def test_refuses_modulus(modulus: float) -> None:
    with pytest.raises(ParameterError, match="modulus"):
        periodic_symbol(Grid(2, 2, 1.0, 1.0), modulus)
