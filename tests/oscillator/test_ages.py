"""Durations with two ages: means by hand, limits against exact ones, and nightly the coverage of intervals."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.oscillator.ages import mean_of_ages
from roughslip.oscillator.states import ONE_RATE, States, durations


def intervals(spells, settled=ONE_RATE):
    drawn = mean_of_ages(np.array(spells, dtype=float), settled, np.random.default_rng(1))
    return [(value, np.sort(low)[9], np.sort(high)[389]) for value, low, high in drawn]


def exact(time, ends):
    """Twice the time over the mean is chi-square with twice the ends, and two more, degrees of freedom (Cox)."""
    value, high = (time / ends, 2 * time / stats.chi2.ppf(0.025, 2 * ends)) if ends else (math.inf, math.inf)
    return value, 2 * time / stats.chi2.ppf(0.975, 2 * ends + 2), high


def test_the_mean_and_the_births_by_hand():
    """S falls to 3/4 at 2 and to 3/8 at 4. Past the ages 5 and 2 are 1 and 7 of time, and one end that is no birth."""
    spells = [[1, 2, 1, 1], [1, 3, 0, 0], [1, 4, 1, 0], [1, 6, 0, 0], [0, 9, 1, 0], [0, 1, 1, 1]]
    mean, births = intervals(spells, (5.0, 2.0))
    assert mean[0] == pytest.approx(2 + 3 / 4 * 2 + 3 / 8 * 1 + 3 / 8 * (1 + 7) / 1)
    assert births[0] == pytest.approx(1 / 4 / mean[0])


def test_one_rate_has_the_exact_limits_and_ends_that_bunch_count_as_fewer():
    """35 durations of 0.1 and 5 of 7.3 have 5.67 times the variance of one rate."""
    for ends in (0, 1, 2, 20):
        assert intervals([[0, 1, i < ends, 0] for i in range(30)])[0] == pytest.approx(exact(30, ends), rel=1e-9)
    few = 40 / (35 / 40 * 0.9**2 + 5 / 40 * 6.3**2)
    assert intervals([[0, x, 1, 1] for x in [0.1] * 35 + [7.3] * 5])[0] == pytest.approx(exact(few, few), rel=1e-9)


def test_limits_hold_the_value_however_few_spells_there_are():
    """Births of starts alone; the longest spell cut off; a spell far shorter than the age of settling."""
    few = (
        [[7, 8, 1, 0], [0, 5.6, 1, 1], [0, 0.6, 1, 1], [26, 31.6, 1, 0]],
        [[0, 9, 1, 1], [9, 15, 0, 0]],
        [[0, 6, 0, 0], [9, 9 + 1e-9, 0, 0]],
    )
    for spells, settled in zip(few, ((40.0, 0.0), (40.0, math.inf), (0.5, 0.5)), strict=True):
        runs = [
            States(
                np.reshape([[end, end + 1.0]] * born, (-1, 2)),
                np.array([[begin, end]]),
                np.ones(born, bool),
                np.array([ended], bool),
            )
            for begin, end, ended, born in spells
        ]
        found = durations(runs, np.random.default_rng(1), settled)
        for value, low, high in (found.sliding, found.birth):
            assert low <= value <= high


def renewal(rng, slides, length, slow, early, again):
    """States of a run: stick-slip lasts 20 in the mean, sliding `slow`, and 10 for a part `early`.

    slides : whether the run begins in sliding, then old; again : chance that sliding follows itself
    """
    time, is_old, rows = 0.5 * (not slides), slides, ([], [])
    while time < length:
        mean = 20.0 if not slides else slow if is_old or rng.random() >= early else 10.0
        last = time + mean * rng.standard_exponential()
        rows[slides].append((time, min(last, length), last < length))
        time, slides, is_old = last + 1e-9, not slides or rng.random() < again, False
    (*stuck, stuck_ended), (*slid, slid_ended) = (np.reshape(row, (-1, 3)).T for row in rows)
    return States(np.transpose(stuck), np.transpose(slid), stuck_ended > 0, slid_ended > 0)


def of_renewals(seed, runs, *case):
    rng = np.random.default_rng([2, seed])
    return durations([renewal(rng, k % 2 == 1, *case) for k in range(runs)], rng, (100.0, 100.0))


def test_runs_shorter_than_old_sliding_bound_its_mean_from_below():
    """Half of all sliding lasts 1e5. 30 runs pass the age of settling by 300, and their sliding does not end."""
    sliding = of_renewals(0, 60, 400.0, 1e5, 0.5, 0.5).sliding
    assert (sliding[0], sliding[2]) == (math.inf, math.inf)
    assert 500.0 < sliding[1] < 0.5e5


@pytest.mark.nightly
@pytest.mark.parametrize(("runs", "again"), [(10, 0.5), (144, 0.5), (144, 0.0)])
@pytest.mark.parametrize(
    ("length", "slow", "early"),
    [(60.0, 5.0, 0.0), (400.0, 1e3, 0.0), *((x, 1e5, part) for x in (100.0, 400.0, 4e3) for part in (0.1, 0.5, 0.9))],
)
def test_intervals_cover_the_truth_as_often_as_they_say(length, slow, early, runs, again):
    """At least 0.95 of the trials, within four standard errors."""
    sliding, held = 10 * early + slow * (1 - early), []
    truth = np.array([20, sliding, (1 - again) / sliding, 1 / (1 + sliding / (1 - again) / 20)])
    for trial in range(200):
        found = of_renewals(trial, runs, length, slow, early, again)
        _, low, high = np.transpose([found.stick_slip, found.sliding, found.birth, found.share])
        held.append(~((low > truth) | (truth > high)))
    assert np.min(np.mean(held, axis=0)) >= 0.95 - 4 * math.sqrt(0.95 * 0.05 / 200)
