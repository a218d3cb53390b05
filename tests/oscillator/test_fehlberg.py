"""One step of slip: order, dense output, and the events built on it."""

import math

import numpy as np
import pytest

from roughslip.oscillator.fehlberg import State, acceleration, extreme_velocity, fehlberg_step, hermite, jerk
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.path import Path, Piece, offset
from roughslip.oscillator.slip import NO_SLIP, belt_bracket, meet_belt, slip, step_to_node
from roughslip.oscillator.system import Oscillator, coefficients

FREE = Piece(0.0, 0.0, 0.0, 0.0, 0.0, np.inf, 1.0)
BUMPY = Piece(0.02, 0.05, -0.08, 0.04, 0.0, 0.02, 0.02)  # one cubic, so that the problem is smooth
DRIVEN = coefficients(Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, 80.0, 500.0), StribeckLaw(0.3))
LINEAR = coefficients(
    Oscillator(1.0, 316.0, 0.1, 0.948, 2500.0), StribeckLaw(fit=0.0, decay_s_per_m=0.0, quadratic_s2_per_m2=0.0)
)


def start(p, x, u, sigma, piece):
    return State(0.0, x, u, 0.0, acceleration(0.0, x, u, sigma, offset(piece, 0.0), p))


def integrate(p, piece, y, duration, steps):
    for _ in range(steps):
        y, _ = fehlberg_step(y, duration / steps, 1.0, piece, p)
    return y


def test_closed_form_of_constant_friction():
    """X - F mu is a damped harmonic: 1e-12 of F is the fifth order's error at h = 1/200."""
    y = integrate(LINEAR, FREE, start(LINEAR, 0.012, LINEAR.V, 1.0, FREE), 3.0, 600)
    w, centre = math.sqrt(1 - 0.1**2), 0.4 * LINEAR.F
    amplitude, quadrature = 0.012 - centre, (LINEAR.V + 0.1 * (0.012 - centre)) / w
    decay, c, s = math.exp(-0.3), math.cos(3 * w), math.sin(3 * w)
    assert y.x - centre == pytest.approx(decay * (amplitude * c + quadrature * s), abs=1e-12 * LINEAR.F)
    velocity = decay * ((w * quadrature - 0.1 * amplitude) * c - (w * amplitude + 0.1 * quadrature) * s)
    assert y.u == pytest.approx(velocity, abs=1e-12 * LINEAR.F)
    assert y.s == pytest.approx(LINEAR.V * 3.0 - (y.x - 0.012), rel=1e-12)


