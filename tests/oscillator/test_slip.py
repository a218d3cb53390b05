"""A slip phase: its end at the belt, and steps that end where the equation changes."""

import itertools
import math

import numpy as np
import pytest

from roughslip.oscillator.equation import State, coefficients, slip_state
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.path import Piece, path_through
from roughslip.oscillator.runge_kutta import step
from roughslip.oscillator.slip import (
    Horizon,
    Samples,
    Settings,
    Status,
    StepControl,
    slip,
    step_to_node,
)
from roughslip.oscillator.switching_events import (
    LOWER,
    ZERO,
    Bound,
    Sliding,
    arrival,
    bound,
    bracket,
    branch,
    gap_over,
    locate_bound,
    time_left,
)
from tests.oscillator.motions import STUDY, F, V

FREE = Piece(0.0, 0.0, 0.0, 0.0, 0.0, np.inf, 1.0)
NO_PATH = path_through(np.zeros(0), 0, 1.0, True)
UNDAMPED = coefficients(STUDY, CoulombLaw(0.4, 0.4))._replace(D=0.0)
NONE = np.zeros(0)


def start(x, u, sigma=1.0):
    return slip_state(0.0, x, u, 0.0, sigma, FREE, UNDAMPED)


def phase(y, sigma=1.0, duration=9.0, allowed=0.0, p=UNDAMPED, settings=None, path=NO_PATH):
    settings = settings or Settings(1e-9)
    since = y.tau if allowed == 0.0 else -1.0
    control, horizon = StepControl(allowed, 0.0, 0.0, -1), Horizon(duration, 1000)
    return slip(y, since, control, False, sigma, path, p, settings, horizon, Samples(1.0, NONE, NONE))


@pytest.mark.parametrize("rates", [(3.0, -20.0, 50.0), (0.0, 0.0, 40.0), (2.0, 9.0, 0.0), (1.0, -0.5, 0.0)])
def test_step_to_node_solves_its_cubic(rates):
    s1, s2, s3 = rates
    h = step_to_node(0.5, 0.2, s1, s2, s3)
    assert 0.0 < h <= 0.5
    slipped = h * (s1 + h * (s2 / 2 + h * s3 / 6))
    assert slipped == pytest.approx(0.2, rel=1e-5)
    assert step_to_node(0.5, 10.0, s1, s2, s3) == 0.5


def test_velocity_of_the_belt_is_met_to_rounding():
    """Undamped, constant friction: X' = V at twice the angle to the bottom, and X there mirrors the start."""
    end = phase(start(0.013, V), settings=Settings(1e-12))
    assert (end.status, end.y.u, end.backwards) == (Status.AT_BELT, V, True)
    assert end.y.tau == pytest.approx(2 * math.pi - 2 * math.atan2(0.013 - 0.4 * F, V), abs=1e-10)
    assert end.y.x == pytest.approx(0.8 * F - 0.013, abs=1e-11 * F)


def near_top(top, excess):
    """X' = (V + excess) cos(tau - top): above the belt by `excess` at most."""
    radius = V + excess
    return start(0.4 * F - radius * math.sin(top), radius * math.cos(top))


HERE, SLIDING = branch(0, False, UNDAMPED), Sliding(1.0, FREE, UNDAMPED)
BELT = bound(LOWER, HERE, 1.0, 1e-9, UNDAMPED)


def late_over(y, end, h):
    return bracket(gap_over(y, end, h, BELT, HERE, SLIDING), h, UNDAMPED)


