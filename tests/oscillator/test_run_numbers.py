"""Runs and nodes for an accuracy of mean counts: closed forms, and the numbers that a known scatter takes."""

import math

import numpy as np
import pytest

from roughslip.limits import MOST_RUNS
from roughslip.oscillator.run_numbers import NODES_SHARE, SCATTER_FACTOR, RunErrors, missing_scatter
from roughslip.probability.estimate import variance_margin

ERRORS = RunErrors(np.array([0.5, 14.0]), 30.0, 24)
WITHIN = (8, MOST_RUNS)


def test_scatter_that_a_path_misses_between_its_nodes():
    """In proportion to the spacing, and less than half of what a straight line misses, whose mean variance is
    (2 + rho) / 3."""
    coarse, fine = missing_scatter(32), missing_scatter(64)
    assert coarse / fine == pytest.approx(2, abs=0.05)
    assert 0.0 < fine < 0.5 * (1 - np.exp(-1 / 64)) / 6


def test_a_pilot_shows_how_counts_follow_the_scatter_of_friction():
    """Counts 40 + 6 log(std) + 2 n at one damping, n normal and the same for both scatters: slope 6, deviation 2."""
    noise = 2.0 * np.random.default_rng(5).standard_normal((400, 1))
    change = 6.0 * math.log(SCATTER_FACTOR)
    errors = RunErrors.of_pilot(np.stack((40.0 - change + noise, 40.0 + change + noise)))
    assert errors.slope == pytest.approx(6.0, rel=1e-12)
    assert errors.deviation == pytest.approx(2.0, rel=4 / math.sqrt(800))
    assert errors.pilot == 400
    # of two dampings: opposite slopes that scatter, of which the steeper one counts with two standard errors
    rng = np.random.default_rng(6)
    low, high = rng.standard_normal((2, 25, 2)) + np.array([[[0.0, 0.0]], [[1.0, -3.0]]])
    slopes = (high - low) / (2 * math.log(SCATTER_FACTOR))
    bound = -slopes[:, 1].mean() + 2 * slopes[:, 1].std(ddof=1) / 5
    of_pilot = RunErrors.of_pilot(np.stack((low, 2.0 * high)))
    assert RunErrors.of_pilot(np.stack((low, high))).slope == pytest.approx(bound)
    variances = (low.var(axis=0, ddof=1) + 4.0 * high.var(axis=0, ddof=1)) / 2.0
    np.testing.assert_allclose(of_pilot.deviation, np.sqrt(variances))


def test_runs_that_a_half_width_takes():
    """Student's interval of the allotted runs is as narrow as asked, and that of 3 % fewer is not."""
    for asked in (0.7, 1.1, 2.0, 3.1):
        runs = ERRORS.runs_for(asked)
        assert ERRORS.from_runs(runs) <= asked < ERRORS.from_runs(int(runs / 1.03))
    assert ERRORS.from_runs(10_000, safe=False) == pytest.approx(1.96 * 14 / 100, rel=1e-3)
    margin = ERRORS.from_runs(50) / ERRORS.from_runs(50, safe=False)
    assert margin == pytest.approx(math.sqrt(variance_margin(24)))


def test_the_fewest_nodes_take_their_share_and_runs_the_rest():
    nodes, runs = ERRORS.numbers(2.0, None, None, WITHIN)
    assert 30.0 * missing_scatter(nodes) <= NODES_SHARE * 2.0 < 30.0 * missing_scatter(nodes // 2)
    assert runs == ERRORS.runs_for(2.0 - 30.0 * missing_scatter(nodes))
    assert ERRORS.numbers(2.0, 4, None, WITHIN) == (4, ERRORS.runs_for(2.0 - ERRORS.from_nodes(4)))
    assert ERRORS.numbers(2.0, None, 9, WITHIN) == (nodes, 9)
    assert ERRORS.numbers(2.0, None, None, (8, runs)) == (nodes, runs)
    assert ERRORS.numbers(2.0, None, None, (8, runs - 1)) is None
    assert ERRORS.numbers(2.0, None, None, (2 * runs, MOST_RUNS)) == (nodes, 2 * runs)
