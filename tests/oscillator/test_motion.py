"""Stick and slip in turn without scatter: closed forms, counts, faults."""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator import motion as module
from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import limit_cycle
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from tests.oscillator.motions import LAW, STUDY, F, V, ends

COULOMB = StribeckLaw(fit=0.0, decay_s_per_m=0.0, quadratic_s2_per_m2=0.0)
UNDAMPED = replace(STUDY, damping_ratio=0.0)


def coulomb_start(kinetic, start):
    """Undamped slip from (start, V) about kinetic F: reattachment at the mirror image after 2 pi - 2 atan(A / V)."""
    amplitude = start - kinetic * F
    return kinetic * F - amplitude, 2.0 * math.pi - 2.0 * math.atan2(amplitude, V)


def test_undamped_slip_arc():
    """From beyond the limit of stick the mass slips at once: mirror image, elapsed angle and slipped distance."""
    x, angle = coulomb_start(0.4, 0.012)
    motion = simulate(UNDAMPED, COULOMB, None, 0.0, 1.5, MotionOptions(1e-11), start_position_m=0.012)
    assert motion.kind.tolist()[:2] == [DEPARTURE, REATTACHMENT]
    assert motion.time[0] == 0.0
    assert motion.position[1] == pytest.approx(x, abs=1e-9 * F)
    assert motion.time[1] == pytest.approx(angle, abs=1e-8)
    assert motion.slipped_distance[1] == pytest.approx(V * angle + 0.012 - x, abs=1e-9 * F)
    assert bool(motion.backwards[1])


def test_exact_stick_slip_cycle():
    """Kinetic 0.3 (a constant path of -0.1), static 0.4 alone: every cycle mirrors 0.4 F to 0.2 F."""
    path = np.full(20_000, -0.1)
    x, angle = coulomb_start(0.3, 0.4 * F)
    period = angle + (0.4 * F - x) / V
    first = 0.4 * F / V + angle
    periods = 10.0
    motion = simulate(UNDAMPED, COULOMB, path, 1e-4, periods, MotionOptions(stochastic_static_limit=False))
    count = math.floor((2 * math.pi * periods - first) / period) + 1
    assert motion.cycles == count
    assert motion.micro_slips == 0
    # each located event adds about the tolerance, without growth, as every departure is the same point
    assert ends(motion)[:, 0] == pytest.approx(first + period * np.arange(count), abs=1e-7)
    assert motion.reattachments() == pytest.approx(np.full(count, x), abs=1e-8 * F)
    departures = motion.position[motion.kind == DEPARTURE]
    assert departures == pytest.approx(np.full(departures.size, 0.4 * F), rel=1e-13)


def test_damped_slip_arc():
    """X - F mu = exp(-D tau) (A cos + B sin): the root of X' = V by bisection on the closed form."""
    oscillator = replace(STUDY, damping_ratio=0.05)
    start = 0.016 - 2 * 0.05 * V
    w, a = math.sqrt(1 - 0.05**2), start - 0.4 * F
    b = (V + 0.05 * a) / w

    def velocity(t):
        cosine, sine = math.cos(w * t), math.sin(w * t)
        return math.exp(-0.05 * t) * ((w * b - 0.05 * a) * cosine - (w * a + 0.05 * b) * sine)

    low, high = 3.5, 5.2
    assert velocity(low) < V < velocity(high)
    while high - low > 1e-15 * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if velocity(middle) < V else (low, middle)
    x = 0.4 * F + math.exp(-0.05 * low) * (a * math.cos(w * low) + b * math.sin(w * low))
    motion = simulate(oscillator, COULOMB, None, 0.0, 1.0, MotionOptions(1e-11), start_position_m=start)
    assert motion.position[1] == pytest.approx(x, abs=1e-10 * F)
    assert motion.time[1] == pytest.approx(low, abs=1e-9)


def test_crossing_to_the_other_sign():
    """From 1.4 F about 0.4 F the mirror image is -0.6 F, outside the limit: X' overshoots V and slips about -0.4 F.

    Then X' >= V: X + 0.4 F = -0.2 F cos + V sin, which returns to V at its own mirror image, -0.2 F: stick.
    """
    motion = simulate(UNDAMPED, COULOMB, None, 0.0, 2.0, start_position_m=1.4 * F)
    assert motion.kind.tolist()[:3] == [DEPARTURE, CROSSING, REATTACHMENT]
    assert motion.position[:3] == pytest.approx([1.4 * F, -0.6 * F, -0.2 * F], abs=1e-8 * F)
    first = 2.0 * math.pi - 2.0 * math.atan2(F, V)
    second = 2.0 * math.atan2(0.2 * F, V)
    assert motion.time[1:3] == pytest.approx([first, first + second], abs=1e-7)
    forward = 0.4 * F - V * second  # by how much the mass outruns the belt
    assert motion.slipped_distance[2] - motion.slipped_distance[1] == pytest.approx(forward, abs=1e-8 * F)
    assert motion.backwards.tolist()[:3] == [False, False, True]  # backwards before the crossing, counted at the end


def test_count_of_the_study():
    """D = 0.17, 100 natural periods: floor((T - first departure - slip) / period) + 1 from the limit cycle."""
    cycle = limit_cycle(STUDY, LAW)
    first = cycle.departure / V + cycle.slip_duration  # stick from X = 0, then slip
    motion = simulate(STUDY, LAW, None, 0.0, 100.0)
    assert motion.cycles == math.floor((200.0 * math.pi - first) / cycle.period) + 1 == 91
    assert motion.micro_slips == 0
    assert motion.reattachments(after_periods=10.0) == pytest.approx(cycle.reattachment, abs=1e-8 * F)
    assert motion.total_slip == pytest.approx(91 * cycle.slipped_distance, rel=0.02)  # and a part of the last slip


