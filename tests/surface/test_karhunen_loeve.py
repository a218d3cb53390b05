"""Karhunen-Loeve expansion: against matrices, the continuous problem and the shares of the variance."""

import numpy as np
import pytest
from scipy.optimize import brentq

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.surface import karhunen_loeve as kl
from roughslip.surface import lanczos
from roughslip.surface.models import covariance_of, self_affine

ROTATED = {
    "exponential": covariance_of("exponential", 1.5, 4.0, 1.5, lay_rad=0.5),
    "gaussian": covariance_of("gaussian", 1.5, 4.0, 2.0, lay_rad=-0.9),
    "self-affine": self_affine(1.5, 0.7, 9.0, 2.0, 6.0, 0.4),
}
MIRRORED = {
    "exponential": covariance_of("exponential", 1.5, 3.0, 2.0),
    "matern": covariance_of("matern", 1.5, 3.0, smoothness=1.2),
    "separable exponential": covariance_of("separable_exponential", 1.5, 3.0, 2.0),
}


def covariance_matrix(covariance, grid):
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    return covariance(x[:, None] - x[None, :], y[:, None] - y[None, :])


def exponential_on_unit_interval(length, count):
    """Eigenvalues on [-a, a], a = 1/2, by Ghanem and Spanos 1991, section 2.3.3: lambda = 2 l / (1 + (l w)^2).

    Even modes have 1 = l w tan(w a), odd ones l w = -tan(w a). Root n lies between n pi / 2a and (n + 1) pi / 2a.
    """
    a, roots = 0.5, []
    for n in range(count):
        even = n % 2 == 0

        def equation(w, even=even):
            return np.cos(w * a) - length * w * np.sin(w * a) if even else np.sin(w * a) + length * w * np.cos(w * a)

        roots.append(brentq(equation, n * np.pi / (2 * a) + 1e-9, (n + 1) * np.pi / (2 * a) - 1e-9, xtol=1e-14))
    return 2 * length / (1 + (length * np.array(roots)) ** 2)


@pytest.mark.parametrize("covariance", [covariance_of("gaussian", 1.5, 2.0), *MIRRORED.values(), *ROTATED.values()])
def test_the_complete_expansion_gives_the_covariance_back(covariance):
    grid = Grid(6, 5, 0.7, 1.1)
    expansion = kl.karhunen_loeve(covariance, grid, grid.size)
    modes = expansion.modes.reshape(grid.size, -1)
    # Bound: rounding of an eigendecomposition, some n eps of the variance; negative tails are cut at that size too.
    np.testing.assert_allclose(modes.T @ modes, covariance_matrix(covariance, grid), atol=1e-13 * 2.25 * grid.size)
    assert expansion.captured_variance == pytest.approx(1.0, abs=1e-12)
    assert expansion.residuals.max() < 1e-14 * grid.size


def test_kronecker_products_are_the_modes_of_the_matrix():
    grid, order = Grid(12, 9, 1.0, 1.3), 12
    for covariance in (
        covariance_of("gaussian", 1.0, 3.0, 2.0),
        covariance_of("separable_exponential", 1.0, 3.0, 2.0),
    ):
        plain = np.linalg.eigvalsh(covariance_matrix(covariance, grid))[::-1]
        expansion = kl.karhunen_loeve(covariance, grid, order)
        np.testing.assert_allclose(expansion.eigenvalues, plain[:order], rtol=1e-11)
        image = covariance_matrix(covariance, grid) @ expansion.modes.reshape(order, -1).T
        difference = image - expansion.eigenvalues * expansion.modes.reshape(order, -1).T
        assert np.abs(difference).max() < 1e-13 * plain[0]


@pytest.mark.parametrize("covariance", [*MIRRORED.values(), *ROTATED.values()])
@pytest.mark.parametrize("shape", [(12, 10), (11, 9), (60, 1), (1, 61)])
def test_lanczos_finds_the_modes_of_the_matrix(covariance, shape, monkeypatch):
    monkeypatch.setattr(lanczos, "SMALL_MESH", 0)
    grid, order = Grid(*shape, 1.0, 1.2), 14
    matrix = covariance_matrix(covariance, grid) / covariance.rms_height_m**2
    values, vectors, residuals = lanczos.leading_modes(covariance, grid, order)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(matrix)[::-1][:order], rtol=1e-11)
    np.testing.assert_allclose(vectors @ vectors.T, np.eye(order), atol=1e-12)
    true = np.linalg.norm(matrix @ vectors.T - values * vectors.T, axis=0) / values[0]
    np.testing.assert_allclose(residuals, true, atol=1e-14)
    assert true.max() < 1e-11


