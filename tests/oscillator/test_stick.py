"""The end of stick: closed form, first root under excitation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator, coefficients
from roughslip.oscillator.event_loop import (
    HELD,
    UPPER,
    departure,
    static_limit,
    stick_force,
)
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.motion import simulate
from tests.oscillator.motions import LAW, STUDY

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


@pytest.mark.parametrize(("mu_s", "limit"), [(0.1, 0.5), (-0.1, 0.3), (-0.5, 0.0)])
def test_static_limit(mu_s, limit):
    """static + mu_S, or static (1 + mu_S), and never negative."""
    p = coefficients(STUDY, StribeckLaw(0.3))
    assert static_limit(mu_s, p) == pytest.approx(limit * p.F, rel=1e-15)
    p = coefficients(STUDY, StribeckLaw(0.3), "multiplicative")
    assert static_limit(mu_s / 0.4, p) == pytest.approx(limit * p.F, rel=1e-15)


def test_a_fixed_base_holds_for_ever_without_excitation():
    p = coefficients(replace(STUDY, belt_velocity_m_per_s=0.0), StribeckLaw(0.3))
    assert departure(2.0, 0.001, 0.4 * p.F, 50.0, p) == (HELD, 50.0, 0.001)


def test_end_of_the_path_is_an_error_in_stick_and_slip():
    """And half more than the length that the message asks for is enough."""
    for count in (1001, 4000):
        with pytest.raises(ParameterError, match="friction path") as caught:
            simulate(STUDY, LAW, np.zeros(count), 5e-5, 20.0)
        needed = float(str(caught.value).split("about ")[1].split(" m")[0])
        assert simulate(STUDY, LAW, np.zeros(math.ceil(1.5 * needed / 5e-5)), 5e-5, 20.0).cycles > 0
