"""Products by Fourier transforms against products on the whole torus."""

import numpy as np
import pytest

from roughslip.contact import convolution
from roughslip.contact.convolution import Convolution, NarrowConvolution, fast_length
from roughslip.contact.influence import Influence
from roughslip.grid import Grid


@pytest.mark.parametrize("way", [Convolution, NarrowConvolution])
@pytest.mark.parametrize(
    ("shape", "torus"),
    [((5, 7), (5, 7)), ((4, 6), (8, 12)), ((6, 1), (12, 1)), ((150, 5), (299, 9)), ((30, 40), (60, 81))],
)
def test_product_with_an_even_circulant(way: type, shape: tuple[int, int], torus: tuple[int, int]) -> None:
    """Against numpy's transform of the whole torus; rounding is some log2(n) units of the largest term."""
    rng = np.random.default_rng(1)
    kernel = rng.random(torus)
    kernel += np.roll(kernel[::-1], 1, axis=0)
    kernel += np.roll(kernel[:, ::-1], 1, axis=1)
    symbol = np.fft.rfft2(kernel).real
    field, padded = rng.standard_normal(shape), np.zeros(torus)
    padded[: shape[0], : shape[1]] = field
    expected = np.fft.irfft2(symbol * np.fft.rfft2(padded), torus)[: shape[0], : shape[1]]
    result = np.full(shape, np.nan)
    product = way(symbol, shape, torus)
    for _ in range(2):  # scratch left from one product does not enter the next
        product(field, result)
        np.testing.assert_allclose(result, expected, rtol=0, atol=1e-14 * np.abs(symbol).max())


def test_parts_of_the_spectrum(monkeypatch: pytest.MonkeyPatch) -> None:
    """A large mesh is transformed in parts of its columns: the same arithmetic, the same bits."""
    grid, pressure = Grid(50, 60, 1.0, 1.0), np.random.default_rng(2).random((50, 60))
    whole = Influence(grid, 1.0).apply(pressure)
    monkeypatch.setattr(convolution, "MOST_COLUMNS", 10)
    monkeypatch.setattr(convolution, "PART", 7)
    np.testing.assert_allclose(Influence(grid, 1.0).apply(pressure), whole, rtol=1e-15, atol=0)


@pytest.mark.parametrize("nodes", [1, 2, 127, 1023, 4095])
def test_fast_length_holds_the_mesh(nodes: int) -> None:
    assert nodes <= fast_length(nodes) <= 1.1 * nodes + 1


@pytest.mark.parametrize(("columns", "way"), [(24, NarrowConvolution), (25, Convolution)])
def test_narrow_meshes_are_summed_across(columns: int, way: type) -> None:
    symbol = np.ones((16, columns + 1))
    assert type(convolution.convolution(symbol, (8, columns), (16, 2 * columns))) is way