def test_the_operator_is_the_matrix():
    grid = Grid(9, 14, 1.0, 0.6)
    field = np.random.default_rng(1).standard_normal(grid.shape)
    for covariance in (*MIRRORED.values(), *ROTATED.values()):
        plain = covariance_matrix(covariance, grid) @ field.ravel() / covariance.rms_height_m**2
        np.testing.assert_allclose(lanczos.covariance_operator(covariance, grid)(field).ravel(), plain, atol=1e-12)


def test_exponential_on_an_interval_has_the_eigenvalues_of_the_continuous_problem():
    exact = exponential_on_unit_interval(0.1, 3)
    np.testing.assert_allclose(exact, [0.187083, 0.156046, 0.121154], atol=5e-7)
    errors = []
    for nodes in (128, 256, 512, 4096):
        expansion = kl.karhunen_loeve(covariance_of("exponential", 1.0, 0.1), Grid(nodes, 1, 1 / nodes, 1.0), 3)
        errors.append(expansion.eigenvalues / nodes - exact)
    assert np.abs(errors[-1]).max() < 1e-6
    orders = np.log2(np.array(errors[:2]) / np.array(errors[1:3]))
    np.testing.assert_allclose(orders, 2.0, atol=0.02)  # the midpoint rule, whose cusp lies on the nodes


def test_independent_nodes_give_one_mode_a_node():
    """The paper's reading: correlation length edge/1000 on 10 x 10 nodes leaves the identity matrix."""
    expansion = kl.karhunen_loeve(covariance_of("gaussian", 2.0, 6e-7), Grid(10, 10, 6e-5, 6e-5), 100)
    np.testing.assert_array_equal(expansion.eigenvalues, 4.0)
    modes = expansion.modes.reshape(100, 100)
    np.testing.assert_array_equal(np.sort(modes, axis=1)[:, -1], 2.0)
    np.testing.assert_array_equal(np.abs(modes).sum(axis=0), 2.0)


def test_resolved_square_loses_what_the_design_says():
    """101 modes of exp(-(r/l)^2), l = 0.1035 edge: 95 % of the whole, 0.957 at the centre, 0.718 in the corner."""
    grid = Grid(64, 64, 1 / 64, 1 / 64)
    expansion = kl.karhunen_loeve(covariance_of("gaussian", 3.0, 0.1035), grid, 101)
    assert expansion.captured_variance == pytest.approx(0.95, abs=0.005)
    assert expansion.captured_at(grid.centre) == pytest.approx(0.957, abs=0.002)
    assert expansion.captured_at((0, 0)) == pytest.approx(0.718, abs=0.005)
    np.testing.assert_allclose(expansion.variance()[0, 0] / 9.0, expansion.captured_at((0, 0)), rtol=1e-12)
    assert np.mean(expansion.variance()) / 9.0 == pytest.approx(expansion.captured_variance, rel=1e-12)


@pytest.mark.parametrize(
    ("covariance", "grid"),
    [
        (covariance_of("gaussian", 2.0, 0.2), Grid(20, 30, 0.05, 0.05)),  # Kronecker
        (covariance_of("gaussian", 2.0, 0.2), Grid(1100, 4, 0.01, 0.05)),  # Kronecker with a long line
        (covariance_of("exponential", 2.0, 3.0), Grid(15, 12, 1.0, 1.0)),  # dense
        (covariance_of("exponential", 2.0, 12.0, 6.0, lay_rad=0.5), Grid(40, 40, 1.0, 1.0)),  # Lanczos
    ],
)
def test_a_share_takes_the_fewest_modes_that_carry_it(covariance, grid):
    share = 0.8
    expansion = kl.karhunen_loeve(covariance, grid, share=share)
    assert expansion.captured_variance >= share
    last = expansion.eigenvalues[-1] / (grid.size * 4.0)
    assert expansion.captured_variance - last < share
    same = kl.karhunen_loeve(covariance, grid, len(expansion.modes))
    np.testing.assert_allclose(same.eigenvalues, expansion.eigenvalues, rtol=1e-10)


def test_numbers_predicted_too_low_grow(monkeypatch):
    cases = [
        (covariance_of("gaussian", 2.0, 0.2), Grid(1100, 4, 0.01, 0.05)),
        # three modes along x and all along y carry the share too, but not by the fewest
        (covariance_of("gaussian", 2.0, 2.5, 0.2), Grid(1100, 6, 0.01, 0.1)),
        (covariance_of("exponential", 2.0, 12.0, 6.0, lay_rad=0.5), Grid(40, 40, 1.0, 1.0)),
    ]
    for covariance, grid in cases:
        expected = kl.karhunen_loeve(covariance, grid, share=0.8)
        with monkeypatch.context() as patch:
            patch.setattr(kl, "_predicted_order", lambda *_: 3)
            ours = kl.karhunen_loeve(covariance, grid, share=0.8)
        np.testing.assert_allclose(ours.eigenvalues, expected.eigenvalues, rtol=1e-10)


