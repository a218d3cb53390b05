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
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.models import Gaussian, covariance_of, self_affine


@dataclass(frozen=True)
class Plain(Gaussian):
    """A covariance that does not say that it is a product, so that Lanczos is taken."""

    separable = False


LAID = covariance_of("exponential", 1.0, 4.0, 2.0, 0.5)
KINDS = st.sampled_from(["gaussian", "exponential", "separable_exponential", "matern", "self_affine"])
LENGTHS = st.floats(0.3, 6.0)


@pytest.fixture
def always_lanczos(monkeypatch):
    monkeypatch.setattr(lanczos, "SMALL_MESH", 0)


def matrix_of(covariance, grid):
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    return covariance(x[:, None] - x, y[:, None] - y) / covariance.rms_height_m**2


def check_leading(found, expected):
    """Orthonormal vectors with small residuals, and the sorted values, prove that every mode is there."""
    values, vectors, residuals = found
    order = len(values)
    # FFT products and orthogonalisation round by some n eps of the largest; the residuals enter squared
    np.testing.assert_allclose(values, np.sort(expected)[::-1][:order], atol=1e-13 * np.max(expected))
    np.testing.assert_allclose(vectors @ vectors.T, np.eye(order), atol=1e-12)
    assert residuals.max() < lanczos.LARGEST_RESIDUAL


# lambda_i lambda_j for i, j = 0, 1, 2 ... come as 00, 01 10, 11, 02 20, 12 21, ...: orders in and after each pair
@pytest.mark.parametrize("order", [2, 3, 4, 5, 6, 7, 8, 10, 11, 15, 40, 60])
def test_products_of_equal_factors_come_twice(order):
    grid = Grid(16, 16, 1 / 16, 1 / 16)
    expected = karhunen_loeve(covariance_of("gaussian", 2.0, 0.2), grid, order).eigenvalues / 4.0
    check_leading(lanczos.leading_modes(Plain(2.0, 0.2), grid, order), expected)


@pytest.mark.parametrize("request_", [{"order": 10}, {"order": 5}, {"share": 0.9}])
@pytest.mark.parametrize("cells", [(1 / 34, 1 / 34), (1 / 34, 2 / 34)])
def test_an_expansion_has_modes_that_come_twice(request_, cells):
    """Lengths in the ratio of the cells make equal factors on a mesh that is no square."""
    grid, lengths = Grid(34, 34, *cells), (0.1, 0.1 * cells[1] / cells[0])
    expected = karhunen_loeve(covariance_of("gaussian", 1.0, *lengths), grid, **request_)
    found = karhunen_loeve(Plain(1.0, *lengths), grid, **request_)
    np.testing.assert_allclose(found.eigenvalues, expected.eigenvalues, atol=1e-13 * expected.eigenvalues[0])


@pytest.mark.parametrize("times", [1, 2, 5, 24])
def test_eigenvalues_that_come_often(times, monkeypatch):
    """The matrix replaced by a diagonal one: 1, 1/2, 1/3 ... each so many times on 24 x 24 nodes."""
    diagonal = (1 / (1 + np.arange(576) // times)).reshape(24, 24)
    monkeypatch.setattr(lanczos, "covariance_operator", lambda *_: lambda field: diagonal * field)
    for order in (1, 7, 9, 40, 60):
        check_leading(lanczos.leading_modes(LAID, Grid(24, 24, 1.0, 1.0), order), diagonal.ravel())


def test_missing_modes_are_found(monkeypatch):
    """A first search that misses two of three equal modes: later ones, without the modes known, find them."""
    diagonal = np.concatenate(([3.0, 2.0, 2.0, 2.0], np.linspace(1.0, 0.0, 396))).reshape(20, 20)
    monkeypatch.setattr(lanczos, "covariance_operator", lambda *_: lambda field: diagonal * field)
    search = lanczos._search

    def careless(apply, grid, known, count):
        hidden = apply if len(known) else lambda field: np.where(np.isin(np.arange(400), (2, 3)), 0, apply(field).flat)
        return search(hidden, grid, known, count)

    monkeypatch.setattr(lanczos, "_search", careless)
    check_leading(lanczos.leading_modes(LAID, Grid(20, 20, 1.0, 1.0), 5), diagonal.ravel())


def test_independent_nodes():
    """The identity: every vector is a mode."""
    found = lanczos.leading_modes(covariance_of("exponential", 2.0, 1e-6), Grid(16, 15, 1.0, 1.0), 60)
    check_leading(found, np.ones(240))


@given(
    shape=st.tuples(st.integers(1, 13), st.integers(1, 13)),
    cell=st.sampled_from([1.0, 0.7]),
    kind=KINDS,
    lengths=st.tuples(LENGTHS, st.one_of(st.none(), LENGTHS)),
    lay=st.sampled_from([0.0, math.pi / 4, math.pi / 2, 0.4]),
    part=st.floats(0.0, 1.0),
)
@settings(max_examples=40, deadline=None, derandomize=True)
def test_eigenvalues_are_those_of_the_matrix(shape, cell, kind, lengths, lay, part):
    grid = Grid(*shape, 1.0, cell)
    order = 1 + int(part * max(grid.size // 4 - 1, 0))
    if kind == "self_affine":
        across = None if lengths[1] is None else 4 * lengths[1]
        covariance = self_affine(1.0, 0.7, 4 * lengths[0], 1.0, across, lay)
    else:
        covariance = covariance_of(kind, 1.0, *lengths, lay, smoothness=1.5 if kind == "matern" else None)
    expected = np.linalg.eigvalsh(matrix_of(covariance, grid))
    check_leading(lanczos.leading_modes(covariance, grid, order), expected)


@pytest.mark.usefixtures("always_lanczos")
@pytest.mark.parametrize(("shape", "length"), [((9, 8), 3.0), ((120, 1), 0.5)])
def test_lanczos_on_small_meshes_and_slow_spectra(shape, length):
    """Neighbours correlated by exp(-2) alone: the largest eigenvalues differ by little."""
    covariance, grid = covariance_of("exponential", 1.0, length), Grid(*shape, 1.0, 1.0)
    check_leading(lanczos.leading_modes(covariance, grid, 4), np.linalg.eigvalsh(matrix_of(covariance, grid)))


@pytest.mark.usefixtures("always_lanczos")
def test_the_same_bits_every_time():
    first, second = (lanczos.leading_modes(LAID, Grid(15, 12, 1.0, 1.0), 20) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_search_without_end_is_an_error(monkeypatch):
    monkeypatch.setattr(lanczos, "MOST_ROUNDS", 1)
    with pytest.raises(ConvergenceError, match="ask for fewer"):
        lanczos.leading_modes(LAID, Grid(20, 20, 1.0, 1.0), 30)


def test_a_covariance_that_is_not_finite_is_refused():
    class Broken(Plain):
        def __call__(self, x, y=0.0):
            return np.where(np.hypot(x, y) > 5.0, np.nan, 1.0)

    with pytest.raises(ParameterError, match="not finite"):
        lanczos.leading_modes(Broken(1.0, 1.0), Grid(9, 8, 1.0, 1.0), 3)