@pytest.mark.parametrize(("top", "h"), [(0.06, 0.12), (0.2, 0.21), (0.01, 0.2), (0.25, 0.5)])
def test_double_crossing_inside_a_step_is_seen(top, h):
    """X' rises above V and falls back within one step, early, in its middle or late: the first crossing is met."""
    excess = 0.25 * V * (1 - math.cos(min(top, h - top)))
    y = near_top(top, excess)
    end, _ = step(y, h, 1.0, FREE, UNDAMPED)
    assert max(y.u, end.u) < V
    late = late_over(y, end, h)
    assert 0.0 < late < h
    while late > 0.0:
        arrived, end, *_ = locate_bound(y, end, h, late, BELT, HERE, SLIDING)
        if arrived:
            break
        y, h = end, h - late
        end, _ = step(y, h, 1.0, FREE, UNDAMPED)
        late = late_over(y, end, h)
    assert arrived
    assert end.tau == pytest.approx(top - math.acos(V / (V + excess)), abs=2e-5)
    assert phase(near_top(top, excess), allowed=0.5).y.tau == pytest.approx(end.tau, abs=3e-5)


def test_extreme_below_the_belt_is_passed():
    """By 1e-9 of V: the step that ends at the extreme decides, above and below it."""
    for excess, status in ((1e-9 * V, Status.AT_BELT), (-1e-9 * V, Status.TIME_OVER)):
        phase_ = phase(near_top(0.2, excess), duration=1.0, allowed=0.5, settings=Settings(1e-13))
        assert phase_.status == status
        assert phase_.steps < 300


def test_no_slip_where_friction_holds():
    """Started in slip inside the limit, the mass is pulled past X' = V at once: no phase, however short."""
    for sigma in (1.0, -1.0):
        end = phase(State(0.0, 0.0, V, 0.0, 0.0, 0.0), sigma, 1.0)
        assert end.status == Status.NO_SLIP
        assert (end.y.tau, end.y.x, end.error) == (0.0, 0.0, 0.0)


def test_a_step_too_short_to_change_time_has_a_status_of_its_own():
    end = phase(start(0.013, V)._replace(tau=1e17), duration=2e17)
    assert (end.status, end.steps) == (Status.STEP_LOST, 0)


LEVEL = CoulombLaw(0.4, 0.4)


def test_the_time_left_is_the_next_root_of_the_series_that_falls():
    """gap + rate t + bend t^2 / 2, of a bound ahead or just passed. Rising or without a root: never."""
    for gap, bend in itertools.product((0.1, -0.1), (0.5, -0.5)):
        t = time_left(gap, -1.0, bend)
        assert gap - t + 0.5 * bend * t * t == pytest.approx(0.0, abs=1e-15)
        assert abs(t) < 1.0 / abs(bend)  # the nearer root
        assert math.copysign(1.0, t) == math.copysign(1.0, gap)
    assert [time_left(0.1, 1.0, -0.5), time_left(0.1, -0.1, 0.5)] == [np.inf, np.inf]


@pytest.mark.parametrize("dt", [1e-2, -1e-2])
def test_arrival_is_motion_of_constant_jerk(dt):
    """X = dt u + dt^2 a / 2 + dt^3 j / 6 and its derivatives, exact; slip is what the belt moves more, V dt - X."""
    arrived = arrival(State(1.0, 2.0, 3.0, 4.0, -5.0, 6.0), dt, Bound(ZERO, 1.0, 0.0), 1.0, coefficients(STUDY, LEVEL))
    dx = 3.0 * dt - 2.5 * dt**2 + dt**3
    expected = 1.0 + dt, 2.0 + dx, 3.0 - 5.0 * dt + 3.0 * dt**2, 4.0 + V * dt - dx, -5.0 + 6.0 * dt, 6.0
    assert arrived == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(("cut", "side"), [(False, 1.0), (True, -1.0)])
def test_friction_is_cut_a_tenth_of_the_tolerance_beyond_zero(cut, side):
    """The bound is a deflection: F (mu_D + mu_S) may pass zero by a tenth of the tolerance of F, from either side."""
    p = coefficients(STUDY, LEVEL)
    assert bound(ZERO, branch(0, cut, p), 1.0, 1e-6, p) == (ZERO, side, pytest.approx(1e-7 * F, rel=1e-12))
