"""The accuracy of motions: published cycles, closed forms, errors against tolerance, energy, drift."""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from tests.oscillator.motions import LAW, STUDY, F, V, coulomb

BOTH = pytest.mark.parametrize("integrator", ["fehlberg45", "dormand_prince853"])
EXCITED = replace(STUDY, excitation_force_n=60.0, excitation_frequency_rad_per_s=430.0)


@BOTH
@pytest.mark.parametrize("follows", ["slip", "belt"])
@pytest.mark.parametrize("oscillator", [STUDY, EXCITED])
def test_reattachment_at_the_default_tolerance(integrator, follows, oscillator):
    """The first reattachment, which all later ones repeat from a new departure: within 1e-8 of its value of 1e-13."""
    path = 0.05 * np.random.default_rng(2).uniform(-1.0, 1.0, 3000)
    runs = [
        simulate(oscillator, LAW, path, 5e-5, 2.0, MotionOptions(tolerance, friction_follows=follows, integrator=one))
        for tolerance, one in ((1e-9, integrator), (1e-13, "fehlberg45"))
    ]
    found, exact = (run.position[run.kind == REATTACHMENT][0] for run in runs)
    assert found == pytest.approx(exact, rel=1e-8)


@BOTH
def test_error_goes_with_the_tolerance(integrator):
    """Without a path the steps are as long as the tolerance lets them be."""

    def reattachment(tolerance, one=integrator):
        return simulate(
            STUDY, LAW, None, 0.0, 1.3, MotionOptions(tolerance, integrator=one), start_position_m=0.4 * F
        ).position[1]

    exact = reattachment(1e-13, "fehlberg45")
    tolerances = 10.0 ** -np.arange(5.0, 11.0, 0.5)
    errors = np.array([abs(reattachment(t) - exact) for t in tolerances])
    assert max(errors / tolerances) < 10.0 * F
    assert np.polyfit(np.log10(tolerances), np.log10(np.maximum(errors, 1e-14 * F)), 1)[0] > 0.75


def test_the_higher_order_pays_at_small_tolerances():
    """Evaluations for the cycle of the study, without a path and on a path.

    On a path the nodes bound the steps. So at large tolerances both pairs take equal steps, Fehlberg's with half the
    evaluations.
    """
    path = 0.02 * np.sin(0.5 * np.arange(12_000))
    count = {
        (pair, rough, tolerance): simulate(
            STUDY, LAW, path if rough else None, 1e-5, 4.0, MotionOptions(tolerance, integrator=pair)
        ).evaluations
        for pair in PAIRS
        for rough in (False, True)
        for tolerance in (1e-4, 1e-9)
    }
    assert count[PAIRS[1], False, 1e-9] < 0.6 * count[PAIRS[0], False, 1e-9]
    assert count[PAIRS[1], True, 1e-4] == pytest.approx(2 * count[PAIRS[0], True, 1e-4], rel=0.1)


PAIRS = ("fehlberg45", "dormand_prince853")


def energy_residual(oscillator, integrator):
    """Energy that friction and drive put into a slip phase less what damping takes and the mass gains, over its sum.

    Power at equal times and its rate give the integral to h^4 of the fourth derivative (trapezoid with end correction
    in every interval), departure and reattachment among the times.
    """
    begin = 0.4 * F - 2 * oscillator.damping_ratio * V + (oscillator.q + 1e-4 * F if oscillator.q else 0.0)
    drawn = trajectory(
        oscillator,
        LAW,
        None,
        0.0,
        1.6,
        MotionOptions(1e-13, integrator=integrator),
        start_position_m=begin,
        samples_per_period=4000,
    )
    events = drawn.motion
    assert events.kind[:2].tolist() == [DEPARTURE, REATTACHMENT]
    inside = (drawn.time > events.time[0]) & (drawn.time < events.time[1])
    tau = np.concatenate((events.time[:1], drawn.time[inside], events.time[1:2]))
    x = np.concatenate((events.position[:1], drawn.position[inside], events.position[1:2]))
    u = np.concatenate(([V], drawn.velocity[inside], [V]))
    D, q, r, omega = oscillator.damping_ratio, oscillator.q, oscillator.r, oscillator.natural_frequency_rad_per_s
    push = F * LAW.mu(omega * (V - u)) + q * np.cos(r * tau)
    a = push - 2 * D * u - x
    push_rate = -F * LAW.slope(omega * (V - u)) * omega * a - q * r * np.sin(r * tau)
    power, rate = push * u - 2 * D * u**2, push_rate * u + push * a - 4 * D * u * a
    h = np.diff(tau)
    work = np.sum(h / 2 * (power[:-1] + power[1:]) + h**2 / 12 * (rate[:-1] - rate[1:]))
    turnover = np.sum(h / 2 * (np.abs(power[:-1]) + np.abs(power[1:])))
    return (work - 0.5 * (x[-1] ** 2 + u[-1] ** 2 - x[0] ** 2 - u[0] ** 2)) / turnover


@BOTH
@pytest.mark.parametrize("oscillator", [STUDY, EXCITED])
def test_energy_balance_over_a_cycle(oscillator, integrator):
    """In stick friction balances force and damping exactly, so a cycle's balance is that of its slip: to 1e-10."""
    assert energy_residual(oscillator, integrator) == pytest.approx(0.0, abs=1e-10)


