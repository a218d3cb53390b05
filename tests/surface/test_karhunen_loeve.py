import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.surface import karhunen_loeve as kl
from roughslip.surface.covariance import Covariance


def covariance_matrix(covariance, grid):
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    return covariance(x[:, None] - x[None, :], y[:, None] - y[None, :])


@pytest.mark.parametrize("kind", ["gaussian", "exponential"])
def test_the_complete_expansion_gives_the_covariance_back(kind):
    grid = Grid(6, 5, 0.7, 1.1)
    covariance = Covariance(kind, 1.5, 2.0)
    expansion = kl.karhunen_loeve(covariance, grid, grid.size)
    modes = expansion.modes.reshape(grid.size, -1)
    # Bound: rounding of an eigendecomposition, some n eps of the variance; negative tails are cut at that size too.
    np.testing.assert_allclose(modes.T @ modes, covariance_matrix(covariance, grid), atol=1e-13 * 2.25 * grid.size)
    assert expansion.captured_variance == pytest.approx(1.0, abs=1e-12)


def test_three_ways_to_the_modes_agree():
    grid = Grid(12, 9, 1.0, 1.3)
    covariance = Covariance("gaussian", 1.0, 3.0)
    reference = kl._dense_modes(covariance, grid, 12)[0]
    np.testing.assert_allclose(kl._kronecker_modes(covariance, grid, 12)[0], reference, rtol=1e-11)
    np.testing.assert_allclose(kl._lanczos_modes(covariance, grid, 12)[0], reference, rtol=1e-11)


def test_exponential_on_a_line_has_the_eigenvalues_of_the_continuous_problem():
    """Ghanem and Spanos 1991, section 2.3.3: on [-a, a] lambda = 2 l / (1 + (l w)^2) with 1 = l w tan(w a) for even
    modes. Midpoint nodes are second order in the spacing: 400 nodes leave a relative error of (dx/l)^2 ~ 1e-5."""
    nodes, length = 400, 1.0
    grid = Grid(nodes, 1, 2.0 / nodes, 1.0)
    expansion = kl.karhunen_loeve(Covariance("exponential", 1.0, length), grid, 1)
    low, high = 1e-9, np.pi / 2 - 1e-9
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if length * middle * np.tan(middle) < 1 else (low, middle)
    exact = 2 * length / (1 + (length * low) ** 2)
    assert expansion.eigenvalues[0] * grid.dx == pytest.approx(exact, rel=2e-5)


def test_independent_nodes_give_one_mode_a_node():
    """The paper's reading: correlation length edge/1000 on 10 x 10 nodes leaves the identity matrix."""
    expansion = kl.karhunen_loeve(Covariance("gaussian", 2.0, 6e-7), Grid(10, 10, 6e-5, 6e-5), 100)
    np.testing.assert_array_equal(expansion.eigenvalues, 4.0)
    modes = expansion.modes.reshape(100, 100)
    np.testing.assert_array_equal(np.sort(modes, axis=1)[:, -1], 2.0)
    np.testing.assert_array_equal(np.abs(modes).sum(axis=0), 2.0)


def test_resolved_square_loses_what_the_design_says():
    """101 modes of exp(-(r/l)^2), l = 0.1035 edge: 95 % of the whole, 0.957 at the centre, 0.718 in the corner."""
    grid = Grid(64, 64, 1 / 64, 1 / 64)
    expansion = kl.karhunen_loeve(Covariance("gaussian", 1.0, 0.1035), grid, 101)
    assert expansion.captured_variance == pytest.approx(0.95, abs=0.005)
    assert expansion.variance()[32, 32] == pytest.approx(0.957, abs=0.002)
    assert expansion.variance()[0, 0] == pytest.approx(0.718, abs=0.005)


def test_heights_are_the_sum_of_the_modes():
    expansion = kl.karhunen_loeve(Covariance("gaussian", 1.0, 0.3), Grid(5, 4, 0.2, 0.2), 7)
    xi = np.random.default_rng(1).standard_normal(7)
    expected = sum(x * mode for x, mode in zip(xi, expansion.modes, strict=True))
    np.testing.assert_allclose(kl.heights(expansion.modes, xi), expected, atol=1e-14)


@pytest.mark.parametrize("order", [0, 21])
def test_impossible_orders_are_refused(order):
    with pytest.raises(ParameterError, match="20 nodes"):
        kl.karhunen_loeve(Covariance("gaussian", 1.0, 0.3), Grid(5, 4, 0.2, 0.2), order)