def test_order_five_of_the_solution():
    """Global error of the propagated solution under halved steps, with excitation and a stochastic part."""
    y0 = start(DRIVEN, 0.0125, DRIVEN.V, 1.0, BUMPY)
    exact = integrate(DRIVEN, BUMPY, y0, 2.0, 1000).x
    errors = [abs(integrate(DRIVEN, BUMPY, y0, 2.0, n).x - exact) for n in (40, 80, 160)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(5.0, abs=0.15)


def test_order_five_of_the_error_estimate():
    """The estimate is the local error of the fourth-order member: h^5."""
    y0 = start(DRIVEN, 0.0085, 0.5 * DRIVEN.V, 1.0, BUMPY)
    estimates = [fehlberg_step(y0, h, 1.0, BUMPY, DRIVEN)[1] for h in (0.04, 0.02, 0.01)]
    assert math.log2(estimates[1] / estimates[2]) == pytest.approx(5.0, abs=0.15)


@pytest.mark.parametrize("sigma", [1.0, -1.0])
def test_jerk_is_the_derivative_of_acceleration(sigma):
    """Central difference along the solution: error h^2, here 1e-6 relative."""
    u = 0.3 * DRIVEN.V if sigma > 0 else 1.7 * DRIVEN.V
    a = acceleration(0.7, 0.006, u, sigma, offset(BUMPY, 0.004), DRIVEN)
    y = State(0.7, 0.006, u, 0.004, a)
    h = 1e-4
    ahead, _ = fehlberg_step(y, h, sigma, BUMPY, DRIVEN)
    behind, _ = fehlberg_step(y, -h, sigma, BUMPY, DRIVEN)
    assert jerk(y, sigma, BUMPY, DRIVEN) == pytest.approx((ahead.a - behind.a) / (2 * h), rel=1e-6)


def test_hermite_and_its_extreme_are_exact_for_cubics():
    cubic = np.polynomial.Polynomial([0.2, 1.0, -3.0, 1.3])  # one extreme in (0, 0.6)
    slope = cubic.deriv()
    ends = [State(t, 0.0, cubic(t), 0.0, slope(t)) for t in (0.0, 0.6)]
    assert hermite(0.3, 0.6, cubic(0.0), slope(0.0), cubic(0.6), slope(0.6)) == pytest.approx(cubic(0.18), rel=1e-14)
    step, value = extreme_velocity(*ends)
    root = [t for t in slope.roots() if 0.0 < t < 0.6]
    assert step == pytest.approx(root[0], rel=1e-13)
    assert value == pytest.approx(cubic(root[0]), rel=1e-13)
    mirrored = [State(y.tau, 0.0, -y.u, 0.0, -y.a) for y in ends]
    assert extreme_velocity(*mirrored) == pytest.approx((step, -value), rel=1e-13)


@pytest.mark.parametrize("rates", [(3.0, -20.0, 50.0), (0.0, 0.0, 40.0), (2.0, 9.0, 0.0), (1.0, -0.5, 0.0)])
def test_step_to_node_solves_its_cubic(rates):
    s1, s2, s3 = rates
    step = step_to_node(0.5, 0.2, s1, s2, s3)
    assert 0.0 < step <= 0.5
    slipped = step * (s1 + step * (s2 / 2 + step * s3 / 6))
    assert slipped == pytest.approx(0.2, rel=1e-5)
    assert step_to_node(0.5, 10.0, s1, s2, s3) == 0.5


def test_velocity_of_the_belt_is_met_to_rounding():
    """Undamped, constant friction: X' = V at twice the angle to the bottom, and X there mirrors the start."""
    p = LINEAR._replace(D=0.0)
    y0 = start(p, 0.013, p.V, 1.0, FREE)
    late = 2 * math.pi - 2 * math.atan2(0.013 - 0.4 * p.F, p.V)
    y = integrate(p, FREE, y0, late - 0.01, 2000)
    end, _ = fehlberg_step(y, 0.03, 1.0, FREE, p)
    bracket = belt_bracket(y, end, 1.0, p)
    assert bracket == pytest.approx(0.03, rel=1e-12)
    arrived, met, _ = meet_belt(y, bracket, 1.0, FREE, p)
    assert arrived
    assert met.u == p.V
    assert met.tau == pytest.approx(late, abs=1e-11)
    assert met.x == pytest.approx(0.8 * p.F - 0.013, abs=1e-12 * p.F)


def test_double_crossing_inside_a_step_is_seen():
    """X' rises above V and falls back within one step: the bracket ends at the extreme."""
    p = LINEAR._replace(D=0.0)
    top, above = 0.06, 1e-4 * p.V  # X' = R cos(tau - top) with R = V + above
    radius = p.V + above
    y = State(0.0, 0.4 * p.F - radius * math.sin(top), radius * math.cos(top), 0.0, radius * math.sin(top))
    end, _ = fehlberg_step(y, 0.12, 1.0, FREE, p)
    assert y.u < p.V
    assert end.u < p.V
    arrived, met, _ = meet_belt(y, belt_bracket(y, end, 1.0, p), 1.0, FREE, p)
    assert arrived
    assert met.tau == pytest.approx(top - math.acos(p.V / radius), abs=1e-8)
    below = start(p, 0.4 * p.F - 0.99 * p.V * math.sin(top), 0.99 * p.V * math.cos(top), 1.0, FREE)
    assert belt_bracket(below, fehlberg_step(below, 0.12, 1.0, FREE, p)[0], 1.0, p) == 0.0


def test_no_slip_where_friction_holds():
    """Started in slip inside the limit, the mass is pulled past X' = V at once: no phase, however short."""
    none = np.zeros(0)
    for sigma in (1.0, -1.0):
        start = State(0.0, 0.0, LINEAR.V, 0.0, 0.0)
        phase = slip(start, 0.0, 0.0, sigma, 1.0, Path(none, 0, 1.0, True, True), LINEAR, 1e-9, 100, 1.0, none, none)
        assert phase.status == NO_SLIP
        assert (phase.y.tau, phase.y.x, phase.error) == (0.0, 0.0, 0.0)
