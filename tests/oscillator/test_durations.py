"""Durations of both states: by hand, against long runs, and in the limits that theory has of its own.

Censored durations against textbook values, intervals that cover as often as they say.
"""

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from roughslip.oscillator.limits import hopf_damping
from roughslip.oscillator.state_durations import durations, exponential_mean, states_of_answer, stationary_share
from roughslip.oscillator.states import States
from roughslip.oscillator.trough_chain import durations_by_theory, durations_of, trough_map
from tests.oscillator.motions import LAW, STUDY, machine

LENGTH = 3e-4
LONG = (0.28, 1e-4, 0.0129, 1.5e5), (0.29, 3e-4, 0.006, 3.6e5), (0.29, 3e-4, 0.0056, 3.9e6)


def theory(damping, deviation, length=LENGTH):
    return durations_of(trough_map(machine(deviation, length, damping=damping)))


def states_in_turn(stick_slip, sliding):
    """States of spells (duration, ended), in turn from 0, stick-slip first."""
    rows, time = ([], []), 0.0
    for pair in itertools.zip_longest(stick_slip, sliding):
        for kind, spell in zip(rows, pair, strict=True):
            if spell is not None:
                kind.append((time, time + spell[0]))
                time += spell[0]
    rows = [np.reshape(kind, (-1, 2)) for kind in rows]
    ended = [np.array([end for _, end in part], dtype=bool) for part in (stick_slip, sliding)]
    return States(*rows, *ended)


def test_means_of_runs_by_hand():
    """Time over ends: 30 / 2 and 60 / 2. Of the latter the mass slides again after one: a birth in 60."""
    slides_again = States(*(np.reshape(x, (-1, 2)) for x in ([], [(0, 10), (12, 22)])), *map(np.array, ([], [1, 0])))
    runs = [states_in_turn([(10, True), (5, True)], [(40, True)]), states_in_turn([(15, False)], []), slides_again]
    times = durations(runs, np.random.default_rng(1))
    assert (times.stick_slip[0], times.sliding[0], times.birth[0]) == pytest.approx((15, 30, 1 / 60))
    assert times.share[0] == pytest.approx((1 / 60) / (1 / 60 + 1 / 15))
    assert times.death[0] == pytest.approx(1 / 15)
    assert times.death[1] == pytest.approx(1 / times.stick_slip[2])
    for values in (times.stick_slip, times.sliding, times.birth, times.share):
        assert values[1] < values[0] < values[2]


def test_a_state_that_was_never_seen_is_unknown_and_json_has_null():
    times = durations([states_in_turn([(40, False)], [])], np.random.default_rng(1))
    assert times.share == pytest.approx([1.0, math.nan, 1.0], nan_ok=True)
    assert np.isnan(times.sliding).all()
    assert (times.stick_slip[0], times.stick_slip[2]) == (math.inf, math.inf)
    answer = states_of_answer(times, times, 2 * math.pi)
    assert answer["mean_stick_slip_s"] == [None, pytest.approx(times.stick_slip[1]), None]
    assert answer["mean_sliding_s"] == [None] * 3
    assert answer["by_theory"] == {"share_of_time": 1.0, "death_per_s": 0.0} | dict.fromkeys(
        ("mean_stick_slip_s", "mean_sliding_s", "birth_per_s")
    )


@pytest.mark.parametrize(
    ("death", "birth", "share"),
    [
        ((1 / 30, 1 / 30, 1 / 30), (0.1, 0.1, 0.1), (0.75, 0.75, 0.75)),
        ((0.1, 0.05, 0.2), (0.1, 0.1, 0.1), (0.5, 1 / 3, 2 / 3)),  # one exact rate: the other's interval
        ((0.1, 0.05, 0.2), (0.1, 0.05, 0.2), (0.5, 1 / (1 + 2**2**0.5), 1 / (1 + 0.5**2**0.5))),
        ((0.0, 0.0, 1 / 60), (10.0, 5.0, 20.0), (1.0, 5 / (5 + 1 / 60), 1.0)),
        ((2.0, 1.4, 2.5), (0.0, 0.0, 1 / 70), (0.0, 0.0, 1 / 70 / (1 / 70 + 1.4))),
        ((0.0, 0.0, 1 / 60), (0.0, 0.0, 1 / 70), (math.nan, 0.0, 1.0)),
    ],
)
def test_the_share_of_the_long_run_and_its_interval_follow_from_both_rates(death, birth, share):
    stationary = stationary_share(np.array(death), np.array(birth))
    assert stationary == pytest.approx(np.array(share), rel=1e-12, nan_ok=True)


