"""The far field along a strip against the full influence, and quantities at planes that it moves."""

import numpy as np
import pytest

from roughslip.contact.far_field import at_displaced_planes, column_influence, displacement
from roughslip.contact.influence import Influence
from roughslip.errors import ParameterError
from roughslip.grid import Grid

GRID = Grid(24, 5, 2e-6, 3e-6)
INFLUENCE = Influence(GRID, 2.3e11)


@pytest.mark.parametrize(("spacing", "reach"), [(1, 1), (3, 1), (3, 4)])
def test_a_column_moves_the_mean_of_the_others_as_the_full_influence_does(spacing, reach):
    """An identity: means over pairs of rows. The first columns of the kernel count for nothing."""
    force = 7.0
    pressure = np.zeros(GRID.shape)
    pressure[0] = force / (GRID.ny * GRID.cell_area)
    expected = INFLUENCE.apply(pressure).mean(axis=1)[::spacing] / force
    kernel = column_influence(INFLUENCE, spacing, reach)
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
    falling = np.array([[5.0], [1.0]])  # a quantity that grew upwards would turn negative below
    assert at_displaced_planes(falling, np.array([1.0, 0.0]), np.array([[0.0], [-2.0]]))[1, 0] == 0.0


def test_faulty_arguments_are_refused():
    with pytest.raises(ParameterError, match="at least 1"):
        column_influence(INFLUENCE, 0, 1)
    with pytest.raises(ParameterError, match="at least 1"):
        column_influence(INFLUENCE, 1, 0)
    with pytest.raises(ParameterError, match="reach along 9"):
        displacement(np.ones(8), np.ones(9))
    with pytest.raises(ParameterError, match="highest"):
        at_displaced_planes(np.ones((2, 3)), np.array([0.0, 1.0]), np.zeros((2, 3)))
