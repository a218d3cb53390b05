"""A slip phase: its end at the belt, and steps that end where the equation changes."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from roughslip.oscillator.equation import Oscillator, State, coefficients, slip_state
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
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
    GRAZING,
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
    quintic,
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


@pytest.mark.parametrize("decay", [1e3, 1e4, 1e5])
def test_steep_friction_at_the_belt_is_not_passed_over(decay):
    """Friction rises by 0.1 within 1e-3 m/s of the belt and less, which a step to the belt may pass over.

    So the error of the shortened step is checked too; without the check the sum was 582 times the tolerance.
    """
    p = coefficients(STUDY, StribeckLaw(0.1, 0.4, decay, 0.0))._replace(D=0.0)
    y = slip_state(0.0, 0.0, V - 0.05 * F, 0.0, 1.0, FREE, p)
    end = phase(y, allowed=0.5, p=p, settings=Settings(1e-6))
    exact = phase(y, allowed=1e-3, p=p, settings=Settings(1e-12))
    assert end.error <= 1e-6 * end.y.tau * 2.0 * F  # |X| and |X'| stay below F
    assert end.y.x == pytest.approx(exact.y.x, abs=1e-6 * F)


def test_no_slip_where_friction_holds():
    """Started in slip inside the limit, the mass is pulled past X' = V at once: no phase, however short."""
    for sigma in (1.0, -1.0):
        end = phase(State(0.0, 0.0, V, 0.0, 0.0, 0.0), sigma, 1.0)
        assert end.status == Status.NO_SLIP
        assert (end.y.tau, end.y.x, end.error) == (0.0, 0.0, 0.0)


def test_a_step_too_short_to_change_time_has_a_status_of_its_own():
    end = phase(start(0.013, V)._replace(tau=1e17), duration=2e17)
    assert (end.status, end.steps) == (Status.STEP_LOST, 0)


FIXED = Oscillator(1.0, 1.0, 0.0, 0.0, 1.0)  # tau is the time, F = 1 m, on a base at rest: friction acts against X'
LEVEL = CoulombLaw(0.4, 0.4)
START = 3.0


def oscillation(rate, x, u, t):
    """X and X' of X'' = -rate^2 X after t."""
    c, s = math.cos(rate * t), math.sin(rate * t)
    return x * c + u * s / rate, u * c - x * rate * s


def two_stretches(times, change, first, second):
    """X and X' : (2, times), the first motion up to the change, and the second from there on."""
    return np.array([first(t) if t <= change else second(t - change) for t in times]).T


def relative_error(curve, exact, last=None):
    """The largest error after so many times, a unit of time and of 1 + START."""
    missed = np.hypot(curve.position - exact[0], curve.velocity - exact[1])
    return float(np.max((missed[1:] / (curve.time[1:] * (1.0 + START)))[:last]))


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_a_step_ends_at_a_knot_of_a_table(tolerance):
    """mu = 0.2 + |v| up to a knot, constant above it: damped by D = 1/2, then free, until the speed falls again."""
    rate = math.sqrt(0.75)

    def damped(t):
        """Of X'' + X' + X = 0.2."""
        x, e = START - 0.2, math.exp(-0.5 * t)
        c, s = math.cos(rate * t), math.sin(rate * t) / rate
        return 0.2 + e * x * (c + 0.5 * s), -e * x * s

    for knot in np.linspace(0.5, 1.5, 21):
        law = TableLaw((0.0, knot, 9.0), (0.2, 0.2 + knot, 0.2 + knot), 0.2, "linear")
        early = brentq(lambda t, knot=knot: damped(t)[1] + knot, 0.0, 1.1, xtol=1e-15)
        x0, u0 = damped(early)

        def free(t, x0=x0, u0=u0, level=0.2 + knot):
            x, u = oscillation(1.0, x0 - level, u0, t)
            return x + level, u

        curve = trajectory(FIXED, law, None, 1.0, 0.4, MotionOptions(tolerance, samples_per_period=200), START)
        exact = two_stretches(curve.time, early, damped, free)
        slow = (curve.time > early) & (exact[1] > -knot)
        last = int(np.argmax(slow)) - 1 if slow.any() else None
        assert relative_error(curve, exact, last) < 2.0 * tolerance


def test_rest_on_a_knot_needs_no_more_steps_than_rest_beside_it():
    """A damped mass comes to slide steadily at a knot: rounding about it does not count as passing it."""
    oscillator = Oscillator(1.0, 1.0, 0.4, 1.0, 1.0)
    steps = []
    for knot in (1.0, 5.0):
        law = TableLaw((0.0, knot, 9.0), (0.2, 0.2 + 0.1 * knot, 0.2 + 0.1 * knot), 0.2, "linear")
        steps.append(simulate(oscillator, law, None, 1.0, 60.0, start_m=0.9).steps)
    assert steps[0] < 1.5 * steps[1]


@pytest.mark.parametrize(("belt", "gap", "repeats"), [(V, 0.5, True), (V, 2.0, False), (1e-6 * F, 0.5, True)])
def test_grazing_is_judged_by_belt_and_friction_together(belt, gap, repeats):
    """A parabola of the gap with its least value in the middle of a step, in units of 1e-5 (V + F).

    A belt far slower than F still takes its margin from F. A step that misses the margin is not repeated.
    """
    p = UNDAMPED._replace(V=belt)
    least = gap * GRAZING * (belt + F)
    parabola = quintic(1.0, least + 0.25, -1.0, 2.0, least + 0.25, 1.0, 2.0)
    assert bracket(parabola, 1.0, p) == (pytest.approx(0.5) if repeats else 0.0)


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
