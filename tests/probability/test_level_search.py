"""Crossings of a level by paths with known changes: order statistics, coverage, and what the search cannot find."""

import math

import numpy as np
import pytest
from scipy.special import bdtr, ndtr, ndtri

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.probability.level_search import ACCURACY, COARSE, LevelSearch, central_counts

PATHS = 100


def search_of(changes, start=0.1, low=1e-3, high=10.0, hints=()):
    """Paths that show the event up to a value of their own."""
    return LevelSearch(lambda x, paths: changes[paths.start : paths.stop] > x, start, low, high, changes > start, hints)


@pytest.mark.parametrize("level", [0.05, 0.95])
def test_counts_hold_95_percent_and_no_smaller_central_ones_do(level):
    least, largest = central_counts(PATHS, level)
    outside = bdtr(least - 1, PATHS, level), 1 - bdtr(largest, PATHS, level)
    assert max(outside) <= 0.025
    assert bdtr(least, PATHS, level) > 0.025
    assert 1 - bdtr(largest - 1, PATHS, level) > 0.025


def test_intervals_cover_the_quantile_of_a_known_distribution_as_often_as_its_order_statistics():
    """Lognormal changes of 10 %. Of 200 ensembles 0.983 are expected to cover, with a standard error of 0.009. The
    value is that of the order statistic, as accurate as promised."""
    generator = np.random.default_rng(1)
    covered = []
    for _ in range(200):
        changes = np.exp(generator.normal(0.3, 0.1, PATHS))
        search = search_of(changes)
        for level in (0.05, 0.95):
            found = search.crossing(level, upwards=True)
            covered.append(found.low <= math.exp(0.3 + 0.1 * ndtri(1 - level)) <= found.high)
            near = np.sort(changes)[::-1][round(level * PATHS) - 1 : round(level * PATHS) + 1]
            assert near[1] * (1 - COARSE) <= found.value <= near[0] * (1 + COARSE)
        assert search.crossing(0.05, upwards=False) is None
    assert np.mean(covered) >= 0.983 - 3 * 0.009


@pytest.mark.parametrize("level", [0.05, 0.4, 0.95])
def test_the_reciprocal_of_the_parameter_has_the_reciprocal_crossing(level):
    """A search downwards is one upwards of 1 / x."""
    changes = np.exp(np.random.default_rng(2).normal(0.3, 0.4, PATHS))
    one = search_of(changes).crossing(level, upwards=True)
    down = LevelSearch(lambda x, paths: changes[paths.start : paths.stop] * x > 1.0, 10.0, 0.1, 1e3, changes > 0.1)
    other = down.crossing(level, upwards=False)
    assert (1 / other.high, 1 / other.value, 1 / other.low) == pytest.approx((one.low, one.value, one.high), rel=1e-9)


def test_ends_far_from_the_value_take_few_trials():
    """Half of the distance from it, where 0.1 % would take another 1200 of 100 paths."""
    trials = []
    for seed in range(5):
        search = search_of(np.exp(np.random.default_rng(seed).normal(0.3, 0.4, PATHS)))
        search.crossing(0.05, upwards=True)
        trials.append(search.trials)
    assert np.mean(trials) < 1600


def test_values_tried_before_serve_first():
    """A level near another one is crossed between values that the first search has tried: two thirds of its trials,
    where it would take more than all again."""
    search = search_of(np.exp(np.random.default_rng(1).normal(0.3, 0.4, PATHS)))
    search.crossing(0.05, upwards=True)
    before = search.trials
    search.crossing(0.06, upwards=True)
    assert search.trials - before < 0.8 * before


@pytest.mark.parametrize(("off", "share"), [(0.0, 0.5), (2e-3, 0.7), (0.3, 1.3)])
def test_a_hint_saves_trials_where_the_crossing_is_near_it(off, share):
    """Changes that scatter by 0.01 % about 1.3: the same crossings, with less trials the nearer the hint is."""
    changes = 1.3 * np.exp(np.random.default_rng(3).normal(0.0, 1e-4, PATHS))
    plain, hinted = search_of(changes), search_of(changes, hints=[1.3 * math.exp(off)])
    for level in (0.05, 0.95):
        value = plain.crossing(level, upwards=True).value
        assert hinted.crossing(level, upwards=True).value == pytest.approx(value, rel=2 * ACCURACY)
    assert hinted.trials < share * plain.trials


def test_paths_that_change_to_and_fro_are_covered_too():
    """Each path is drawn anew at every value, with the probability of a known curve: none has a change of its own."""
    covered = []
    for seed in range(100):

        def occurs(x, paths, seed=seed):
            entropy = [seed, int(np.float64(x).view(np.uint64))]
            drawn = np.random.default_rng(entropy).random(PATHS)[paths.start : paths.stop]
            return drawn < ndtr(-math.log(x) / 0.1)

        search = LevelSearch(occurs, 0.1, 1e-3, 10.0, np.ones(PATHS, dtype=bool))
        found = search.crossing(0.05, upwards=True)
        covered.append(found.low <= math.exp(0.1 * ndtri(0.95)) <= found.high)
    assert np.mean(covered) >= 0.9  # the search meets many values, and its end is the first of them outside


def test_paths_that_change_together_have_one_crossing_at_every_level():
    """From both sides, and upwards where the event begins there."""
    for start in (0.5, 7.0):
        search = search_of(np.full(PATHS, 2.0), start=start)
        for level in (0.05, 0.95):
            found = search.crossing(level, upwards=start < 2)
            assert (found.low, found.value, found.high) == pytest.approx((2, 2, 2), rel=2 * ACCURACY)
            assert search.crossing(level, upwards=start > 2) is None
    assert search.searched == (1e-3, 10.0)


def test_an_interval_that_reaches_the_end_of_the_search_is_open():
    """The level 0.05 is crossed at 9.9, where six of the paths are left; five stay to the end."""
    changes = np.append(np.full(95, 9.9), np.full(5, np.inf))
    found = search_of(changes).crossing(0.05, upwards=True)
    assert found.value == pytest.approx(9.9, rel=COARSE)
    assert found.high is None
    assert found.low == pytest.approx(9.9, rel=COARSE)


def test_a_value_that_cannot_be_tried_ends_the_search():
    def occurs(x, paths):
        if x > 3:
            raise ConvergenceError("too stiff", residual=1.0, work=1)
        return np.ones(len(paths), dtype=bool)

    search = LevelSearch(occurs, 1.0, 0.01, 100.0, np.ones(PATHS, dtype=bool))
    assert search.crossing(0.05, upwards=True) is None
    assert search.searched == pytest.approx((0.01, 100 ** (1 / 8)))


def test_too_few_paths_and_a_start_outside_are_refused():
    with pytest.raises(ParameterError, match=r"^71 paths do not bound a value of the probability 0.05: take more"):
        search_of(np.ones(71)).crossing(0.05, upwards=True)
    search_of(np.ones(73)).crossing(0.05, upwards=True)
    with pytest.raises(ParameterError, match=r"^a search goes from a positive start outwards, not from 20"):
        search_of(np.ones(PATHS), start=20.0)
