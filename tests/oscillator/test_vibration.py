"""Vibration under scatter: response by Lyapunov's equation, times and cycles by hand, a machine in three states."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from roughslip.friction import Friction
from roughslip.oscillator.answer_runs import Runs
from roughslip.oscillator.answers import STARTS, answer, changed_without_scatter, slides
from roughslip.oscillator.attractors import State, attractors_of
from roughslip.oscillator.event_loop import DEPARTURE
from roughslip.oscillator.limits import hopf_damping
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import Motion, MotionOptions, Trajectory, trajectory
from roughslip.oscillator.slip_orbit import equilibrium
from roughslip.oscillator.states import States
from roughslip.oscillator.vibration import least_amplitude, linear_response, vibration_cycles, vibrations
from tests.oscillator.motions import LAW, STUDY
from tests.oscillator.test_attractors import BELT, HUMP, SLIDE, of_powers

TURN = 2.0 * math.pi
LENGTH = 2.5e-4


def hump(damping, deviation=0.002, **more):
    return Machine(replace(SLIDE, damping_ratio=damping), HUMP, Friction(0.12, deviation, LENGTH, **more))


@pytest.mark.parametrize("margin", [0.01, 0.2])
@pytest.mark.parametrize("length", [3e-6, 3e-3])
def test_the_linear_response_solves_lyapunov_s_equation(margin, length):
    """State X, X' and the force of mu_S, a first-order process."""
    hopf = hopf_damping(STUDY, LAW)
    made = Machine(STUDY, LAW, Friction(0.3, 0.02, length)).changed({"damping": hopf + margin})
    rate, force = STUDY.V / length, STUDY.F * 0.02
    matrix = np.array([[0.0, 1.0, 0.0], [-1.0, -2.0 * margin, 1.0], [0.0, 0.0, -rate]])
    variance = solve_continuous_lyapunov(matrix, -np.diag([0.0, 0.0, 2.0 * rate * force**2]))[0, 0]
    assert linear_response(made) == pytest.approx(math.sqrt(2.0 * variance), rel=1e-9)
    assert linear_response(made.changed({"damping": hopf - margin})) == pytest.approx(linear_response(made), rel=1e-9)
    multiplied = replace(made, friction=replace(made.friction, multiplies=True))
    gain = float(LAW.mu(STUDY.belt_velocity_m_per_s)) / 0.3
    assert linear_response(multiplied) == pytest.approx(gain * linear_response(made), rel=1e-9)


def test_a_slip_vibrates_from_the_middle_between_response_and_cycle_on():
    """Without a vibration that differs from the response there is no bound."""
    assert least_amplitude(hump(0.8)) is None
    both, law = replace(BELT, damping_ratio=0.11), of_powers(0.2, 0.2, -0.4)  # where sliding attracts too
    cycle, middle = attractors_of(both, law).from_rest, Machine(both, law, Friction(0.3, 1e-3, 1e-3))
    assert least_amplitude(middle) == 0.5 * (cycle.amplitude + linear_response(middle))
    assert least_amplitude(Machine(both, law, Friction(0.3, 0.05, 1e-3))) is None
    assert least_amplitude(Machine(STUDY, LAW, Friction(0.3, 0.03, LENGTH))) is None


@pytest.mark.slow
def test_the_share_that_vibrates_under_noise_is_that_of_the_averaged_motion():
    """Rayleigh's oscillator at L = 0.6 A: Phi(0.6) / Phi(1 / 0.6) = 0.762. The noise within a period adds 0.03."""
    a = 0.05
    belt, law = replace(BELT, damping_ratio=0.35 * a), of_powers(a, -4 / 3 * a)
    cycle = attractors_of(belt, law).from_rest.amplitude
    deviation = 1e-3 * cycle / linear_response(Machine(belt, law, Friction(0.3, 1e-3, 1e-3)))
    assert least_amplitude(Machine(belt, law, Friction(0.3, 1.001 * deviation, 1e-3))) is None
    made, periods, at = Machine(belt, law, Friction(0.3, 0.6 * deviation, 1e-3)), 2e4, (equilibrium(belt, law), cycle)
    options = MotionOptions(samples_per_period=40)
    shown = trajectory(belt, law, made.kept_path([1]), made.paths.spacing, periods, options, at)
    slip = States(np.empty((0, 2)), np.array([(0, periods)]), np.empty(0, bool), np.array([False]))
    assert np.diff(vibrations(shown, slip, 0.8 * cycle)).sum() / periods == pytest.approx(0.792, abs=0.03)
    assert least_amplitude(made) == pytest.approx(0.8 * cycle, rel=1e-9)


