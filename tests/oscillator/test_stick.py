"""The end of stick: closed form, first root under excitation, first passage on a path."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator, coefficients
from roughslip.oscillator.event_loop import DEPARTURE
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from roughslip.oscillator.path import path_through
from roughslip.oscillator.stick import HELD, LOWER, PAUSED, UPPER, departure, passage, static_limit, stick_force
from tests.oscillator.motions import LAW, STUDY, F, V

STIFFNESS = STUDY.stiffness_n_per_m


def driven(q_m, ratio, damping=0.17):
    oscillator = Oscillator(1.0, 316.0, damping, 0.948, 2500.0, q_m * STIFFNESS, ratio * 316.0)
    return coefficients(oscillator, StribeckLaw(0.3))


def test_closed_form_without_excitation():
    """X + 2 D V = limit at departure, after (X_departure - X) / V."""
    p = coefficients(STUDY, StribeckLaw(0.3))
    limit = 0.4 * p.F
    side, tau, x = departure(2.0, 0.001, limit, 100.0, p)
    assert side == UPPER
    assert x == pytest.approx(limit - 2 * 0.17 * p.V, rel=1e-14)
    assert tau == pytest.approx(2.0 + (x - 0.001) / p.V, rel=1e-14)
    assert departure(2.0, 0.001, limit, 3.0, p) == (HELD, 3.0, pytest.approx(0.001 + p.V, rel=1e-14))


@pytest.mark.parametrize(("q_m", "ratio"), [(0.002, 0.3), (0.002, 1.7), (0.004, 3.0), (0.009, 2.0), (0.0095, 0.05)])
@pytest.mark.parametrize("start", [0.0, 1.3, 40.0])
def test_first_root_with_excitation(q_m, ratio, start):
    """Against a fine scan and scipy's brentq; the last rows leave by the lower limit or in the first excursion."""
    p = driven(q_m, ratio)
    limit, x0 = 0.4 * p.F, -0.0005

    def force(tau):
        return stick_force(tau, x0 + p.V * (tau - start), p)

    side, tau, x = departure(start, x0, limit, start + 50.0, p)
    scan = np.linspace(start, start + 10.0, 100_001)
    forces = x0 + p.V * (scan - start) + 2 * p.D * p.V - p.q * np.cos(p.r * scan)
    outside = np.flatnonzero(np.abs(forces) > limit)[0]
    edge = math.copysign(limit, force(scan[outside]))
    root = start if outside == 0 else brentq(lambda t: force(t) - edge, scan[outside - 1], scan[outside], xtol=1e-14)
    assert side == (UPPER if edge > 0 else LOWER)
    assert tau == pytest.approx(root, abs=1e-12)
    assert x == pytest.approx(x0 + p.V * (tau - start), abs=1e-16)


def test_lower_limit_is_reached():
    """The drive pulls the mass back past -limit faster than the belt carries it forward."""
    p = driven(0.02, 2.0)
    start = (0.5 * math.pi) / 2.0  # cos = 0, falling later: -q cos rises first, so begin half a turn on
    side, tau, _ = departure(start + math.pi / 2.0, 0.0, 0.4 * p.F, 50.0, p)
    assert side == LOWER
    assert stick_force(tau, p.V * (tau - start - math.pi / 2.0), p) == pytest.approx(-0.4 * p.F, rel=1e-12)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    q_m=st.floats(1e-5, 0.01),
    ratio=st.floats(0.05, 8.0),
    start=st.floats(0.0, 100.0),
    share=st.floats(-0.9, 0.9),
)
def test_stick_holds_up_to_the_root(q_m, ratio, start, share):
    """Property: the limits hold up to the departure, and are met there to rounding."""
    p = driven(q_m, ratio)
    limit = 0.4 * p.F
    x0 = share * limit - stick_force(start, 0.0, p)  # so that the force begins inside
    side, tau, _ = departure(start, x0, limit, start + 1000.0, p)
    assert side != HELD  # the belt always wins in the end
    rounding = 1e-15 * (abs(x0) + limit + p.V * (tau + 1.0) * (1.0 + p.q * p.r / p.V))
    assert side * stick_force(tau, x0 + p.V * (tau - start), p) == pytest.approx(limit, abs=8 * rounding)
    inside = np.linspace(start, tau, 2000)
    assert max(abs(stick_force(t, x0 + p.V * (t - start), p)) for t in inside) <= limit + 8 * rounding


