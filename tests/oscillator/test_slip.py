"""A slip phase: steps that end where the equation changes. The end of stick: closed form,
first root under excitation."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator, State, coefficients, slip_state
from roughslip.oscillator.event_loop import HELD, UPPER, departure, stick_force
from roughslip.oscillator.laws import CoulombLaw
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.path import Path, Piece
from roughslip.oscillator.slip import Horizon, Samples, Status, slip
from tests.oscillator.motions import LAW, STUDY, F, V

FREE = Piece(0.0, 0.0, 0.0, 0.0, 0.0, np.inf, 1.0)
NO_PATH = Path(np.zeros(0), 0, 1.0, True)
UNDAMPED = coefficients(STUDY, CoulombLaw(0.4, 0.4))._replace(D=0.0)
NONE = np.zeros(0)


def start(x, u, sigma=1.0):
    return slip_state(0.0, x, u, 0.0, sigma, FREE, UNDAMPED)


def phase(y, sigma=1.0, duration=9.0, allowed=0.0, p=UNDAMPED, tolerance=1e-9, path=NO_PATH):
    since = y.tau if allowed == 0.0 else -1.0
    horizon = Horizon(duration, 1000)
    return slip(y, since, (allowed, -1), False, sigma, path, p, tolerance, horizon, Samples(1.0, NONE, NONE))


def near_top(top, excess):
    """X' = (V + excess) cos(tau - top): above the belt by `excess` at most."""
    radius = V + excess
    return start(0.4 * F - radius * math.sin(top), radius * math.cos(top))


@pytest.mark.parametrize(("top", "h"), [(0.06, 0.12), (0.2, 0.21), (0.01, 0.2), (0.25, 0.5)])
def test_double_crossing_inside_a_step_is_seen(top, h):
    """X' rises above V and falls back within one step, early, in its middle or late: the first crossing is met."""
    excess = 0.25 * V * (1 - math.cos(min(top, h - top)))
    met = top - math.acos(V / (V + excess))
    assert phase(near_top(top, excess), allowed=h).y.tau == pytest.approx(met, abs=3e-5)


def test_extreme_below_the_belt_is_passed():
    """By 1e-9 of V: the step that ends at the extreme decides, above and below it."""
    for excess, status in ((1e-9 * V, Status.AT_BELT), (-1e-9 * V, Status.TIME_OVER)):
        phase_ = phase(near_top(0.2, excess), duration=1.0, allowed=0.5, tolerance=1e-13)
        assert phase_.status == status
        assert phase_.steps < 300


def test_no_slip_where_friction_holds():
    """Started in slip inside the limit, the mass is pulled past X' = V at once: no phase, however short."""
    for sigma in (1.0, -1.0):
        end = phase(State(0.0, 0.0, V, 0.0, 0.0, 0.0), sigma, 1.0)
        assert end.status == Status.NO_SLIP
        assert (end.y.tau, end.y.x, end.error) == (0.0, 0.0, 0.0)


def driven(q_m, ratio):
    oscillator = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, q_m * STUDY.stiffness_n_per_m, ratio * 316.0)
    return coefficients(oscillator, LAW)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(q_m=st.floats(1e-5, 0.01), ratio=st.floats(0.05, 8.0), start=st.floats(0.0, 100.0), share=st.floats(-0.9, 0.9))
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


def test_end_of_the_path_is_an_error_in_stick_and_slip():
    """And half more than the length that the message asks for is enough."""
    for count in (1001, 4000):
        with pytest.raises(ParameterError, match="friction path") as caught:
            simulate(STUDY, LAW, np.zeros(count), 5e-5, 20.0)
        needed = float(str(caught.value).split("about ")[1].split(" m")[0])
        assert simulate(STUDY, LAW, np.zeros(math.ceil(1.5 * needed / 5e-5)), 5e-5, 20.0).cycles > 0
