"""Nodes around the centre and the variables of an expansion at each."""

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene.expansion import candidates, directions, heights_around
from roughslip.stages.from_scene.geometry import central_nodes, training_nodes
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.model import GaussianModel
from roughslip.surface.models import covariance_of

SURFACE = GaussianModel(covariance_of("gaussian", 1.0, 6.0), (6.0, 6.0))


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
    found = list(zip(*map(np.ndarray.tolist, central_nodes(SURFACE.lengths_m, grid)[:2]), strict=True))
    assert found == nodes
    assert found[0] == grid.centre
    assert {(nx - 1 - i, ny - 1 - j) for i, j in found} == set(found)


def test_training_nodes_lie_half_a_length_from_the_central_ones():
    """Lengths of 6 and 12 cells: nodes 3 and 6 cells out; each with its mirror images, the centre first."""
    grid = Grid(32, 31, 1.0, 1.0)
    nodes = training_nodes((6.0, 12.0), grid)
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
    assert np.array_equal(training_nodes(surface.lengths_m, grid), central_nodes(surface.lengths_m, grid))


def test_more_variables_than_modes_are_refused():
    grid = Grid(24, 24, 1.0, 1.0)
    modes = karhunen_loeve(SURFACE.covariance, grid, 5).modes
    with pytest.raises(IllPosedError, match="only 5 of the 6 variables"):
        directions(SURFACE, grid, modes, central_nodes(SURFACE.lengths_m, grid), 6)


def asked(variables, length=6.0, nodes=24, count=60, **rotation):
    """Candidates on a mesh, the modes of its surface and its nodes."""
    surface, grid = (
        GaussianModel(covariance_of("gaussian", 1.0, length), (length, length)),
        Grid(nodes, nodes, 1.0, 1.0),
    )
    modes = karhunen_loeve(surface.covariance, grid, count).modes
    places = training_nodes(surface.lengths_m, grid)
    configuration = {"expansion": {"variables": variables, **rotation}}
    return candidates(scene_of(configuration), surface, grid, modes, places), surface, grid, modes, places


@pytest.mark.parametrize("count", [3, 8])
def test_up_to_eight_variables_are_the_functionals_and_nothing_else(count):
    found, surface, grid, modes, places = asked(count)
    np.testing.assert_array_equal(found.directions, directions(surface, grid, modes, places, count)[0])
    assert (found.given, found.count) == (count, count)


@pytest.mark.parametrize("variables", [9, "best"])
def test_beyond_them_is_what_the_heights_around_have_besides(variables):
    """Orthonormal at every node, the height first. The span lacks at most a hundredth of the variance nearby."""
    found, surface, grid, modes, places = asked(variables)
    assert (found.given, found.count) == (8, None if variables == "best" else 9)
    np.testing.assert_array_equal(found.directions[:, :8], directions(surface, grid, modes, places, 8)[0])
    for one, x, y in zip(found.directions, places.x, places.y, strict=True):
        np.testing.assert_allclose(one @ one.T, np.eye(len(one)), atol=1e-12)
        np.testing.assert_allclose(one[0], modes[:, x, y] / np.linalg.norm(modes[:, x, y]), atol=1e-12)
        near = modes[:, x + 3, y - 2]
        assert np.sum((one @ near) ** 2) > 0.99 * np.sum(near**2)


def test_heights_around_a_node_are_those_at_offsets_from_it():
    """A length of six cells: a far mean of 12 to either side, offsets of two nodes; those off the mesh are dropped."""
    _, surface, grid, modes, places = asked(2)
    found = heights_around(surface, grid, modes, places)
    least, most = 2 * (int(min(places.x)) // 2), 2 * ((23 - int(max(places.x))) // 2)
    offsets = [(i, j) for i in range(-least, most + 1, 2) for j in range(-least, most + 1, 2)]
    assert found.shape == (16, len(offsets), 60)
    for node in (0, 7, 15):
        expected = [modes[:, places.x[node] + i, places.y[node] + j] for i, j in offsets]
        np.testing.assert_array_equal(found[node], expected)


def test_raw_modes_lead_and_train_at_the_centre_alone():
    found, *_ = asked(5, rotation="none")
    np.testing.assert_array_equal(found.directions, np.eye(60)[None, :5])
    assert (found.given, found.count) == (5, 5)
    assert found.distance2.tolist() == [0.0]
    best, *_ = asked("best", rotation="none")
    np.testing.assert_array_equal(best.directions, np.eye(60)[None, :12])
    pressure, gap = np.arange(32.0).reshape(2, 16), np.zeros((2, 16))
    samples = found.samples(np.arange(120.0).reshape(2, 60), pressure, gap)
    assert samples.variables.tolist() == [[[0, 1, 2, 3, 4]], [[60, 61, 62, 63, 64]]]
    assert samples.pressure.tolist() == [[0], [16]]


def test_more_variables_than_the_surface_has_around_the_centre_are_refused():
    """Independent heights: 25 around each node."""
    found, *_ = asked(25, length=0.1, nodes=10, count=100)
    assert found.directions.shape == (4, 25, 100)
    with pytest.raises(IllPosedError, match="26 variables were asked for; around the centre the surface has 25"):
        asked(26, length=0.1, nodes=10, count=100)


@pytest.mark.parametrize(("lay", "symmetries"), [(0.0, 2), (0.6, 1)])
def test_signs_of_the_variables_are_those_of_surfaces_turned_with_their_nodes(lay, symmetries):
    """Mirrored along x and along y; where the lay is aslant, turned by half a turn. A turned surface of the modes is
    one of the modes again, as their covariance stays the same."""
    covariance = covariance_of("gaussian", 1.0, 6.0, 9.0, lay)
    surface, grid = GaussianModel(covariance, covariance.axis_lengths_m), Grid(24, 24, 1.0, 1.0)
    modes = karhunen_loeve(covariance, grid, 30).modes
    places = training_nodes(surface.lengths_m, grid)
    found, odd = directions(surface, grid, modes, places, 8)
    assert odd.shape == (8, symmetries)
    flips = [(0,), (1,)] if symmetries == 2 else [(0, 1)]
    at = {node: number for number, node in enumerate(zip(places.x.tolist(), places.y.tolist(), strict=True))}
    flat = modes.reshape(30, -1).T
    for flip, signs in zip(flips, odd.T, strict=True):
        turn, left, *_ = np.linalg.lstsq(flat, np.flip(modes, [1 + axis for axis in flip]).reshape(30, -1).T)
        assert np.all(left < 1e-20)
        for (x, y), number in at.items():
            image = at[23 - x if 0 in flip else x, 23 - y if 1 in flip else y]
            np.testing.assert_allclose(found[image] @ turn, found[number] * (-1.0) ** signs[:, None], atol=1e-7)