def test_short_excursion_is_not_missed():
    """The force exceeds the limit by 1e-12 of it at a local maximum only: a scan would pass over it."""
    p = driven(0.002, 3.0)
    arc = math.asin(p.V / (p.q * p.r))
    top = (math.pi + arc) / p.r
    limit = 0.4 * p.F
    x0 = limit * (1.0 + 1e-12) - stick_force(top, p.V * top, p)
    side, tau, _ = departure(0.0, x0, limit, 50.0, p)
    # f ~ limit (1 + 1e-12) - curvature (tau - top)^2 / 2 with curvature q r^2 cos(arc)
    lead = math.sqrt(2e-12 * limit / (p.q * p.r**2 * math.cos(arc)))
    assert side == UPPER
    assert top - tau == pytest.approx(lead, rel=1e-2)


def test_static_limit():
    """static + mu_S, never negative; a constant limit is raised to the slip friction, never lowered."""
    p = coefficients(STUDY, StribeckLaw(0.3))
    assert static_limit(0.1, True, p) == pytest.approx(0.5 * p.F, rel=1e-15)
    assert static_limit(-0.1, True, p) == pytest.approx(0.3 * p.F, rel=1e-15)
    assert static_limit(-0.5, True, p) == 0.0
    assert static_limit(-0.1, False, p) == pytest.approx(0.4 * p.F, rel=1e-15)
    assert static_limit(0.1, False, p) == pytest.approx(0.5 * p.F, rel=1e-15)


def test_static_limit_of_coulomb_friction():
    """The static value with mu_S, or the static value alone, raised where kinetic + mu_S exceeds it."""
    p = coefficients(STUDY, CoulombLaw(0.3, 0.4))
    assert static_limit(0.05, True, p) == pytest.approx(0.45 * p.F, rel=1e-15)
    assert static_limit(0.05, False, p) == pytest.approx(0.4 * p.F, rel=1e-15)
    assert static_limit(0.2, False, p) == pytest.approx(0.5 * p.F, rel=1e-15)


def test_a_fixed_base_holds_for_ever_without_excitation():
    p = coefficients(replace(STUDY, belt_velocity_m_per_s=0.0), StribeckLaw(0.3))
    assert departure(2.0, 0.001, 0.4 * p.F, 50.0, p) == (HELD, 50.0, 0.001)


OMEGA = STUDY.natural_frequency_rad_per_s
EXCITED = replace(STUDY, excitation_force_n=60.0, excitation_frequency_rad_per_s=430.0)


def path_of(nodes, spacing, cubic=True):
    return path_through(np.asarray(nodes, dtype=float), 0, spacing, cubic, True)


def follower(oscillator=STUDY, spacing=0.3):
    """Friction that follows the belt, with V the unit of its coordinate so that spacings are in tau."""
    return coefficients(oscillator, LAW)._replace(advance=1.0)


def smooth(nodes, spacing):
    grid = spacing * np.arange(len(nodes))
    return CubicHermiteSpline(grid, nodes, np.gradient(nodes, spacing))


def test_ramp_against_a_parabola():
    """F (0.4 + c (tau - 2)^2) against X + 2 D V + V tau: the lower root of a quadratic, in the midst of a piece.

    Catmull-Rom pieces of a quadratic are that quadratic but for the two at the ends.
    """
    p, c = follower(), 0.01
    nodes = c * (0.3 * np.arange(40) - 2.0) ** 2
    x0 = 0.3 * F
    side, tau, x = passage(0.0, x0, 12.0, path_of(nodes, 0.3), True, p)
    a, b, d = F * c, -4.0 * F * c - V, F * (0.4 + 4.0 * c) - x0 - 2.0 * p.D * V
    root = (-b - math.sqrt(b * b - 4.0 * a * d)) / (2.0 * a)
    assert side == UPPER
    assert tau == pytest.approx(root, abs=3e-12)
    assert x == pytest.approx(x0 + V * root, abs=1e-13 * F)