def drawn(periods, amplitude, machine):
    """X about steady sliding in a run that departs at 0; amplitude : as a function of natural periods."""
    time = TURN * np.arange(0.0, periods, 1 / 200)
    place = equilibrium(machine.oscillator, machine.law) + amplitude(time / TURN) * np.sin(time)
    nothing = np.zeros(1)
    run = Motion(np.array([DEPARTURE]), nothing, nothing, nothing, nothing > 1, TURN * periods, 0.0, 0)
    return Trajectory(run, time, place, np.zeros_like(place))


def test_times_and_cycles_of_a_vibration_by_hand():
    """Amplitude 1 in natural periods 3 to 8 of a slip from 0 to 12; a slip from 12 to 12.4 is a part of a period."""
    made = hump(0.4)
    shown = drawn(12.4, lambda periods: np.where((periods >= 3) & (periods < 8), 1e-3, 1e-4), made)
    slips = States(np.empty((0, 2)), np.array([(0, 12), (12, 12.4)]), np.empty(0, bool), np.array([True, False]))
    times = vibrations(shown, slips, 5e-4)
    np.testing.assert_allclose(times, [[3, 8]])
    rows = vibration_cycles(shown, times, made)
    np.testing.assert_allclose(rows, [[1e-3, TURN]] * 4, rtol=2e-4)
    assert vibrations(shown, slips, 5e-5).tolist() == [[0, 12], [12, 12.4]]
    assert vibrations(shown, slips, 2e-3).size == 0


@pytest.mark.slow
def test_a_machine_that_vibrates_under_scatter():
    """Runs show what the motion without scatter does, with amplitude and frequency of its vibration."""
    found = answer(hump(0.4), 72, 40.0, ("load",))
    for start in STARTS:
        ending = found.without_scatter[start]
        assert ending["state"] is State.VIBRATION
        assert found.shares[start][State.VIBRATION].value == 1.0
    for name in ("amplitude", "frequency"):
        assert found.vibration[name].value == pytest.approx(ending[name].value, rel=0.01)
    (change,) = found.smallest_changes
    assert (change.parameter, change.state, change.aim) == ("load", State.VIBRATION, "end")
    assert found.decides["vibration_limit"].value == pytest.approx(hopf_damping(SLIDE, HUMP), rel=1e-5)
    end = hump(0.4).changed({"load": 2000.0 * (1.0 + change.value)})  # where the noise just hides the cycle
    assert linear_response(end) == pytest.approx(attractors_of(end.oscillator, HUMP).from_rest.amplitude, rel=0.02)
    low, high = change.interval
    assert low < change.value < high < low + 1e-3


def test_where_steady_sliding_begins_and_ends_without_scatter():
    """More damping ends the vibration at the Hopf point, from stick-slip on; in load that is the same D / N."""
    hopf = hopf_damping(SLIDE, HUMP)
    runs = Runs(hump(0.2), 72, 20.0, (0,))
    assert changed_without_scatter(runs, "damping", 10.0, slides) == pytest.approx(hopf, rel=2e-6)
    assert changed_without_scatter(runs, "damping", 0.02, slides) is None
    assert changed_without_scatter(runs, "load", 20.0, slides) == pytest.approx(2000.0 * 0.2 / hopf, rel=2e-6)