@pytest.mark.parametrize(("damping", "stick_slip", "sliding"), [(0.3, math.inf, math.nan), (0.5, math.nan, math.inf)])
def test_theory_where_a_state_lasts_for_ever(damping, stick_slip, sliding):
    """Scatter of 1e-4: well below the existence limit a cycle never fails, far above it no slip sticks. So far from it
    the chain is left out, with the same result."""
    without_chain = durations_by_theory(machine(1e-4, damping=damping))
    for found in (theory(damping, 1e-4), without_chain):
        assert (found.stick_slip[0], found.sliding[0]) == pytest.approx((stick_slip, sliding), nan_ok=True)


@pytest.mark.slow
def test_without_friction_s_drift_a_map_is_that_of_the_flow():
    """At the Hopf damping small loops neither grow nor shrink, and beyond it they shrink by exp(-2 pi d)."""
    for excess in (0.0, 0.02):
        troughs = trough_map(machine(1e-9, damping=hopf_damping(STUDY, LAW) + excess))
        first, second = troughs.following[1:3] / troughs.start[:2]
        assert 2 * first - second == pytest.approx(math.exp(-2 * math.pi * excess), abs=0.03)


@pytest.mark.slow
def test_scatter_of_a_small_loop_is_that_of_a_linear_oscillator():
    """White friction: each quadrature gains pi S in a loop, S = 2 (F sigma / V)^2 L / V, short of the correlation."""
    troughs = trough_map(machine(0.001, 3e-5))
    white = 0.001 * STUDY.F / STUDY.V * math.sqrt(2 * math.pi * 3e-5 / STUDY.V)
    assert troughs.deviation[1] == pytest.approx(white, rel=0.05)


@pytest.mark.slow
def test_the_logarithm_of_a_lifetime_is_a_line_against_the_inverse_variance():
    """Kramers: at 0.28, of lifetimes from 1e3 to 1e8 natural periods; the prefactor, a power of sigma, is taken off."""
    deviation = np.array([0.018, 0.0148, 0.0125, 0.0108, 0.0095])
    times = np.array([theory(0.28, one, 1e-4).stick_slip[0] for one in deviation])
    assert 1e3 < times[0] < times[-1] < 1e9
    x, y = deviation**-2, np.log(times) + np.log(deviation)
    slope, offset = np.polyfit(x, y, 1)
    assert slope > 0
    assert np.max(np.abs(slope * x + offset - y)) < 0.03 * np.ptp(y)


@pytest.mark.parametrize(
    ("damping", "length", "deviation", "splitting"),
    [(0.28, 3e-4, 0.01, 1.2e4), *(pytest.param(*row, marks=pytest.mark.slow) for row in LONG)],
)
def test_long_durations_of_theory_are_those_of_multilevel_splitting(damping, length, deviation, splitting):
    """By F. Cérou & A. Guyader (Stoch. Anal. Appl. 25 (2007) 417), of a thousand slips; within a factor of 3."""
    assert splitting / 3 < theory(damping, deviation, length).stick_slip[0] < 3 * splitting


def test_the_mean_of_exponential_durations_by_hand():
    """Two ends in 30 periods; chi-square with 6 and 4 degrees of freedom."""
    expected = [15, 60 / stats.chi2.ppf(0.975, 6), 60 / stats.chi2.ppf(0.025, 4)]
    assert exponential_mean(30.0, 2) == pytest.approx(expected, rel=1e-12)
    value, low, high = exponential_mean(30.0, 0)
    assert (value, high) == (math.inf, math.inf)
    assert low == pytest.approx(30 / -math.log(0.025), rel=1e-12)  # P(no end) = 2.5 % there
