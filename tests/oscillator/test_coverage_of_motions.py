"""Nightly: intervals hold the truth as often as they say, and theory agrees with long runs."""

import math

import numpy as np
import pytest
from scipy import stats

from roughslip.oscillator.cycles import count_difference, reattachment_statistics
from roughslip.oscillator.state_durations import durations, exponential_mean
from roughslip.oscillator.states import States, run_until_known
from roughslip.oscillator.trough_chain import durations_by_theory
from tests.oscillator.motions import machine

pytestmark = pytest.mark.slow


def renewal(rng, again, end, state):
    """States of exponential durations of means 20 and 5 up to an end; `again` : chance that sliding follows itself."""
    time, times, ended = 0.0, ([], []), ([], [])
    while time < end:
        last = time + (20.0, 5.0)[state] * rng.standard_exponential()
        times[state].append((time, min(last, end)))
        ended[state].append(last < end)
        time, state = last + 1e-9, int(state == 0 or rng.random() < again)
    return States(*(np.reshape(rows, (-1, 2)) for rows in times), *(np.array(rows, dtype=bool) for rows in ended))


def of_renewals(rng, again):
    """Runs of 60 begin half in either state, so that their own share is nearer to 1/2."""
    return durations([renewal(rng, again, 60.0, begin) for begin in (0, 1) for _ in range(20)], rng)


def clustered(rng):
    """Events of 40 runs, correlated by 0.3 within a run."""
    within = math.sqrt(0.7) * rng.standard_normal((40, 6))
    return (math.sqrt(0.3) * rng.standard_normal((40, 1)) + within).ravel(), np.repeat(np.arange(40), 6)


def counts(rng):
    """Rounded normal counts of mean 40 and deviation 5, normal to 1e-3."""
    found = count_difference(np.array([47]), np.rint(40 + 5 * rng.standard_normal((16, 1))))
    return found.low[0], found.high[0]


def censored(rng):
    """Durations of mean 40, cut off at 25."""
    drawn = 40 * rng.standard_exponential(20)
    return exponential_mean(np.minimum(drawn, 25).sum(), np.count_nonzero(drawn < 25))[1:]


def distance(rng):
    """Of exponential events from the normal of their moments: Phi(-1), at x = 0."""
    events, owner = clustered(rng)
    return reattachment_statistics(-np.log(stats.norm.sf(events)), owner, rng).distance_to_normal[1:]


ROWS = {  # an interval from a generator, the truth, least and largest rate at which it holds it
    "counts": (counts, 7.0, 0.95, 0.95),
    "censored durations": (censored, 40.0, 0.95, 0.985),
    "share of stick-slip": (lambda rng: of_renewals(rng, 0.0).share[1:], 20 / 25, 0.95, 0.95),
    "share where sliding follows itself": (lambda rng: of_renewals(rng, 0.5).share[1:], 20 / 30, 0.95, 0.95),
    "mean stick-slip": (lambda rng: of_renewals(rng, 0.0).stick_slip[1:], 20.0, 0.92, 1.0),
    "distance to the normal": (distance, stats.norm.cdf(-1), 0.92, 1.0),
}


@pytest.mark.parametrize("row", ROWS)
def test_intervals_cover_the_truth_as_often_as_they_say(row):
    """Within four standard errors of the trials."""
    interval, truth, least, most = ROWS[row]
    trials = 60 if row == "distance to the normal" else 300
    rates = [low <= truth <= high for low, high in (interval(np.random.default_rng([2, k])) for k in range(trials))]
    error = 4 * math.sqrt(0.95 * 0.05 / trials)
    assert least - error <= np.mean(rates) <= most + error


@pytest.mark.parametrize("deviation", [0.03, 0.05])
@pytest.mark.parametrize("damping", [0.28, 0.3, 0.32])
def test_theory_against_long_runs(damping, deviation):
    """Nearly Gaussian friction. Sliding within a factor of 2, stick-slip within one of 1.5."""
    made = machine(deviation, damping=damping)
    runs = [run_until_known(made, made.kept_path([1, run]), made.paths.spacing, 5000.0)[2] for run in range(4)]
    measured, expected = durations(runs, np.random.default_rng(3)), durations_by_theory(made)
    for name, factor in (("stick_slip", 1.5), ("sliding", 2.0)):
        _, low, high = getattr(measured, name)
        assert low / factor <= getattr(expected, name)[0] <= high * factor, name
