"""How many nodes friction paths take, found by a pilot ensemble."""

import numpy as np
import pytest

from roughslip.errors import ConvergenceError
from roughslip.stages import path_resolution
from roughslip.stages.path_resolution import Thinned, error_bounds
from tests.stages.test_stages_motion import CONFIGURATION, scattered


def asked(error: float, std: float = 1e-9, dampings: tuple[float, ...] = (0.1, 0.17)) -> dict:
    auto = {"nodes_per_correlation_length": "auto", "count_error": error, "damping_ratios": list(dampings)}
    return scattered(std) | {"ensemble": CONFIGURATION["ensemble"] | auto | {"duration_periods": 10}}


@pytest.mark.parametrize("step", [1, 2, 3, 7])
@pytest.mark.parametrize("size", [1, 2, 5, 100])
def test_thinned_pieces_are_the_thinned_path(step, size):
    path = np.arange(100.0)
    pieces = [path[k : k + size] for k in range(0, 100, size)]
    assert np.array_equal(np.concatenate(list(Thinned(pieces, step))), path[::step])


def test_bounds_of_a_known_change():
    """Changes 1 and 3 at a damping of mean 20: 2 +- 12.7062 cycles, twice that, over the largest mean of 40."""
    fine = np.array([[40.0, 20.0], [40.0, 20.0]])
    lower, upper = error_bounds(fine + np.array([[0.0, 1.0], [0.0, 3.0]]), fine)
    assert (lower, upper) == (0.0, pytest.approx(2 * (2 + 12.706204736) / 40))
    lower, upper = error_bounds(fine - np.array([[0.0, 4.0], [0.0, 4.0]]), fine)
    assert (lower, upper) == (pytest.approx(2 * (4 - 1.5) / 40), pytest.approx(2 * (4 + 1.5) / 40))  # 3 of 2 paths
    assert error_bounds(np.zeros((8, 2)), np.zeros((8, 2))) == (0.0, 0.0)


def test_bounds_cover_a_change_of_few_paths():
    """One path in ten counts one cycle less: in most trials with eight none shows it, and still the bound covers it."""
    rng = np.random.default_rng(1)
    fine = np.full((8, 1), 20.0)
    trials = [error_bounds(fine - (rng.random((8, 1)) < 0.1), fine)[1] >= 2 * 0.1 / 20 for _ in range(400)]
    assert np.mean(trials) > 0.95


@pytest.mark.slow
def test_where_nothing_scatters_the_fewest_nodes_are_enough(run):
    found = run(path_resolution, asked(0.01))
    assert found["nodes_per_correlation_length"] == 4
    paths = found["tried_paths"][-1]
    assert 0 < found["count_error"] <= 0.01
    assert found["count_error"] * paths == pytest.approx(2 * 3 / 8)  # three changes in so many paths of eight cycles


@pytest.mark.slow
def test_scatter_takes_more_paths(run):
    """At a damping where counts scatter eight paths do not determine an error of a fifth. Every trial is kept."""
    found = run(path_resolution, asked(0.2, 0.05, (0.17, 0.31)), "scatter")
    assert found["count_error"] <= 0.2
    assert found["tried_paths"][-1] > 8
    assert found["tried_error"][-1] == found["count_error"]
    assert found["tried_nodes"][-1] == found["nodes_per_correlation_length"]


def test_what_cannot_be_told_is_an_error(run, monkeypatch):
    monkeypatch.setattr(path_resolution, "MOST_PATHS", 8)
    with pytest.raises(ConvergenceError, match="8 paths determine it no closer"):
        run(path_resolution, asked(0.001, 0.05, (0.17, 0.31)), "untold")


def test_nodes_that_are_not_enough_are_an_error(run, monkeypatch):
    """Counts that change by a tenth whenever the spacing is halved."""
    monkeypatch.setattr(path_resolution, "MOST_NODES", 8)
    monkeypatch.setattr(path_resolution, "error_bounds", lambda coarse, fine: (0.1, 0.1))
    with pytest.raises(ConvergenceError, match="8 nodes are not enough") as caught:
        run(path_resolution, asked(0.01), "few")
    assert (caught.value.residual, caught.value.work) == (0.1, 2 * (8 + 8) * 2)  # 4 and 8 nodes, two dampings
