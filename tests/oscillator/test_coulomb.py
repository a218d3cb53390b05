"""Coulomb friction: the undamped cycle, its end under damping, and Den Hartog's motion on a fixed base."""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.law import CoulombLaw
from roughslip.oscillator.motion import simulate, trajectory
from tests.oscillator.motions import STUDY, F, V, coulomb

RATIOS = [0.5, 1.0, 2.0, 5.0]
BOTH = pytest.mark.parametrize("integrator", ["fehlberg45", "dormand_prince853"])


@BOTH
@pytest.mark.parametrize("r", RATIOS)
def test_undamped_cycle(r, integrator):
    """With r = dF / V, as X - F_k is a circle through (dF, V): slip 2 (pi - atan r), stick 2 r, reattachment at
    2 F_k - F_s, amplitude sqrt(dF^2 + V^2)."""
    law = coulomb(r)
    motion = simulate(replace(STUDY, damping_ratio=0.0), law, None, 0.0, 20.0, 1e-12, integrator=integrator)
    leave, back = (motion.time[motion.kind == kind] for kind in (DEPARTURE, REATTACHMENT))
    count = back.size
    assert count > 8
    assert back - leave[:count] == pytest.approx(np.full(count, 2 * (math.pi - math.atan(r))), abs=1e-9)
    assert leave[1:] - back[: leave.size - 1] == pytest.approx(np.full(leave.size - 1, 2 * r), abs=1e-9)
    assert motion.reattachments() == pytest.approx(np.full(count, (2 * law.kinetic - law.static) * F), abs=1e-10 * F)


@pytest.mark.parametrize("r", RATIOS)
def test_amplitude_of_the_undamped_cycle(r):
    law = coulomb(r)
    drawn = trajectory(replace(STUDY, damping_ratio=0.0), law, None, 0.0, 8.0, 1e-12, samples_per_period=4000)
    late = drawn.position[drawn.time > drawn.motion.time[0]]
    amplitude = math.hypot(r * V, V)
    # samples miss the extreme by (pi / 4000)^2 / 2 = 3e-7 of the amplitude at most
    assert law.kinetic * F - late.min() == pytest.approx(amplitude, rel=4e-7)


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
        motion = simulate(oscillator, law, None, 0.0, 3.0, 1e-11, start_position_m=begin, integrator=integrator)
        return bool(np.any(motion.kind == REATTACHMENT))

    low, high = 0.0, 1.0
    assert sticks_again(low)
    assert not sticks_again(high)
    while high - low > 1e-8:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sticks_again(middle) else (low, middle)
    assert low == pytest.approx(limit, abs=6e-7)
    assert low == pytest.approx(_closed_form(r), abs=2e-8)


def _closed_form(r):
    """D at which the first maximum of X' after departure is V, by bisection on the closed form.

    With X - F_k = exp(-D t) (a cos w t + b sin w t), a = (r - 2 D) V and X' = V at t = 0. X'' = 0 where
    tan(w t) = w X''(0) / (X''(0) D + X'(0)): X'(t) = exp(-D t) V (cos w t + c sin w t), c = (-a / V - D) / w.
    """

    def excess(d):
        w = math.sqrt(1 - d * d)
        c = (-(r - 2 * d) - d) / w
        # X' = V exp(-d t) (cos w t + c sin w t) has its extremes pi apart, at tan w t = (w c - d) / (w + d c)
        t = math.atan2(w * c - d, w + d * c) % math.pi / w  # the minimum, or the maximum before it
        times = [t + k * math.pi / w for k in range(3)]
        values = [math.exp(-d * t) * (math.cos(w * t) + c * math.sin(w * t)) for t in times]
        return max(values) - 1.0

    low, high = 0.0, 0.9
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return low


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
    return simulate(oscillator, CoulombLaw(mu, mu), None, 0.0, periods, 1e-11), q


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
