"""Stick and slip in turn without scatter: closed forms, counts, errors against tolerance, drift, faults."""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.errors import ConvergenceError
from roughslip.oscillator import motion as module
from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import CoulombLaw, StribeckLaw
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from tests.oscillator.motions import LAW, STUDY, F, V
from tests.properties.campaign import SEED, row_of

COULOMB = StribeckLaw(fit=0.0, decay_s_per_m=0.0, quadratic_s2_per_m2=0.0)
UNDAMPED = replace(STUDY, damping_ratio=0.0)


def coulomb_start(kinetic, start):
    """Undamped slip from (start, V) about kinetic F: reattachment at the mirror image after 2 pi - 2 atan(A / V)."""
    amplitude = start - kinetic * F
    return kinetic * F - amplitude, 2.0 * math.pi - 2.0 * math.atan2(amplitude, V)


def test_crossing_to_the_other_sign():
    """From 1.4 F about 0.4 F the mirror image is -0.6 F, outside the limit: X' overshoots V and slips about -0.4 F.

    Then X' >= V: X + 0.4 F = -0.2 F cos + V sin, which returns to V at its own mirror image, -0.2 F: stick.
    """
    motion = simulate(UNDAMPED, COULOMB, None, 0.0, 2.0, start_m=1.4 * F)
    assert motion.kind.tolist()[:3] == [DEPARTURE, CROSSING, REATTACHMENT]
    assert motion.position[:3] == pytest.approx([1.4 * F, -0.6 * F, -0.2 * F], abs=1e-8 * F)
    first = 2.0 * math.pi - 2.0 * math.atan2(F, V)
    second = 2.0 * math.atan2(0.2 * F, V)
    assert motion.time[1:3] == pytest.approx([first, first + second], abs=1e-7)
    forward = 0.4 * F - V * second  # by how much the mass outruns the belt
    assert motion.slipped_distance[2] - motion.slipped_distance[1] == pytest.approx(forward, abs=1e-8 * F)
    assert motion.backwards.tolist()[:3] == [False, False, True]  # backwards before the crossing, counted at the end


def test_trajectory_draws_the_motion():
    """Same events as simulate, stick lines exact, X' = V there, slip on the closed form."""
    law, path = CoulombLaw(0.3, 0.4), np.zeros(20_000)
    drawn = trajectory(UNDAMPED, law, path, 1e-4, 3.0, MotionOptions(samples_per_period=500))
    plain = simulate(UNDAMPED, law, path, 1e-4, 3.0)
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


def test_step_limit_is_an_error(monkeypatch):
    monkeypatch.setattr(module, "STEPS_PER_PERIOD", 3)
    with pytest.raises(ConvergenceError, match="step limit; try a larger tolerance") as caught:
        simulate(STUDY, CoulombLaw(0.3, 0.4), None, 0.0, 50.0)
    assert 3 * 51 <= caught.value.work < 3 * 51 + 10


@pytest.mark.parametrize("side", [1, -1])
def test_a_motion_may_start_off_the_belt(side):
    """Undamped slip is a rotation about F mu for X' < V and about -F mu for X' > V, up to the belt."""
    x, u = side * 0.3 * F, (1 - 2.5 * side) * V
    centre = side * 0.4 * F
    radius = math.hypot(x - centre, u)
    motion = simulate(UNDAMPED, COULOMB, None, 0.0, 1.5, MotionOptions(1e-11), (x, u))
    place = centre - side * math.sqrt(radius**2 - V**2)
    angle = (math.atan2(-V, place - centre) - math.atan2(-u, x - centre)) % (2 * math.pi)
    assert list(motion.kind[:1]) == [DEPARTURE]
    assert motion.position[1] == pytest.approx(place, abs=1e-9 * F)
    assert motion.time[1] == pytest.approx(angle, abs=1e-8)
    assert motion.slipped_distance[1] == pytest.approx(side * (V * angle - (place - x)), abs=1e-9 * F)


def test_reported_error_bounds_the_true_one():
    """The sum of the estimates of the fourth-order member exceeds the error of the propagated fifth-order one."""
    start = 0.4 * F
    exact = simulate(STUDY, LAW, None, 0.0, 1.3, MotionOptions(1e-13), start_m=start).position[1]
    for tolerance in (1e-5, 1e-7, 1e-9):
        motion = simulate(STUDY, LAW, None, 0.0, 1.3, MotionOptions(tolerance), start_m=start)
        assert abs(motion.position[1] - exact) <= motion.local_error
        assert motion.local_error <= motion.steps * tolerance * 2.0 * F


def den_hartog(ratio, share, periods=300.0):
    """The motion on a fixed base with friction F mu = share q at r = Omega / omega."""
    q = 0.002
    oscillator = replace(
        STUDY,
        damping_ratio=0.0,
        belt_velocity_m_per_s=0.0,
        excitation_force_n=q * STUDY.stiffness_n_per_m,
        excitation_frequency_rad_per_s=ratio * 316.0,
    )
    mu = share * q / F
    return simulate(oscillator, CoulombLaw(mu, mu), None, 0.0, periods, MotionOptions(1e-11)), q


def response(ratio):
    """(Q, H) of J. P. Den Hartog (Trans. ASME 53 (1931) APM-107): amplitude without friction, and what it takes."""
    beta = math.pi / ratio
    return 1.0 / (1.0 - ratio**2), math.sin(beta) / (ratio * (1.0 + math.cos(beta)))


@pytest.mark.parametrize(("ratio", "limit"), [(2.0, 0.596285), (1.3, 0.685936), (0.7, 0.722071)])
def test_den_hartog_amplitude(ratio, limit):
    """x0 = sqrt(Q^2 q^2 - H^2 f^2) at the turning points, where the slip changes its sign without a stop."""
    share = 0.6 * limit
    motion, q = den_hartog(ratio, share)
    late = motion.time > 0.8 * motion.duration
    assert set(motion.kind[late]) == {CROSSING}
    big, take = response(ratio)
    amplitude = q * math.sqrt(big**2 - (take * share) ** 2)
    assert np.abs(motion.position[late]) == pytest.approx(np.full(late.sum(), amplitude), rel=1e-6)
    assert np.diff(motion.time[late]) == pytest.approx(np.full(late.sum() - 1, math.pi / ratio), rel=1e-6)


@pytest.mark.parametrize("batch", range(2))
def test_random_motions_against_an_independent_integration(batch):
    """Slips by a Runge-Kutta method of order four in small steps, and sticks by their force: `tests.properties`."""
    rows = [row_of("oscillator", SEED, number) for number in range(40 + 8 * batch, 48 + 8 * batch)]
    assert [row for row in rows if "why" in row] == []
