"""Transforms without ducc0: equal to its own to rounding."""

import numpy as np
import pytest

from roughslip import fft

SHAPES = [((12, 10), (0, 1)), ((7, 9), (1,)), ((24,), None)]


@pytest.mark.parametrize(("shape", "axes"), SHAPES)
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_scipy_does_what_ducc0_does(shape, axes, precision):
    """To some rounding errors of the sum; complex ones in place, with and without 1 / n back."""
    ducc0 = pytest.importorskip("ducc0").fft
    a = np.random.default_rng(1).standard_normal(shape).astype(precision)
    close = {"rtol": 0, "atol": 20 * np.finfo(precision).eps * np.abs(a).sum()}
    wanted, ours = ducc0.r2c(a, axes=axes), fft._r2c(a, axes=axes)
    assert ours.dtype == wanted.dtype
    np.testing.assert_allclose(ours, wanted, **close)
    for forward in (True, False):
        one, other = wanted.copy(), wanted.copy()
        ducc0.c2c(one, axes=(0,), forward=forward, out=one)
        assert fft._c2c(other, axes=(0,), forward=forward, out=other) is other
        np.testing.assert_allclose(other, one, **close | {"atol": close["atol"] * len(a)})
    for inorm in (0, 2):
        options = {"axes": axes, "lastsize": shape[-1], "forward": False, "inorm": inorm}
        back = [c2r(wanted, **options) for c2r in (ducc0.c2r, fft._c2r)]
        np.testing.assert_allclose(back[1], back[0], **close | {"atol": close["atol"] * a.size})
    np.testing.assert_allclose(back[1], a, **close)
    assert [fft._good_size(n, True) for n in range(1, 400)] == [ducc0.good_size(n, True) for n in range(1, 400)]
