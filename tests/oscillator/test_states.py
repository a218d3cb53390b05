"""The two states: spells by hand, the same word on the cycle from all functions, numbers that no duration changes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.oscillator.answer_runs import whole_cycles
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import CoulombLaw, StribeckLaw
from roughslip.oscillator.limits import departure_point, existence_limit, hopf_damping, limit_cycle, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import Motion, Trajectory, simulate
from roughslip.oscillator.states import (
    ONE_RATE,
    States,
    durations,
    longest_slip,
    run_until_known,
    settling_ages,
    states_of,
    states_of_answer,
)
from roughslip.oscillator.table_law import TableLaw
from tests.oscillator.motions import LAW, STUDY, machine
from tests.properties.campaign import Trial
from tests.properties.machines import draw_law

TURN = 2.0 * math.pi
LONG = 3.0  # natural periods
# Friction falls from 0.4 at rest to 0.1 at 1 cm/s and rises again: a slip of twelve natural periods at 5 mm/s
LUBRICATED = TableLaw((0.0, 0.01, 0.1, 1.0), (0.4, 0.1, 0.4, 1.0))
SLOW = Oscillator(1.0, 316.0, 0.17, 0.005, 2500.0)


def motion(periods, *events, micro=()):
    """A run of so many natural periods with events (kind, natural period); reattachments at `micro` end micro-slips."""
    kinds, times = (
        (np.array(column) for column in zip(*events, strict=True)) if events else (np.empty(0, int), np.empty(0))
    )
    backwards = (kinds == REATTACHMENT) & ~np.isin(times, micro)
    nothing = np.zeros(len(kinds))
    return Motion(kinds, TURN * times, nothing, nothing, backwards, TURN * periods, 0.0, 0.0, 0)


# Two cycles, sliding from 3 to 10, a cycle that crosses the belt's velocity, sliding from 13 to the end
RUN = motion(
    20,
    *((DEPARTURE, 0.5), (REATTACHMENT, 1.5), (DEPARTURE, 2), (REATTACHMENT, 3), (DEPARTURE, 3), (REATTACHMENT, 10)),
    *((DEPARTURE, 11), (CROSSING, 11.2), (REATTACHMENT, 12), (DEPARTURE, 13)),
)


def test_spells_of_a_run_by_hand():
    """The first loading, to 0.5, and the stick after sliding, from 10 to 11, belong to no state."""
    states = states_of(RUN, LONG)
    np.testing.assert_allclose(states.stick_slip, [[0.5, 3], [11, 13]])
    np.testing.assert_allclose(states.sliding, [[3, 10], [13, 20]])
    assert (list(states.stick_slip_ended), list(states.sliding_ended)) == ([True, True], [True, False])
    assert states.share() == pytest.approx(4.5 / 18.5)
    assert states.share(5, 12) == pytest.approx(1 / 6)
    times = np.arange(0.005, 20, 0.01)
    assert np.mean([states.is_stick_slip(time) for time in times]) == pytest.approx(4.5 / 20, abs=1e-3)


SLIPS = (DEPARTURE, 1), (REATTACHMENT, 2), (DEPARTURE, 3), (REATTACHMENT, 4)


@pytest.mark.parametrize(
    ("run", "stick_slip", "sliding"),
    [
        (motion(10), [], []),  # sticks all along: the first loading
        (motion(10, (DEPARTURE, 9.0)), [], []),  # a slip that the end cuts off early
        (motion(10, (DEPARTURE, 1), (REATTACHMENT, 2), (DEPARTURE, 8)), [[1, 2]], []),
        # micro-slips count among cycles, not by themselves
        (motion(10, *SLIPS, (DEPARTURE, 5), micro=(2,)), [[1, 5]], [[5, 10]]),
    ],
)
def test_what_belongs_to_neither_state(run, stick_slip, sliding):
    states = states_of(run, LONG)
    np.testing.assert_allclose(states.stick_slip, np.reshape(stick_slip, (-1, 2)))
    np.testing.assert_allclose(states.sliding, np.reshape(sliding, (-1, 2)))


def test_a_slip_of_many_periods_is_a_cycle():
    """Radau on the equation of slip, in units of F and V."""
    force, velocity, omega = SLOW.F, SLOW.V, SLOW.natural_frequency_rad_per_s
    curve = PchipInterpolator(LUBRICATED.speeds_m_per_s, LUBRICATED.values)

    def slip(_, y):
        friction = curve(omega * velocity * (1 - y[1]))
        return [y[1] * velocity / force, (-2 * 0.17 * velocity * y[1] - force * y[0] + force * friction) / velocity]

    def sticks(_, y):
        return y[1] - 1 + 1e-9

    sticks.terminal, sticks.direction = True, 1
    start = [0.4 - 2 * 0.17 * velocity / force, 1 - 1e-6]
    radau = solve_ivp(slip, (0, 5000), start, method="Radau", events=sticks, rtol=1e-9, atol=1e-12)
    cycle = limit_cycle(SLOW, LUBRICATED)
    assert cycle.slip_duration == pytest.approx(radau.t[-1], rel=1e-5)
    assert cycle.reattachment == pytest.approx(radau.y[0, -1] * force, rel=1e-5)
    assert cycle.period == pytest.approx(cycle.slip_duration + (cycle.departure - cycle.reattachment) / velocity)
    assert simulate(SLOW, LUBRICATED, duration_periods=300.0).cycles == 3
    fastest = velocity * (1 - radau.y[1].min()) * SLOW.natural_frequency_rad_per_s
    assert slip_loop(SLOW, LUBRICATED).fastest == pytest.approx(fastest, rel=2e-3)
    assert longest_slip(SLOW, LUBRICATED) == pytest.approx(3 * cycle.slip_duration / TURN)


def test_a_relaxation_oscillation_is_followed_however_long_it_takes():
    """Slow motion scales as F / V, so that durations at 1e-3 kg and at 1e-2 kg are as the masses; the jumps between
    add their own time. A slip that takes more steps than there are is an error."""
    heavy, light = (slip_loop(replace(STUDY, mass_kg=mass), LAW).cycle for mass in (1e-2, 1e-3))
    assert light.slip_duration / heavy.slip_duration == pytest.approx(10, rel=0.04)
    with pytest.raises(ConvergenceError, match="too stiff to follow"):
        slip_loop(replace(STUDY, mass_kg=1e-7), LAW)


@pytest.mark.parametrize("damping", [0.0, 1e-9, 1e-3, 0.1, 0.99, 2.0])
def test_coulomb_s_law_without_a_step_has_no_cycle(damping):
    """Slip is a damped oscillation that starts with w = 1 and never comes back to more."""
    belt, law = replace(STUDY, damping_ratio=damping), CoulombLaw(0.2, 0.2)
    assert slip_loop(belt, law).cycle is None
    with pytest.raises(IllPosedError, match="no stick-slip cycle"):
        limit_cycle(belt, law)
    with pytest.raises(IllPosedError, match="even without damping"):
        existence_limit(belt, law)


def test_a_run_goes_on_until_its_state_is_known_and_the_first_loading_is_none():
    """mu N / (k v0) = 0.7 s, 31.5 natural periods: a damped mass on a slow belt never sticks again. With a cycle of 88
    natural periods, nearly all stick, the state after 15 shows in the departure 75 periods later."""
    belt = Oscillator(25.0, math.sqrt(2e6 / 25.0), 0.03, 1e-4, 400.0)
    _, first, states = run_until_known(Machine(belt, StribeckLaw(0.35, 0.4)), None, 0.0, 20.0)
    assert first == pytest.approx(departure_point(belt, StribeckLaw(0.35, 0.4)) / belt.V / TURN, rel=1e-9)
    assert (first > 30.0, states.stick_slip.size, list(states.sliding[:, 0])) == (True, 0, [pytest.approx(first)])
    run, first, states = run_until_known(Machine(SLOW, LUBRICATED), None, 0.0, 15.0)
    assert states.is_stick_slip(first + 15.0)
    assert run.duration / TURN > first + limit_cycle(SLOW, LUBRICATED).period / TURN
    damped = replace(STUDY, damping_ratio=0.5)  # slides on, for longer than asked and than any slip of a cycle
    run, first, states = run_until_known(Machine(damped, LAW), None, 0.0, 0.1, from_sliding=True)
    assert (first, states.sliding.tolist()) == (0.0, [[0.0, pytest.approx(longest_slip(damped, LAW), rel=1e-8)]])
    assert simulate(replace(STUDY, belt_velocity_m_per_s=0.0), LAW, duration_periods=1e300).kind.size == 0


def random_case(number):
    """An oscillator and a law, the belt at 1e-2 to 3 static deflections a radian; every tenth without damping."""
    trial = Trial(8, number)
    rng, omega, stiffness, force = trial.rng, *10 ** trial.rng.uniform([1, 4, 1], [3, 6, 3])
    velocity = 10 ** rng.uniform(-2, math.log10(3)) * force / stiffness * omega
    damping = 0.0 if number % 10 == 9 else 10 ** rng.uniform(-2.5, 0.2)
    law, _ = draw_law(trial, rng.uniform(0.1, 0.6), velocity)
    return Oscillator(stiffness / omega**2, omega, damping, velocity, force), law


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(2))
def test_all_functions_say_the_same_of_random_oscillators(batch):
    """The cycle, its limit in damping, the counts and long runs from rest. Within 1e-6 of the limit it is a draw."""
    for number in range(50 * batch, 50 * batch + 50):
        belt, law = random_case(number)
        loop = slip_loop(belt, law)
        exists = loop.cycle is not None
        try:
            limit = existence_limit(belt, law)
        except (IllPosedError, ConvergenceError) as error:  # at no damping, or at every damping tried
            limit = 0.0 if isinstance(error, IllPosedError) else math.inf
        if abs(limit - belt.damping_ratio) > 1e-6 * max(limit, 1e-3):
            assert (limit > belt.damping_ratio) == exists, number
        loading = max(departure_point(belt, law), 0.0) / belt.V / TURN
        duration = loading + 12 * (loop.cycle.period / TURN if exists else max(loop.periods, 1.0))
        cycles = simulate(belt, law, duration_periods=duration).cycles
        assert cycles >= 11 if exists else cycles == 0, number
        for periods in (20.0, 200.0):
            _, first, states = run_until_known(Machine(belt, law), None, 0.0, periods)
            assert states.share(first + 0.5 * periods, first + periods) == float(exists), number


def states(stick_slip, sliding, stick_slip_ended, sliding_ended):
    times = (np.reshape(np.array(rows, float), (-1, 2)) for rows in (stick_slip, sliding))
    return States(*times, *(np.array(ended, bool) for ended in (stick_slip_ended, sliding_ended)))


def test_means_of_runs_by_hand():
    """Time over ends of stick-slip: 30 / 2. Sliding lasts 5, and 35 + 5 + 8 past 5 and 2, with two ends and a birth."""
    slides_again = states([], [(0, 10), (12, 22)], [], [True, False])
    both = states([(0, 10), (50, 55)], [(10, 50)], [True, True], [True])
    runs = [both, states([(0, 15)], [], [False], []), slides_again]
    times = durations(runs, np.random.default_rng(1), (5.0, 2.0))
    assert (times.stick_slip[0], times.sliding[0], times.birth[0]) == pytest.approx((15, 29, 0.5 / 29))
    assert times.share[0] == pytest.approx((0.5 / 29) / (0.5 / 29 + 1 / 15))
    assert times.death[:2] == pytest.approx((1 / 15, 1 / times.stick_slip[2]))
    for values in (times.stick_slip, times.sliding, times.birth, times.share):
        assert values[1] < values[0] < values[2]


def test_times_of_sliding_are_steady_or_vibrate():
    """Of 40, cut off, the first 10 are steady, then 25 vibrate and 5 are steady; the slip of 20 vibrates as a whole."""
    slides = states([], [(0, 40), (50, 70)], [], [False, True])
    runs = [replace(slides, vibration=np.array([(10, 35), (50, 70)]))]
    times = durations(runs, np.random.default_rng(1), ONE_RATE)
    assert (times.sliding[0], times.vibration[0]) == pytest.approx((15 / 1, 45 / 2))
    assert times.birth[0] == 0.0
    assert times.birth[2] == pytest.approx(-math.log(0.025) / 60, rel=0.15)  # P(no birth) = 2.5 % there


def test_whole_cycles_by_hand():
    """From one return after backward motion to the next: of 2 and 4 natural periods; the third slides steadily."""
    run = motion(20, *((REATTACHMENT, end) for end in (1, 2, 3, 7, 12)), micro=(2,))
    time = TURN * np.linspace(0.0, 20.0, 2001)
    place = np.where(time < 3 * TURN, 1e-3, 3e-3) * np.sin(time)
    found = whole_cycles(Trajectory(run, time, place, np.zeros(2001)), states([], [(8, 10)], [], [True]))
    np.testing.assert_allclose(found, [[1e-3, 2 * TURN], [3e-3, 4 * TURN]], rtol=1e-9)


def test_a_state_that_was_never_seen_is_unknown_and_json_has_null():
    times = durations([states([(0, 40)], [], [False], [])], np.random.default_rng(1))
    assert times.share == pytest.approx([1.0, math.nan, math.nan], nan_ok=True)
    assert np.isnan(times.sliding).all()
    assert (times.stick_slip[0], times.stick_slip[2]) == (math.inf, math.inf)
    answer = states_of_answer(times, times, 2 * math.pi)
    assert answer["mean_stick_slip_s"] == [None, pytest.approx(times.stick_slip[1]), None]
    assert (answer["by_theory"]["share_of_time"], answer["by_theory"]["mean_sliding_s"]) == (1.0, None)


def test_the_age_of_settling_by_hand():
    """Three natural periods, and four decays at D - D_Hopf or a correlation length; runs in sliding, four lengths."""
    longest, length = longest_slip(STUDY, LAW), 1e-2 / (TURN * STUDY.V)
    decays = 4 / (TURN * (hopf_damping(STUDY, LAW) - STUDY.damping_ratio))
    assert settling_ages(machine(length=1e-2)) == pytest.approx((longest + decays, longest + min(4 * length, decays)))
    assert settling_ages(machine(length=10.0)) == pytest.approx((longest + 1e3 * length,) * 2)
