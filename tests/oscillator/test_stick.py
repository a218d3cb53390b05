"""Where stick ends."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from roughslip.oscillator.law import CoulombLaw, StribeckLaw
from roughslip.oscillator.stick import HELD, LOWER, UPPER, departure, static_limit, stick_force
from roughslip.oscillator.system import Oscillator, coefficients

STUDY = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
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
    outside = np.flatnonzero(np.abs([force(t) for t in scan]) > limit)[0]
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
def test_nothing_leaves_before_the_root(q_m, ratio, start, share):
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
