"""The end of stick: closed form, first root under excitation, first passage on a path."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator, coefficients
from roughslip.oscillator.event_loop import (
    HELD,
    LOWER,
    PAUSED,
    UPPER,
    departure,
    passage,
    static_limit,
    stick_force,
)
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.motion import MotionOptions, simulate
from roughslip.oscillator.path import AHEAD, path_through
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


@pytest.mark.parametrize(
    ("law", "mu_s", "stochastic", "limit"),
    [
        (StribeckLaw(0.3), 0.1, True, 0.5),
        (StribeckLaw(0.3), -0.1, True, 0.3),
        (StribeckLaw(0.3), -0.5, True, 0.0),
        (StribeckLaw(0.3), -0.1, False, 0.4),
        (StribeckLaw(0.3), 0.1, False, 0.5),
        (CoulombLaw(0.3, 0.4), 0.05, True, 0.45),
        (CoulombLaw(0.3, 0.4), 0.05, False, 0.4),
        (CoulombLaw(0.3, 0.4), 0.2, False, 0.5),
    ],
)
def test_static_limit(law, mu_s, stochastic, limit):
    """static + mu_S, never negative; a constant limit is raised to kinetic friction at rest + mu_S, never lowered."""
    p = coefficients(STUDY, law)
    assert static_limit(mu_s, stochastic, p) == pytest.approx(limit * p.F, rel=1e-15)


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
    for ends, last in ((True, 5 + AHEAD), (False, 6)):
        path = path_of(np.zeros(6 + AHEAD), 0.03)._replace(ends=ends)
        side, tau, x = passage(0.0, 0.0, 100.0, path, True, p)
        assert side == PAUSED
        assert 0.03 * (last - 1) <= tau + 1e-9
        assert tau == pytest.approx(0.03 * round(tau / 0.03), abs=1e-12)
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


def test_end_of_the_path_is_an_error_in_stick_and_slip():
    """And the length that the message asks for is enough; of slip from a run of 1000 nodes, and half more."""
    cases = (("slip", (1001,), 1.5, "m"), ("belt", (150, 420), 1.0, "m"), ("time", (150, 420), 1.0, "s"))
    for follows, counts, margin, unit in cases:
        for nodes in map(np.zeros, counts):
            with pytest.raises(ParameterError, match="friction path") as caught:
                simulate(STUDY, LAW, nodes, 5e-5, 20.0, MotionOptions(friction_follows=follows))
            needed = float(str(caught.value).split("about ")[1].split(f" {unit}")[0])
            enough = np.zeros(math.ceil(margin * needed / 5e-5))
            assert simulate(STUDY, LAW, enough, 5e-5, 20.0, MotionOptions(friction_follows=follows)).cycles > 0