@pytest.mark.slow
@BOTH
def test_no_drift(integrator):
    """20 000 cycles, each as long as the last: tau counts on to 1.4e5, whose rounding is 3e-11."""
    motion = simulate(STUDY, LAW, None, 0.0, 22_000.0, MotionOptions(1e-9, integrator=integrator))
    back = motion.time[motion.kind == REATTACHMENT]
    assert back.size > 20_000
    periods = np.diff(back)
    assert np.abs(periods / periods[0] - 1.0).max() < 1e-9
    assert motion.position[motion.kind == REATTACHMENT] == pytest.approx(motion.position[1], rel=1e-13)


def test_reported_error_bounds_the_true_one():
    """The sum of the estimates of the fourth-order member exceeds the error of the propagated fifth-order one."""
    start = 0.4 * F
    exact = simulate(STUDY, LAW, None, 0.0, 1.3, MotionOptions(1e-13), start_position_m=start).position[1]
    for tolerance in (1e-5, 1e-7, 1e-9):
        motion = simulate(STUDY, LAW, None, 0.0, 1.3, MotionOptions(tolerance), start_position_m=start)
        assert abs(motion.position[1] - exact) <= motion.local_error
        assert motion.local_error <= motion.steps * tolerance * 2.0 * F


def test_steps_that_shrink_towards_the_belt_are_foreseen():
    """A slip of eqs. (12) and (13) takes 30 steps of order 8 at 1e-9.

    One step is repeated to meet the belt, and six are rejected. Control by the last error alone takes 36 steps.
    """
    motion = simulate(
        STUDY, LAW, None, 0.0, 109.4, MotionOptions(1e-9, integrator="dormand_prince853"), start_position_m=0.4 * F
    )
    assert motion.cycles == 100
    assert motion.steps <= 31 * motion.cycles


RATIOS = [0.5, 1.0, 2.0, 5.0]


@BOTH
@pytest.mark.parametrize("r", RATIOS)
def test_undamped_cycle(r, integrator):
    """The slip about F_k is a circle through (dF, V), with r = dF / V and the amplitude sqrt(dF^2 + V^2).

    Slip lasts 2 (pi - atan r), stick 2 r; reattachment is at 2 F_k - F_s.
    """
    law = coulomb(r)
    motion = simulate(
        replace(STUDY, damping_ratio=0.0), law, None, 0.0, 20.0, MotionOptions(1e-12, integrator=integrator)
    )
    leave, back = (motion.time[motion.kind == kind] for kind in (DEPARTURE, REATTACHMENT))
    count = back.size
    assert count > 8
    assert back - leave[:count] == pytest.approx(np.full(count, 2 * (math.pi - math.atan(r))), abs=1e-9)
    assert leave[1:] - back[: leave.size - 1] == pytest.approx(np.full(leave.size - 1, 2 * r), abs=1e-9)
    assert motion.reattachments() == pytest.approx(np.full(count, (2 * law.kinetic - law.static) * F), abs=1e-10 * F)


@BOTH
@pytest.mark.parametrize(("r", "limit"), list(zip(RATIOS, [0.017938, 0.057829, 0.145359, 0.322719], strict=True)))
def test_damping_at_which_the_cycle_dies(r, limit, integrator):
    """X' of the slip that begins at (F_s - 2 D V, V) is a damped harmonic, whose next maximum is V there.

    The published six digits by bisection on simulated motions; from then on the mass never sticks again.
    """
    law = coulomb(r)

    def sticks_again(damping):
        oscillator = replace(STUDY, damping_ratio=damping)
        begin = law.static * F - 2 * damping * V
        motion = simulate(
            oscillator, law, None, 0.0, 3.0, MotionOptions(1e-11, integrator=integrator), start_position_m=begin
        )
        return bool(np.any(motion.kind == REATTACHMENT))

    low, high = 0.0, 1.0
    assert sticks_again(low)
    assert not sticks_again(high)
    while high - low > 1e-8:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sticks_again(middle) else (low, middle)
    assert low == pytest.approx(limit, abs=6e-7)


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


CASES = [(2.0, 0.596285), (1.3, 0.685936), (0.7, 0.722071)]


@pytest.mark.parametrize(("ratio", "limit"), CASES)
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


@pytest.mark.parametrize(("ratio", "limit"), CASES)
def test_den_hartog_limit_of_motion_without_stops(ratio, limit):
    """f / q <= sqrt(Q^2 / (H^2 + 1 / r^4)): just below it no stop, just above it two a period."""
    big, take = response(ratio)
    assert math.sqrt(big**2 / (take**2 + ratio**-4)) == pytest.approx(limit, abs=6e-7)

    def stops(share):
        motion, _ = den_hartog(ratio, share)
        return int(np.count_nonzero(motion.kind[motion.time > 0.8 * motion.duration] == REATTACHMENT))

    assert stops(limit * (1 - 1e-4)) == 0
    assert stops(limit * (1 + 1e-4)) == pytest.approx(2 * 60 * ratio, abs=2)