def test_a_long_line_is_solved_for_its_leading_modes_alone(monkeypatch):
    """1100 nodes by Lanczos, and the same by LAPACK."""
    covariance, grid = covariance_of("gaussian", 1.0, 0.3, 0.2), Grid(1100, 6, 0.01, 0.05)
    leading = kl.karhunen_loeve(covariance, grid, 40)
    monkeypatch.setattr(kl, "DENSE_NODES", 2000)
    whole = kl.karhunen_loeve(covariance, grid, 40)
    np.testing.assert_allclose(leading.eigenvalues, whole.eigenvalues, rtol=1e-9)
    assert leading.residuals.max() < 1e-11
    np.testing.assert_allclose(leading.variance(), whole.variance(), atol=1e-9)


def test_what_represents_a_field():
    grid = Grid(64, 64, 1 / 64, 1 / 64)
    smooth, rough = covariance_of("gaussian", 1.0, 0.1035), covariance_of("exponential", 1.0, 0.01)
    expand = kl.representation(smooth, grid, share=0.95)
    assert expand.method == "karhunen_loeve"
    needed = len(kl.karhunen_loeve(smooth, grid, share=0.95).modes)
    assert expand.order == pytest.approx(needed, rel=0.2)  # ten lengths on an edge: the spectrum errs by its boundary
    embed = kl.representation(rough, grid, share=0.95)
    assert embed.method == "embedding"
    assert embed.captured_variance == 1.0
    assert "quarter" in embed.reason
    assert kl.representation(smooth, grid, 101).captured_variance == pytest.approx(0.95, abs=0.02)
    assert kl.representation(rough, grid, share=1.0).order == grid.size
    assert "GiB" in kl.representation(smooth, Grid(1200, 1200, 1 / 1200, 1 / 1200), 101).reason
    line = covariance_of("exponential", 1.0, 0.1)  # a line has no second axis: the size of its cell there has no effect
    shares = [kl.representation(line, Grid(500, 1, 0.002, dy), 20).captured_variance for dy in (1e-3, 1.0)]
    assert shares[0] == pytest.approx(shares[1], rel=1e-12)


def test_heights_are_the_sum_of_the_modes():
    expansion = kl.karhunen_loeve(covariance_of("gaussian", 1.0, 0.3), Grid(5, 4, 0.2, 0.2), 7)
    xi = np.random.default_rng(1).standard_normal(7)
    expected = sum(x * mode for x, mode in zip(xi, expansion.modes, strict=True))
    np.testing.assert_allclose(kl.heights(expansion.modes, xi), expected, atol=1e-14)


@pytest.mark.parametrize("order", [0, 21])
def test_impossible_orders_are_refused(order):
    with pytest.raises(ParameterError, match="20 nodes"):
        kl.karhunen_loeve(covariance_of("gaussian", 1.0, 0.3), Grid(5, 4, 0.2, 0.2), order)
    with pytest.raises(ParameterError, match="20 nodes"):
        lanczos.leading_modes(covariance_of("gaussian", 1.0, 0.3), Grid(5, 4, 0.2, 0.2), order)


@pytest.mark.parametrize(
    "request_", [{}, {"order": 3, "share": 0.5}, {"share": 0.0}, {"share": np.nan}, {"share": 1.5}]
)
def test_impossible_requests_are_refused(request_):
    with pytest.raises(ParameterError, match="share"):
        kl.karhunen_loeve(covariance_of("gaussian", 1.0, 0.3), Grid(5, 4, 0.2, 0.2), **request_)


def test_what_needs_too_many_modes_is_sent_to_the_embedding():
    rough, grid = covariance_of("exponential", 1.0, 0.01), Grid(70, 70, 1 / 70, 1 / 70)
    for request in ({"share": 0.95}, {"order": 2000}):
        with pytest.raises(IllPosedError, match="embedding"):
            kl.karhunen_loeve(rough, grid, **request)
    with pytest.raises(IllPosedError, match="embedding"):
        kl.karhunen_loeve(covariance_of("gaussian", 1.0, 1e-4), Grid(5000, 2, 1e-3, 1e-3), 3000)


def test_an_inaccurate_mode_is_an_error(monkeypatch):
    monkeypatch.setattr(lanczos, "LARGEST_RESIDUAL", 0.0)
    with pytest.raises(ConvergenceError, match="inaccurate") as caught:
        kl.karhunen_loeve(covariance_of("exponential", 1.0, 5.0), Grid(40, 40, 1.0, 1.0), 5)
    assert 0.0 < caught.value.residual < 1e-11