def test_trajectory_draws_the_motion():
    """Same events as simulate, stick lines exact, X' = V there, slip on the closed form."""
    path = np.full(20_000, -0.1)
    options = MotionOptions(stochastic_static_limit=False)
    drawn = trajectory(UNDAMPED, COULOMB, path, 1e-4, 3.0, options, samples_per_period=500)
    plain = simulate(UNDAMPED, COULOMB, path, 1e-4, 3.0, options)
    assert np.array_equal(drawn.motion.time, plain.time)
    assert drawn.time.size == 1500
    leave, back, again = plain.time[:3]
    stick = drawn.time <= leave
    assert drawn.position[stick] == pytest.approx(V * drawn.time[stick], abs=1e-15)
    assert np.all(np.abs(drawn.velocity[stick] - V) <= 1e-15)
    slip = (drawn.time > leave) & (drawn.time < back)
    phase = drawn.time[slip] - leave
    exact = 0.3 * F + 0.1 * F * np.cos(phase) + V * np.sin(phase)
    assert drawn.position[slip] == pytest.approx(exact, abs=1e-7 * F)
    assert drawn.velocity[slip] == pytest.approx(-0.1 * F * np.sin(phase) + V * np.cos(phase), abs=1e-6 * F)
    second = (drawn.time > back) & (drawn.time < again)
    line = plain.position[1] + V * (drawn.time[second] - back)
    assert drawn.position[second] == pytest.approx(line, abs=1e-15)


def test_slips_too_short_to_be_one_do_not_stop_the_run():
    """A force that rises just beyond the limit and falls back, again and again: the run goes on and ends in time."""
    top = 1.0 + 1e-15
    q = 0.4 * F * top
    driven = replace(
        STUDY, belt_velocity_m_per_s=0.0, damping_ratio=0.0, excitation_force_n=q * STUDY.stiffness_n_per_m
    )
    driven = replace(driven, excitation_frequency_rad_per_s=2.0 * 316.0)
    motion = simulate(driven, LAW, None, 0.0, 5.0)
    assert motion.steps < 5000
    assert np.abs(motion.position).max(initial=0.0) < 1e-9 * F


def test_step_limit_is_an_error(monkeypatch):
    monkeypatch.setattr(module, "STEPS_PER_PERIOD", 3)
    with pytest.raises(ConvergenceError, match="step limit") as caught:
        simulate(STUDY, LAW, None, 0.0, 50.0)
    assert 3 * 51 <= caught.value.work < 3 * 51 + 10


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": np.array([0.0, np.nan])}, "finite nodes"),
        ({"path": np.zeros(1)}, "finite nodes"),
        ({"path": np.zeros((4, 4))}, "finite nodes"),
        ({"path": np.zeros(9), "spacing_m": 0.0}, "spacing"),
        ({"duration_periods": 0.0}, "duration"),
        ({"duration_periods": math.nan}, "duration"),
        ({"start_position_m": math.inf}, "start must be finite"),
    ],
)
@pytest.mark.parametrize("function", [simulate, trajectory])
def test_refuses(function, change, message):
    valid = {"path": None, "spacing_m": 1e-4, "duration_periods": 1.0}
    with pytest.raises(ParameterError, match=message):
        function(STUDY, LAW, **(valid | change))


@pytest.mark.parametrize(
    ("option", "message"),
    [
        *(({"tolerance": value}, "tolerance") for value in (0.0, 1e-2, math.nan)),
        ({"interpolation": "quintic"}, "cubic, linear"),
        ({"friction_follows": "load"}, "slip, belt, time"),
        ({"negative_friction": "allow"}, "clip, refuse"),
        ({"integrator": "euler"}, "fehlberg45, dormand_prince853"),
    ],
)
def test_options_out_of_range_are_refused(option, message):
    with pytest.raises(ParameterError, match=message):
        MotionOptions(**option)


@pytest.mark.parametrize("side", [1, -1])
def test_a_motion_may_start_off_the_belt(side):
    """Undamped slip is a rotation about F mu for X' < V and about -F mu for X' > V, up to the belt."""
    x, u = side * 0.3 * F, (1 - 2.5 * side) * V
    centre = side * 0.4 * F
    radius = math.hypot(x - centre, u)
    motion = simulate(UNDAMPED, COULOMB, None, 0.0, 1.5, MotionOptions(1e-11), start_position_m=x, start_velocity_m=u)
    place = centre - side * math.sqrt(radius**2 - V**2)
    angle = (math.atan2(-V, place - centre) - math.atan2(-u, x - centre)) % (2 * math.pi)
    assert list(motion.kind[:1]) == [DEPARTURE]
    assert motion.position[1] == pytest.approx(place, abs=1e-9 * F)
    assert motion.time[1] == pytest.approx(angle, abs=1e-8)
    assert motion.slipped_distance[1] == pytest.approx(side * (V * angle - (place - x)), abs=1e-9 * F)


def test_a_start_at_the_belt_s_velocity_is_the_start_on_the_belt():
    one, other = (simulate(STUDY, LAW, None, 0.0, 3.0, start_velocity_m=u) for u in (V, None))
    np.testing.assert_array_equal(one.time, other.time)
    with pytest.raises(ParameterError, match="start must be finite"):
        simulate(STUDY, LAW, None, 0.0, 3.0, start_velocity_m=math.nan)
