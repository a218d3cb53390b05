"""Karhunen-Loeve expansion: against matrices, the continuous problem and the shares of the variance.

Lanczos must miss no mode, however often its eigenvalue comes.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from roughslip.errors import ConvergenceError
from roughslip.grid import Grid
from roughslip.surface import modes as kl
from roughslip.surface.models import covariance_of


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


# lambda_i lambda_j for i, j = 0, 1, 2 ... come as 00, 01 10, 11, 02 20, 12 21, ...: orders in and after each pair
def test_missing_modes_are_found(monkeypatch):
    """A first search that misses two of three equal modes: later ones, without the modes known, find them."""
    diagonal = np.concatenate(([3.0, 2.0, 2.0, 2.0], np.linspace(1.0, 0.0, 396))).reshape(20, 20)
    monkeypatch.setattr(kl, "covariance_operator", lambda *_: lambda field: diagonal * field)
    search = kl._search

    def careless(apply, grid, known, count):
        hidden = apply if len(known) else lambda field: np.where(np.isin(np.arange(400), (2, 3)), 0, apply(field).flat)
        return search(hidden, grid, known, count)

    monkeypatch.setattr(kl, "_search", careless)
    values, vectors = kl.leading_modes(covariance_of("exponential", 1.5, 4.0), Grid(20, 20, 1.0, 1.0), 5)
    np.testing.assert_allclose(values, np.sort(diagonal.ravel())[::-1][:5], atol=1e-12)
    np.testing.assert_allclose(vectors @ vectors.T, np.eye(5), atol=1e-12)


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


def test_inaccurate_modes_are_an_error(monkeypatch):
    monkeypatch.setattr(kl, "LARGEST_RESIDUAL", 0.0)
    with pytest.raises(ConvergenceError, match="inaccurate") as caught:
        kl.leading_modes(covariance_of("exponential", 1.0, 5.0), Grid(40, 40, 1.0, 1.0), 5)
    assert 0.0 < caught.value.residual < 1e-11


def test_heights_are_sums_of_modes():
    modes, xi = (
        np.random.default_rng(1).standard_normal((20, 40, 30)),
        np.random.default_rng(2).standard_normal((3, 20)),
    )
    np.testing.assert_allclose(kl.heights(modes, xi), np.einsum("km,mxy->kxy", xi, modes), atol=1e-13)
