"""Forces that blocks of strips and belts exchange, and what that saves."""

from itertools import pairwise

import numpy as np
import pytest

from roughslip.contact import blocks, solve_load, sweep
from roughslip.contact.influence import Influence
from roughslip.grid import Grid

SHAPES = [((144, 12), False), ((144, 12), True), ((12, 144), False), ((12, 144), True)]


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
def test_blocks_displace_each_other_as_b_does(shape: tuple[int, int], periodic: bool) -> None:
    """W' B W for even forces of a wave along twelve blocks, as long as wide. K takes the displacement of the centre
    of a block, which is 1.19 times its mean under its own force (1.122 and 0.946 of p L / E*)."""
    influence = Influence(Grid(*shape, 1e-6, 1e-6), 1e11, periodic)
    along, edges = blocks.block_edges(influence.grid)
    assert along == (shape[0] == 144)
    np.testing.assert_array_equal(edges, 12 * np.arange(13))
    k = np.lib.stride_tricks.sliding_window_view(influence.between_blocks, 12)[:, ::-1]
    for force in (np.cos(2 * np.pi * np.arange(12) / 12), np.eye(12)[3] - 1 / 12, np.arange(12.0) - 5.5):
        pressure = np.repeat(force, 12)[:, None] * np.ones(12) / 144
        displacement = influence.apply(pressure if along else pressure.T.copy())
        means = (displacement if along else displacement.T).reshape(12, 144).mean(axis=1)
        assert 1 < (force @ k @ force) / (force @ means) < 1.25


@pytest.mark.parametrize("of_zero_sum", [False, True])
def test_exchange_is_the_solution_to_a_tenth(of_zero_sum: bool) -> None:
    """(K + D) z = g up to a constant where z has no sum, in the norm of the preconditioner. An empty block has none."""
    generator, local = np.random.default_rng(1), 0.3
    between = 1 / (1 + np.abs(np.arange(-11, 12.0)))
    numbers, means = generator.integers(1, 30, 12).astype(float), generator.standard_normal(12)
    numbers[4] = means[4] = 0
    y = blocks.exchanged(between, means, numbers, local, of_zero_sum)
    k = np.lib.stride_tricks.sliding_window_view(between, 12)[:, ::-1]
    held = numbers > 0

    def size(misfit: np.ndarray) -> float:
        centred = misfit - of_zero_sum * np.average(misfit[held], weights=numbers[held])
        return float(np.sqrt(np.sum(numbers * centred**2)))

    misfit = np.where(held, means - k @ (numbers * y) - local * y, 0.0)
    assert 1e-4 < size(misfit) / size(means) <= blocks.ROUGHLY
    assert y[4] == 0
    assert abs(numbers @ y) < 1e-12 * numbers @ np.abs(y) or not of_zero_sum


def test_means_of_blocks_are_taken_off_their_free_nodes() -> None:
    """Over columns of a view of several rows; a block without free nodes keeps its zeros."""
    generator, edges = np.random.default_rng(2), np.array([0, 4, 7, 9])
    free = generator.random((5, 9)) < 0.5
    free[:, 4:7] = False
    field = np.where(free, generator.standard_normal((5, 9)), 0.0)
    means, numbers = blocks.block_means(field, free, edges)
    parts = [(field[:, a:b], free[:, a:b]) for a, b in pairwise(edges)]
    np.testing.assert_array_equal(numbers, [np.count_nonzero(inside) for _, inside in parts])
    np.testing.assert_allclose(means, [part.sum() / max(inside.sum(), 1) for part, inside in parts], atol=1e-15)
    blocks.less_of_blocks(field, means, free, edges, field)
    np.testing.assert_allclose(blocks.block_means(field, free, edges)[0], 0.0, atol=1e-15)
    assert not field[~free].any()


def test_strips_take_fewer_products_with_blocks(monkeypatch, surface) -> None:
    """A strip of 120 widths at ten planes, from a tenth to nine tenths of the heights above: 65 in place of 81."""
    heights = surface((1200, 10), 14 / np.pi, 4)
    planes, grid = np.percentile(heights, np.linspace(90, 10, 10)), Grid(1200, 10, 1.0, 1.0)
    with_blocks = sweep(Influence(grid, 1.0), heights, planes, 1e-4)
    monkeypatch.setattr(Influence, "between_blocks", np.zeros(1))
    without = sweep(Influence(grid, 1.0), heights, planes, 1e-4)
    works = [sum(found.work for found in some if found.method == "fft") for some in (with_blocks, without)]
    assert works[0] <= 0.85 * works[1], works
    for one, other in zip(with_blocks, without, strict=True):
        np.testing.assert_allclose(one.pressure, other.pressure, atol=5e-3 * other.pressure.max())


def test_belts_take_as_many_products_as_squares(surface):
    """A belt of 24 widths, either way round. With the stencil alone it takes 51 products, here 23, a square 22."""
    heights, mean = surface((960, 40), 19 / np.pi, 3), 0.1
    belt = solve_load(Influence(Grid(960, 40, 1.0, 1.0), 1.0, periodic=True), heights, mean, 1e-6)
    turned = solve_load(Influence(Grid(40, 960, 1.0, 1.0), 1.0, periodic=True), heights.T.copy(), mean, 1e-6)
    assert max(belt.work, turned.work) <= 27
    np.testing.assert_allclose(belt.pressure, turned.pressure.T, atol=1e-4 * belt.pressure.max())
