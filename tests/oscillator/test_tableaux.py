"""Tableaux of the Runge-Kutta pairs."""

import numpy as np
from scipy.integrate import DOP853

from roughslip.oscillator import tableaux


def test_dormand_and_prince_are_those_of_scipy_to_the_last_bit():
    for row, expected in zip(tableaux.ROWS, DOP853.A[1:], strict=True):
        np.testing.assert_array_equal(row, expected[expected != 0])
    np.testing.assert_array_equal(tableaux.NODES, DOP853.C)
    for weights, expected in (("WEIGHTS", DOP853.B), ("ERROR5", DOP853.E5), ("ERROR3", DOP853.E3)):
        np.testing.assert_array_equal(getattr(tableaux, weights), expected[[0, *range(5, 12)]])


def test_fehlberg_fulfils_the_conditions_of_its_orders():
    """Quadrature of powers up to order 5 and 4; rows sum to their nodes. The second stage has no weight."""
    nodes = np.array(tableaux.FEHLBERG_NODES)
    np.testing.assert_allclose([sum(row) for row in tableaux.FEHLBERG_ROWS], nodes[1:], atol=1e-15)
    used, fifth = nodes[[0, 2, 3, 4, 5]], np.array(tableaux.FEHLBERG_WEIGHTS)
    fourth = fifth - tableaux.FEHLBERG_ERROR
    for power in range(5):
        assert abs(fifth @ used**power - 1 / (power + 1)) < 1e-15
    for power in range(4):
        assert abs(fourth @ used**power - 1 / (power + 1)) < 1e-15
    assert abs(fourth @ used**4 - 1 / 5) > 1e-4
