"""Random surfaces and the contact conditions."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from roughslip.contact.solve import ContactSolution


def correlated_heights(shape: tuple[int, int], length: float, seed: int) -> np.ndarray:
    """A periodic Gaussian field with covariance exp(-(r/length)^2), length in cells, by filtering white noise."""
    white = np.random.default_rng(seed).standard_normal(shape)
    k = np.hypot(*np.meshgrid(*(2 * np.pi * np.fft.fftfreq(n) for n in shape), indexing="ij"))
    heights = np.fft.ifft2(np.fft.fft2(white) * np.exp(-((k * length) ** 2) / 8)).real
    return heights / heights.std()


@pytest.fixture
def surface() -> Callable[[tuple[int, int], float, int], np.ndarray]:
    return correlated_heights


def assert_contact_conditions(
    solution: ContactSolution, displacement: np.ndarray, interference: np.ndarray, hardness: float = math.inf
) -> None:
    """All contact conditions, to the residual that the solution claims."""
    allowed = solution.residual * np.linalg.norm(np.maximum(interference, 0)) + 1e-14 * np.abs(interference).max()
    p, gap, plastic = solution.pressure, solution.gap, solution.plastic_displacement
    assert np.all((p >= 0) & (p <= hardness))
    assert np.all(gap >= -allowed)
    assert np.all(plastic >= 0)
    assert not np.any(plastic[p < hardness])
    np.testing.assert_allclose(gap[p > 0], 0, atol=allowed)
    np.testing.assert_allclose(gap, displacement - interference + plastic, rtol=0, atol=allowed)


@pytest.fixture(scope="session")
def contact_conditions() -> Callable[..., None]:
    return assert_contact_conditions
