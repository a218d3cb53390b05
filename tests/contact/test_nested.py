import math

import numpy as np
import pytest

from roughslip.contact import conjugate_gradients, nested
from roughslip.contact.conjugate_gradients import Problem
from roughslip.contact.influence import Influence
from roughslip.grid import Grid


@pytest.mark.parametrize(
    ("shape", "periodic"), [((96, 96), False), ((97, 81), False), ((400, 21), False), ((96, 96), True)]
)
@pytest.mark.parametrize("loaded", [False, True])
def test_start_saves_products(surface, shape: tuple[int, int], periodic: bool, loaded: bool, monkeypatch) -> None:
    """Odd meshes too. It saves the products in which the contact is found, about a quarter of all."""
    if periodic and not loaded:
        pytest.skip("a periodic cell has no fixed plane")
    monkeypatch.setattr(nested, "COARSEST", 32 * 32)
    influence = Influence(Grid(*shape, 1.0, 1.0), 1.0, periodic)
    problem = Problem(influence, surface(shape, 8.0, 1), math.inf, 0.05 * shape[0] * shape[1] if loaded else None)
    guess = nested.guess(problem)
    assert guess is not None
    assert guess.shape == shape
    assert (guess >= 0).all()
    cold, warm = conjugate_gradients.solve(problem, 1e-10), conjugate_gradients.solve(problem, 1e-10, guess)
    assert warm.products <= cold.products - 2
    np.testing.assert_allclose(warm.pressure, cold.pressure, rtol=0, atol=1e-8 * cold.pressure.max())
    if not loaded:
        assert not guess[problem.interference <= 0].any()


def test_nothing_to_start_from(monkeypatch: pytest.MonkeyPatch) -> None:
    """A small mesh, and a summit that the means of the coarser mesh lose."""
    monkeypatch.setattr(nested, "COARSEST", 16)
    spike = np.full((40, 40), -1.0)
    spike[7, 9] = 0.5
    assert nested.guess(Problem(Influence(Grid(40, 40, 1.0, 1.0), 1.0), spike)) is None
    assert nested.guess(Problem(Influence(Grid(4, 4, 1.0, 1.0), 1.0), np.ones((4, 4)))) is None


def test_pair_means() -> None:
    field = np.array([[1.0, 3.0, 5.0], [3.0, 5.0, 7.0]])
    assert np.array_equal(nested._pair_means(field, 0), [[2.0, 4.0, 6.0]])
    assert np.array_equal(nested._pair_means(field, 1), [[2.0, 5.0], [4.0, 7.0]])


def test_coarser_meshes_keep_cells_near_square() -> None:
    """The long cell's axis waits until the other has caught up; a single row is halved along itself."""
    influence = Influence(Grid(64, 8, 1.0, 4.0), 1.0)
    assert influence.coarser.grid == Grid(32, 8, 2.0, 4.0)
    assert influence.coarser.coarser.grid == Grid(16, 8, 4.0, 4.0)
    assert influence.coarser.coarser.coarser.grid == Grid(8, 4, 8.0, 8.0)
    assert Influence(Grid(9, 1, 8.0, 1.0), 1.0).coarser.grid == Grid(5, 1, 16.0, 1.0)
