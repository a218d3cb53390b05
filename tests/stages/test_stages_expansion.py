"""Nodes around the centre and the variables of an expansion at each."""

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.stages.expansion import directions
from roughslip.stages.nodes import central_nodes, training_nodes
from roughslip.surface.covariance import Covariance
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.model import GaussianModel

SURFACE = GaussianModel(Covariance("gaussian", 1.0, 6.0), (6.0, 6.0))


@pytest.mark.parametrize(
    ("nx", "ny", "nodes"),
    [
        (10, 10, [(5, 5), (5, 4), (4, 5), (4, 4)]),
        (9, 9, [(4, 4)]),
        (10, 9, [(5, 4), (4, 4)]),
        (1, 1, [(0, 0)]),
        (2, 2, [(1, 1), (1, 0), (0, 1), (0, 0)]),
    ],
)
def test_central_nodes_are_the_centre_and_its_mirror_images(nx, ny, nodes):
    grid = Grid(nx, ny, 1.0, 1.0)
    found = list(zip(*map(np.ndarray.tolist, central_nodes(SURFACE, grid)[:2]), strict=True))
    assert found == nodes
    assert found[0] == grid.centre
    assert {(nx - 1 - i, ny - 1 - j) for i, j in found} == set(found)


def test_training_nodes_lie_half_a_length_from_the_central_ones():
    """Lengths of 6 and 12 cells: nodes 3 and 6 cells out; each with its mirror images, the centre first."""
    grid = Grid(32, 31, 1.0, 1.0)
    nodes = training_nodes(GaussianModel(SURFACE.covariance, (6.0, 12.0)), grid)
    found = set(zip(nodes.x.tolist(), nodes.y.tolist(), strict=True))
    assert found == {(i, j) for i in (12, 15, 16, 19) for j in (9, 15, 21)}
    assert (nodes.x[0], nodes.y[0]) == grid.centre
    outermost = (3.5**2 - 0.5**2) / 6**2 + 6**2 / 12**2
    assert nodes.distance2[[0, -1]] == pytest.approx([0.0, outermost])
    assert np.all(np.diff(nodes.distance2) >= 0)


@pytest.mark.parametrize(("nodes", "length"), [(10, 2.9), (6, 6.0)])
def test_only_the_central_nodes_train_where_others_are_neighbours_or_on_the_border(nodes, length):
    """Half of 2.9 cells is one cell; half of 6 is 3, which on 6 nodes is the border."""
    surface, grid = GaussianModel(SURFACE.covariance, (length, length)), Grid(nodes, nodes, 1.0, 1.0)
    assert np.array_equal(training_nodes(surface, grid), central_nodes(surface, grid))


def test_variables_are_standard_normal_at_every_node_and_the_first_is_the_height():
    grid = Grid(24, 24, 1.0, 1.0)
    modes = karhunen_loeve(SURFACE.covariance, grid, 40).modes
    nodes = training_nodes(SURFACE, grid)
    found = directions(SURFACE, grid, modes, nodes, 8)
    assert found.shape == (16, 8, 40)
    for one, x, y in zip(found, nodes.x, nodes.y, strict=True):
        np.testing.assert_allclose(one @ one.T, np.eye(8), atol=1e-12)
        np.testing.assert_allclose(one[0], modes[:, x, y] / np.linalg.norm(modes[:, x, y]), atol=1e-12)


def test_more_variables_than_modes_are_refused():
    grid = Grid(24, 24, 1.0, 1.0)
    modes = karhunen_loeve(SURFACE.covariance, grid, 5).modes
    with pytest.raises(IllPosedError, match="only 5 of the 6 variables"):
        directions(SURFACE, grid, modes, central_nodes(SURFACE, grid), 6)
