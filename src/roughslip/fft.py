"""Fourier transforms of real fields along chosen axes, in place: those of ducc0, or of SciPy where it is not installed.

Both round differently, and SciPy takes up to twice as long on padded meshes. ducc0 as a package is under the GPL.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.fft

Axes = Sequence[int] | None


def _written(transform: np.ndarray, out: np.ndarray | None) -> np.ndarray:
    if out is None:
        return transform
    out[...] = transform
    return out


def _r2c(a: np.ndarray, axes: Axes = None, out: np.ndarray | None = None) -> np.ndarray:
    """sum a exp(-i k x), half of the last axis."""
    return _written(scipy.fft.rfftn(a, axes=axes), out)


def _c2c(a: np.ndarray, axes: Axes = None, forward: bool = True, out: np.ndarray | None = None) -> np.ndarray:
    """sum a exp(-+ i k x), backwards without the factor 1 / n."""
    transform = scipy.fft.fftn(a, axes=axes) if forward else scipy.fft.ifftn(a, axes=axes, norm="forward")
    return _written(transform, out)


def _c2r(
    a: np.ndarray, axes: Axes = None, lastsize: int = 0, inorm: int = 0, out: np.ndarray | None = None, **_: Any
) -> np.ndarray:
    """Back from r2c, with forward False, to a last axis of that size; inorm 2 divides by n."""
    axes = range(a.ndim) if axes is None else axes
    sizes = [*(a.shape[axis] for axis in axes[:-1]), lastsize]
    return _written(scipy.fft.irfftn(a, sizes, axes=axes, norm="backward" if inorm == 2 else "forward"), out)


def _good_size(n: int, real: bool = False) -> int:
    """The smallest length of at least n whose transform is fast."""
    return int(scipy.fft.next_fast_len(n, real))


try:
    from ducc0.fft import c2c, c2r, good_size, r2c
except ImportError:
    c2c, c2r, good_size, r2c = _c2c, _c2r, _good_size, _r2c

__all__ = ["c2c", "c2r", "good_size", "r2c"]
