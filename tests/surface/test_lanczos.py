"""Leading modes by Lanczos: none is missed, however often its eigenvalue comes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.grid import Grid
from roughslip.surface import lanczos
from roughslip.surface.covariance import Covariance, self_affine
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.symmetry import symmetry_classes


@dataclass(frozen=True)
class Plain(Covariance):
    """A covariance that does not say that it is a product, so that Lanczos is taken."""

    separable = False


def matrix_of(covariance, grid):
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    return covariance(x[:, None] - x, y[:, None] - y) / covariance.rms_height_m**2


def check_leading(found, expected, apply=None):
    """Eigenvalues as often as they come: orthonormal vectors with small residuals and the sorted values prove all."""
    values, vectors, residuals = found
    order = len(values)
    # FFT products and orthogonalisation round by some n eps of the largest; the residuals enter squared
    np.testing.assert_allclose(values, np.sort(expected)[::-1][:order], atol=1e-13 * np.max(expected))
    np.testing.assert_allclose(vectors @ vectors.T, np.eye(order), atol=1e-12)
    assert residuals.max() < lanczos.LARGEST_RESIDUAL


def given_operator(monkeypatch, diagonal):
    """The matrix replaced by a diagonal one, of which every class has its eigenvalues exactly as often."""
    monkeypatch.setattr(lanczos, "covariance_operator", lambda *_: lambda field: diagonal * field)
    return Grid(*diagonal.shape, 1.0, 1.0)


MIRRORED, LAID = Covariance("exponential", 1.0, 3.0), Covariance("exponential", 1.0, 4.0, 2.0, 0.5)


# Modes that come twice.


# lambda_i lambda_j for i, j = 0, 1, 2 ... come as 00, 01 10, 11, 02 20, 12 21, ...: orders in and after each pair
@pytest.mark.parametrize("order", [2, 3, 4, 5, 6, 7, 8, 10, 11, 15, 40, 60])
def test_products_of_equal_factors_come_twice(order):
    """02 and 20 are both even about both middle lines, 13 and 31 both odd."""
    grid = Grid(16, 16, 1 / 16, 1 / 16)
    expected = karhunen_loeve(Covariance("gaussian", 2.0, 0.2), grid, order).eigenvalues / 4.0
    check_leading(lanczos.leading_modes(Plain("gaussian", 2.0, 0.2), grid, order), expected)


@pytest.mark.parametrize("request_", [{"order": 10}, {"order": 5}, {"share": 0.9}])
@pytest.mark.parametrize("cells", [(1 / 34, 1 / 34), (1 / 34, 2 / 34)])
def test_an_expansion_has_modes_that_come_twice(request_, cells):
    """Lengths in the ratio of the cells make equal factors on a mesh that is no square."""
    grid, lengths = Grid(34, 34, *cells), (0.1, 0.1 * cells[1] / cells[0])
    expected = karhunen_loeve(Covariance("gaussian", 1.0, *lengths), grid, **request_)
    found = karhunen_loeve(Plain("gaussian", 1.0, *lengths), grid, **request_)
    np.testing.assert_allclose(found.eigenvalues, expected.eigenvalues, atol=1e-13 * expected.eigenvalues[0])


def often(times):
    """1, 1/2, 1/3 ... each so many times in the quarter of 12 x 12 nodes and its images: in each of four classes."""
    quarter = (1 / (1 + np.arange(144) // times)).reshape(12, 12)
    half = np.concatenate((quarter, quarter[:, ::-1]), axis=1)
    return np.concatenate((half, half[::-1]))


@pytest.mark.parametrize("covariance", [MIRRORED, LAID])
@pytest.mark.parametrize("times", [1, 2, 5, 24])
def test_eigenvalues_that_come_often_in_one_class(covariance, times, monkeypatch):
    diagonal = often(times)
    grid = given_operator(monkeypatch, diagonal)
    for order in (1, 7, 9, 40, 60):
        check_leading(lanczos.leading_modes(covariance, grid, order), diagonal.ravel())


@pytest.mark.parametrize("covariance", [MIRRORED, LAID])
def test_one_start_is_not_enough(covariance, monkeypatch):
    """Rounding does not bring every mode into the first Krylov spaces: of 1, 20 times, and 1/2 they see some each."""
    grid = given_operator(monkeypatch, often(5))
    monkeypatch.setattr(lanczos, "_nothing_above", lambda *_: True)
    assert lanczos.leading_modes(covariance, grid, 9)[0][-1] == pytest.approx(0.5)


def test_eigenvalues_that_differ_by_rounding_or_little_more(monkeypatch):
    """Lanczos takes the nearest pair for one, and separates the others late."""
    pairs = [3.0, 3.0 * (1 - 1e-15), 2.0, 2.0 * (1 - 1e-9), 1.0, 1.0 - 1e-3]
    half = np.concatenate((pairs, np.linspace(0.9, 0.0, 194))).reshape(20, 10)
    diagonal = np.concatenate((half, half[::-1, ::-1]), axis=1)
    grid = given_operator(monkeypatch, diagonal)
    for order in range(1, 14):
        check_leading(lanczos.leading_modes(LAID, grid, order), diagonal.ravel())


def test_independent_nodes():
    """The identity: every vector is a mode, also where all that have been found are fewer than those asked for."""
    found = lanczos.leading_modes(Covariance("exponential", 2.0, 1e-6), Grid(16, 15, 1.0, 1.0), 60)
    check_leading(found, np.ones(240))


def test_a_mode_that_shows_late_is_waited_for(monkeypatch):
    """2 % above the limit, one of 3200 and the rest up to 5 % below: the largest Ritz value passes the limit late."""
    rest = np.linspace(0.0, 0.95, 3200)
    for hidden in (True, False):
        half = np.append(rest[:-1], 1.02) if hidden else rest
        half = half.reshape(80, 40)
        diagonal = np.concatenate((half, half[::-1, ::-1]), axis=1)
        grid = given_operator(monkeypatch, diagonal)
        apply = lanczos.covariance_operator(LAID, grid)
        processes = [lanczos.Process(one, 50, seed) for seed, one in enumerate(symmetry_classes(LAID, grid))]
        assert lanczos._nothing_above(1.0, 1e-11, apply, processes) is not hidden
        if hidden:
            assert processes[0].count > lanczos.STRIDE  # a first look does not see it
        else:  # the theorem: the error that k steps exclude is the 5 % to the next Ritz value
            largest = max(process.ritz()[0][0] for process in processes)
            enough = 0.5 + math.log(1.648 * math.sqrt(3200) / lanczos.DOUBT) / (2 * math.sqrt(1 - largest))
            assert enough <= processes[0].count < enough + 2 * lanczos.STRIDE


# All modes of small meshes.

KINDS = st.sampled_from(["gaussian", "exponential", "separable_exponential", "matern", "self_affine"])
LENGTHS = st.floats(0.3, 6.0)


@given(
    shape=st.tuples(st.integers(1, 13), st.integers(1, 13)),
    cell=st.sampled_from([1.0, 0.7]),
    kind=KINDS,
    lengths=st.tuples(LENGTHS, st.one_of(st.none(), LENGTHS)),
    lay=st.sampled_from([0.0, math.pi / 4, math.pi / 2, 0.4]),
    part=st.floats(0.0, 1.0),
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_eigenvalues_are_those_of_the_matrix(shape, cell, kind, lengths, lay, part):
    grid = Grid(*shape, 1.0, cell)
    order = 1 + int(part * max(grid.size // 4 - 1, 0))
    if kind == "self_affine":
        across = None if lengths[1] is None else 4 * lengths[1]
        covariance = self_affine(1.0, 0.7, 4 * lengths[0], 1.0, across, lay)
    else:
        covariance = Covariance(kind, 1.0, *lengths, lay, smoothness=1.5 if kind == "matern" else None)
    expected = np.linalg.eigvalsh(matrix_of(covariance, grid))
    check_leading(lanczos.leading_modes(covariance, grid, order), expected)


# How it goes.


def test_one_product_serves_all_classes(monkeypatch):
    """Four classes share 40 modes, some 12 each; a class by itself would take as many products as all together."""
    products = []
    operator = lanczos.covariance_operator

    def counted(*arguments):
        apply = operator(*arguments)
        return lambda field: products.append(1) or apply(field)

    monkeypatch.setattr(lanczos, "covariance_operator", counted)
    lanczos.leading_modes(Covariance("exponential", 1.0, 4.0), Grid(40, 40, 1.0, 1.0), 40)
    assert len(products) <= 40 + 70  # residuals, and those of both rounds: 65 measured


def test_the_basis_stays_small_where_lanczos_is_slow(monkeypatch):
    """Neighbours correlated by exp(-2) alone: the largest eigenvalues differ by 1e-5, and the basis is full often."""
    compressed = []
    compress = lanczos.Process._compress
    monkeypatch.setattr(lanczos.Process, "_compress", lambda *a: compressed.append(1) or compress(*a))
    covariance, grid = Covariance("exponential", 1.0, 0.5), Grid(600, 1, 1.0, 1.0)
    check_leading(lanczos.leading_modes(covariance, grid, 4), np.linalg.eigvalsh(matrix_of(covariance, grid)))
    assert len(compressed) > 10  # one is the start of the second round of a class


def test_a_vector_almost_in_the_basis_is_orthogonalised():
    """1e-10 of it is outside; one pass would leave some 1e-16 / 1e-10 of that in the basis."""
    process = lanczos.Process(symmetry_classes(LAID, Grid(12, 10, 1.0, 1.0))[0], 20, 0)
    rows = np.linalg.qr(np.random.default_rng(1).standard_normal((60, 31)))[0].T
    process.basis[:30] = rows[:30]
    vector, coefficients = process._orthogonalised(np.ones(30) @ rows[:30] + 1e-10 * rows[30], 30)
    assert np.abs(process.basis[:30] @ vector).max() < 1e-14 * np.linalg.norm(vector)
    np.testing.assert_allclose(coefficients, 1.0, atol=1e-14)
    assert np.linalg.norm(vector) == pytest.approx(1e-10, rel=1e-4)


def test_a_whole_class_ends():
    """Its modes are all there is, so no product is spent on rounding."""
    grid = Grid(4, 2, 1.0, 1.0)
    apply = lanczos.covariance_operator(LAID, grid)
    process = lanczos.Process(symmetry_classes(LAID, grid)[0], 2, 0)
    for _ in range(4):
        assert process.coupling > 0.0
        process.advance(apply(process.next_field()))
    assert process.coupling == 0.0
    process.start(0.0)
    assert process.kept == 4
    assert lanczos._nothing_above(0.0, 0.0, apply, [process])


def test_the_same_bits_every_time():
    first, second = (lanczos.leading_modes(LAID, Grid(15, 12, 1.0, 1.0), 20) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


def test_what_takes_too_long_is_an_error(monkeypatch):
    grid = Grid(20, 20, 1.0, 1.0)
    monkeypatch.setattr(lanczos, "MOST_PRODUCTS", 10)
    with pytest.raises(ConvergenceError, match="has not found 30 modes") as caught:
        lanczos.leading_modes(LAID, grid, 30)
    assert caught.value.work == 10
    processes = [lanczos.Process(one, 30, 0) for one in symmetry_classes(LAID, grid)]
    apply = lanczos.covariance_operator(LAID, grid)
    with pytest.raises(ConvergenceError, match="missing cannot be told"):
        lanczos._nothing_above(35.82, 1e-11, apply, processes)  # lambda_1 is 35.818


def test_a_covariance_that_is_not_finite_is_refused():
    class Broken(Plain):
        def __call__(self, x, y=0.0):
            return np.where(np.hypot(x, y) > 5.0, np.nan, 1.0)

    with pytest.raises(ParameterError, match="not finite"):
        lanczos.leading_modes(Broken("gaussian", 1.0, 1.0), Grid(9, 8, 1.0, 1.0), 3)
