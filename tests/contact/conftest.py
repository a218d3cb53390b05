"""Random surfaces."""

from collections.abc import Callable

import numpy as np
import pytest


def correlated_heights(shape: tuple[int, int], length: float, seed: int) -> np.ndarray:
    """A periodic Gaussian field with covariance exp(-(r/length)^2), length in cells, by filtering white noise."""
    white = np.random.default_rng(seed).standard_normal(shape)
    k = np.hypot(*np.meshgrid(*(2 * np.pi * np.fft.fftfreq(n) for n in shape), indexing="ij"))
    heights = np.fft.ifft2(np.fft.fft2(white) * np.exp(-((k * length) ** 2) / 8)).real
    return heights / heights.std()


@pytest.fixture
def surface() -> Callable[[tuple[int, int], float, int], np.ndarray]:
    return correlated_heights