@pytest.mark.parametrize("above", [1e-12, -1e-12])
def test_a_touch_is_seen(above):
    """The force exceeds the limit by 1e-12 of it between 2e-6 before and after a double root, or just does not."""
    p, c = follower(), 0.02
    nodes = c * (0.3 * np.arange(40) - 5.0) ** 2
    touch = 5.0 + V / (2.0 * F * c)  # where V tau - F c (tau - 5)^2 is largest
    x0 = F * (0.4 + c * (touch - 5.0) ** 2) - 2.0 * p.D * V - V * touch + above * 0.4 * F
    side, tau, _ = passage(1.0, x0 + V, 9.0, path_of(nodes, 0.3), True, p)
    if above < 0:
        assert (side, tau) == (HELD, 9.0)
    else:
        assert side == UPPER
        assert touch - tau == pytest.approx(math.sqrt(above * 0.4 / c), rel=1e-2)


def test_a_force_that_stays_at_its_limit_holds():
    """On a fixed base nothing changes, and at the limit itself stick holds, with a path or without."""
    p = follower(replace(STUDY, belt_velocity_m_per_s=0.0))
    assert passage(0.0, 0.4 * F, 75.0, path_through(np.zeros(0), 0, 1.0, True, True), True, p) == (HELD, 75.0, 0.4 * F)
    nodes = np.tile([0.0, 0.0, 0.3], 30)  # level from time to time, with cubics that dip between the nodes
    side, tau, _ = passage(0.0, 0.4 * F, 20.0, path_of(nodes, 0.3), True, p)
    assert side == UPPER
    assert tau < 0.3


def test_lower_limit_and_a_constant_one():
    """The limit may fall to meet the force from either side; a constant one bears the least of both falls."""
    p = follower()
    falling = path_of(np.linspace(0.2, -11.8, 41), 0.3, cubic=False)
    x0 = -0.35 * F - 2 * p.D * V
    side, tau, _ = passage(0.0, x0, 4.0, falling, True, p)
    # 0.35 F - V tau = F (0.6 - tau)
    assert side == LOWER
    assert tau == pytest.approx(0.25 * F / (F - V), abs=3e-12)
    # 0.4 F at least: the force, -0.35 F + V tau, stays within
    assert passage(0.0, x0, 4.0, falling, False, p)[:2] == (HELD, 4.0)


def test_nodes_at_hand_end():
    """A path that goes on elsewhere pauses where its nodes do; one that ends, too."""
    p = follower()
    for ends, last in ((True, 8), (False, 6)):
        path = path_of(np.zeros(9), 0.3)._replace(ends=ends)
        side, tau, x = passage(0.0, 0.0, 100.0, path, True, p)
        assert side == PAUSED
        assert 0.3 * (last - 1) <= tau + 1e-9
        assert tau == pytest.approx(0.3 * round(tau / 0.3), abs=1e-12)
        assert x == pytest.approx(V * tau, rel=1e-14)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    scatter=st.floats(0.0, 0.2),
    share=st.floats(-0.9, 0.9),
    force=st.floats(0.0, 400.0),
    frequency=st.floats(10.0, 3000.0),
    cubic=st.booleans(),
    stochastic=st.booleans(),
)
def test_stick_holds_up_to_the_first_passage(seed, scatter, share, force, frequency, cubic, stochastic):
    """Property: the limits hold up to the departure, and are met there to rounding."""
    oscillator = replace(STUDY, excitation_force_n=force, excitation_frequency_rad_per_s=frequency)
    p = follower(oscillator)
    nodes = scatter * np.random.default_rng(seed).uniform(-1.0, 1.0, 80)
    grid = 0.1 * np.arange(80)

    def mu_s(tau):
        return smooth(nodes, 0.1)(tau) if cubic else np.interp(tau, grid, nodes)

    def excess(tau, x):
        limit = 0.4 + mu_s(tau) if stochastic else np.maximum(0.4, 0.4 + mu_s(tau))
        return np.abs([stick_force(t, y, p) for t, y in zip(tau, x, strict=True)]) - F * np.maximum(limit, 0.0)

    x0 = 0.1 * F * share + p.q - 2 * p.D * V
    side, tau, x = passage(0.0, x0, 7.5, path_of(nodes, 0.1, cubic), stochastic, p)
    times = np.linspace(0.0, tau, 3000)
    outside = excess(times, x0 + V * times)[:-1]
    assert outside.max(initial=-1.0) <= 1e-11 * F or tau == 0.0
    if side != HELD and tau > 0.0:
        assert excess(np.array([tau]), np.array([x]))[0] == pytest.approx(0.0, abs=1e-9 * F)


