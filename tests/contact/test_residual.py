import numpy as np
import pytest

from roughslip.contact.residual import relative_residual


def test_each_way_of_missing_the_conditions() -> None:
    """Five nodes: pressed across a small gap, pressed across a large gap, penetration, tension, and a good one."""
    diagonal = 0.5
    gap = np.array([[0.1, 3.0, -0.2, 1.0, 0.0]])
    pressure = np.array([[4.0, 0.6, 1.0, -0.8, 7.0]])
    unmet = np.array([0.1, 0.3, -0.2, -0.4, 0.0])
    interference = np.array([[3.0, -9.0, 4.0, -1.0, 0.0]])  # only what is positive counts: 5
    expected = np.linalg.norm(unmet) / 5
    assert relative_residual(gap, pressure, diagonal, interference) == pytest.approx(expected, rel=1e-14)
