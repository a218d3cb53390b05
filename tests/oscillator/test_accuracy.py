"""What a motion is worth: the published cycle, errors against tolerance, energy over a cycle, no drift."""

from dataclasses import replace

import numpy as np
import pytest

from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.limits import limit_cycle
from roughslip.oscillator.motion import simulate, trajectory
from tests.oscillator.motions import LAW, STUDY, F, V

BOTH = pytest.mark.parametrize("integrator", ["fehlberg45", "dormand_prince853"])
EXCITED = replace(STUDY, excitation_force_n=60.0, excitation_frequency_rad_per_s=430.0)


def test_cycle_of_the_study():
    """m = 1 kg, mu_fit = 0.3, D = 0.17: period, reattachment and release to seven digits."""
    cycle = limit_cycle(STUDY, LAW)
    assert cycle.period == pytest.approx(6.868535, abs=6e-7)
    assert cycle.reattachment == pytest.approx(0.003280209, abs=6e-10)
    assert cycle.departure == pytest.approx(0.008994421, abs=6e-10)


@BOTH
@pytest.mark.parametrize("follows", ["slip", "belt"])
@pytest.mark.parametrize("oscillator", [STUDY, EXCITED])
def test_reattachment_at_the_default_tolerance(integrator, follows, oscillator):
    """The first reattachment, which all later ones repeat from a new departure: within 1e-8 of its value of 1e-13."""
    path = 0.05 * np.random.default_rng(2).uniform(-1.0, 1.0, 3000)
    runs = [
        simulate(oscillator, LAW, path, 5e-5, 2.0, tolerance, friction_follows=follows, integrator=one)
        for tolerance, one in ((1e-9, integrator), (1e-13, "fehlberg45"))
    ]
    found, exact = (run.position[run.kind == REATTACHMENT][0] for run in runs)
    assert found == pytest.approx(exact, rel=1e-8)


@BOTH
def test_error_goes_with_the_tolerance(integrator):
    """Without a path the steps are as long as the tolerance lets them be."""

    def reattachment(tolerance, one=integrator):
        return simulate(STUDY, LAW, None, 0.0, 1.3, tolerance, 0.4 * F, integrator=one).position[1]

    exact = reattachment(1e-13, "fehlberg45")
    tolerances = 10.0 ** -np.arange(5.0, 11.0, 0.5)
    errors = np.array([abs(reattachment(t) - exact) for t in tolerances])
    assert max(errors / tolerances) < 10.0 * F
    assert np.polyfit(np.log10(tolerances), np.log10(np.maximum(errors, 1e-14 * F)), 1)[0] > 0.75


def test_the_higher_order_pays_at_small_tolerances():
    """Evaluations for the cycle of the study; on a path the nodes bound the steps, so that at large tolerances both
    pairs take as many steps, and Fehlberg's half the evaluations."""
    path = 0.02 * np.sin(0.5 * np.arange(12_000))
    count = {
        (pair, rough, tolerance): simulate(
            STUDY, LAW, path if rough else None, 1e-5, 4.0, tolerance, integrator=pair
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
    drawn = trajectory(oscillator, LAW, None, 0.0, 1.6, 1e-13, begin, samples_per_period=4000, integrator=integrator)
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


@BOTH
def test_no_drift(integrator):
    """20 000 cycles, each as long as the last: tau counts on to 1.4e5, whose rounding is 3e-11."""
    motion = simulate(STUDY, LAW, None, 0.0, 22_000.0, 1e-9, integrator=integrator)
    back = motion.time[motion.kind == REATTACHMENT]
    assert back.size > 20_000
    periods = np.diff(back)
    assert np.abs(periods / periods[0] - 1.0).max() < 1e-9
    assert motion.position[motion.kind == REATTACHMENT] == pytest.approx(motion.position[1], rel=1e-13)


def test_error_is_proportional_to_the_tolerance():
    """Fifth-order steps chosen by a fourth-order error, both of order five: global error ~ tolerance."""

    def reattachment(tolerance):
        return simulate(STUDY, LAW, None, 0.0, 1.3, tolerance=tolerance, start_position_m=0.4 * F).position[1]

    tolerances = 10.0 ** -np.arange(5.0, 10.5, 0.5)
    errors = [abs(reattachment(t) - reattachment(1e-13)) for t in tolerances]
    slope = np.polyfit(np.log10(tolerances), np.log10(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.25)  # step numbers are integers: the errors scatter by a factor of 3
    assert max(errors / tolerances) < 10.0 * F


def test_reported_error_bounds_the_true_one():
    """The sum of the estimates of the fourth-order member exceeds the error of the propagated fifth-order one."""
    start = 0.4 * F
    exact = simulate(STUDY, LAW, None, 0.0, 1.3, tolerance=1e-13, start_position_m=start).position[1]
    for tolerance in (1e-5, 1e-7, 1e-9):
        motion = simulate(STUDY, LAW, None, 0.0, 1.3, tolerance=tolerance, start_position_m=start)
        assert abs(motion.position[1] - exact) <= motion.local_error
        assert motion.local_error <= motion.steps * tolerance * 2.0 * F


def test_steps_that_shrink_towards_the_belt_are_foreseen():
    """A slip of eqs. (12) and (13) takes 30 steps of order 8 at 1e-9: one is taken again to meet the belt, six are
    refused; of steps that look at the last error alone there are 36."""
    motion = simulate(STUDY, LAW, None, 0.0, 109.4, 1e-9, 0.4 * F, integrator="dormand_prince853")
    assert motion.cycles == 100
    assert motion.steps <= 31 * motion.cycles