def test_belt_and_time_are_one_clock():
    """v0 t is time in another unit, and a path without scatter is none."""
    nodes = 0.05 * np.random.default_rng(3).uniform(-1.0, 1.0, 2500)
    by_belt = simulate(STUDY, LAW, nodes, 1e-4, 8.0, MotionOptions(friction_follows="belt"))
    by_time = simulate(STUDY, LAW, nodes, 1e-4 / 0.948, 8.0, MotionOptions(friction_follows="time"))
    assert np.array_equal(by_belt.kind, by_time.kind)
    assert by_time.position == pytest.approx(by_belt.position, abs=1e-8 * F)
    flat = simulate(STUDY, LAW, np.zeros(2500), 1e-4, 8.0, MotionOptions(1e-11, friction_follows="belt"))
    plain = simulate(STUDY, LAW, None, 0.0, 8.0, MotionOptions(1e-11))
    assert flat.position == pytest.approx(plain.position, abs=1e-9 * F)


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_a_path_in_pieces_gives_the_same_motion(size):
    """Where pieces end in the midst of a stick, too; the motion pauses between two steps and nothing changes."""
    path = 0.1 * np.random.default_rng(5).uniform(-1.0, 1.0, 3000)
    pieces = [path[k : k + size] for k in range(0, 3000, size)]
    whole = trajectory(STUDY, LAW, path, 5e-5, 5.0, MotionOptions(friction_follows="belt"))
    found = trajectory(STUDY, LAW, pieces, 5e-5, 5.0, MotionOptions(friction_follows="belt"))
    assert np.count_nonzero(whole.motion.kind == DEPARTURE) > 3
    assert np.array_equal(found.motion.kind, whole.motion.kind)
    # a pause begins the bracket of the passage anew, which moves it by the resolution, 1e-12
    assert found.motion.time == pytest.approx(whole.motion.time, abs=1e-9)
    assert found.position == pytest.approx(whole.position, abs=1e-9 * F)


def test_end_of_the_path_is_an_error_in_stick_and_slip():
    """And the length that the message asks for is enough."""
    for follows, spacing, unit in (("belt", 5e-5, "m"), ("time", 5e-5, "s")):
        for nodes in (np.zeros(150), np.zeros(420)):
            with pytest.raises(ParameterError, match="friction path") as caught:
                simulate(STUDY, LAW, nodes, spacing, 20.0, MotionOptions(friction_follows=follows))
            needed = float(str(caught.value).split("about ")[1].split(f" {unit}")[0])
            enough = np.zeros(math.ceil(needed / spacing))
            assert simulate(STUDY, LAW, enough, spacing, 20.0, MotionOptions(friction_follows=follows)).cycles > 0


def test_what_friction_cannot_follow_is_refused():
    with pytest.raises(ParameterError, match="belt at rest"):
        simulate(replace(STUDY, belt_velocity_m_per_s=0.0), LAW, None, 0.0, 1.0, MotionOptions(friction_follows="belt"))
