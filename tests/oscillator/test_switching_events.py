"""Steps of slip that end where its equation changes, against motions in closed form on both sides."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from roughslip.oscillator.integrators import DORMAND_PRINCE853, FEHLBERG45, PAIRS
from roughslip.oscillator.law import CoulombLaw, TableLaw
from roughslip.oscillator.motion import simulate, trajectory
from roughslip.oscillator.slip import LONGEST_STEP, Pace, next_pace
from roughslip.oscillator.system import Oscillator

FIXED = Oscillator(1.0, 1.0, 0.0, 0.0, 1.0)  # tau is the time, F = 1 m, on a base at rest: friction acts against X'
LEVEL = CoulombLaw(0.4, 0.4)
START = 3.0
INTEGRATORS = tuple(PAIRS)


def oscillation(rate, x, u, t):
    """X and X' of X'' = -rate^2 X after t."""
    c, s = math.cos(rate * t), math.sin(rate * t)
    return x * c + u * s / rate, u * c - x * rate * s


def drawn(law, path, spacing, tolerance, integrator, follows, start=START):
    return trajectory(
        FIXED, law, path, spacing, 0.4, tolerance, start, True, "linear", follows, "clip", integrator, 200
    )  # fmt: skip


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_a_step_ends_where_friction_begins_to_be_cut(integrator, tolerance):
    """mu = 0.4 - b tau until that is zero, then none: X = mu + oscillation, then oscillation alone.

    The error estimate of a step over the kink vanishes at some places of it, so that many are tried: X' erred there by
    up to 6000 tolerances.
    """
    worst = 0.0
    for zero in np.linspace(0.5, 1.5, 101):
        b = 0.4 / zero
        found = drawn(LEVEL, np.array([0.0, -4.0 * b]), 4.0, tolerance, integrator, "time")
        at = found.time
        x, u = np.array([oscillation(1.0, START - 0.4, b, t) for t in at]).T
        x, u = x + 0.4 - b * at, u - b
        x0, u0 = oscillation(1.0, START - 0.4, b, zero)
        free = np.array([oscillation(1.0, x0, u0 - b, t - zero) for t in at]).T
        x, u = np.where(at < zero, (x, u), free)
        errors = np.hypot(found.position - x, found.velocity - u)[1:] / (at[1:] * (1.0 + START))
        worst = max(worst, float(errors.max()))
    assert worst < 2.0 * tolerance  # undamped, an error grows no further; both components may have it


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_a_step_ends_at_a_knot_of_a_table(integrator, tolerance):
    """mu = 0.2 + |v| up to a knot, constant above it: damped by D = 1/2, free, damped again."""
    worst = 0.0
    for knot in np.linspace(0.5, 1.5, 101):
        law = TableLaw((0.0, knot, 9.0), (0.2, 0.2 + knot, 0.2 + knot), 0.2, "linear")
        found = drawn(law, None, 1.0, tolerance, integrator, "time")
        at, rate = found.time, math.sqrt(0.75)

        def damped(x, u, t, rate=rate):
            """Of X'' + X' + X = 0."""
            c, s, e = math.cos(rate * t), math.sin(rate * t) / rate, math.exp(-0.5 * t)
            return e * (x * c + (u + 0.5 * x) * s), e * (u * c - (x + 0.5 * u) * s)

        early = brentq(lambda t, knot=knot, damped=damped: damped(START - 0.2, 0.0, t)[1] + knot, 0.0, 1.1, xtol=1e-15)
        x0, u0 = damped(START - 0.2, 0.0, early)
        states = []
        for t in at:
            if t <= early:
                x, u = damped(START - 0.2, 0.0, t)
                states.append((x + 0.2, u))
            else:
                x, u = oscillation(1.0, x0 - knot, u0, t - early)
                states.append((x + 0.2 + knot, u))
        x, u = np.array(states).T
        fast = (at <= early) | (u < -knot)  # the third stretch is that of the first law again
        assert np.count_nonzero(fast & (at > early)) > 5
        last = len(at) if fast.all() else int(np.argmin(fast))
        errors = np.hypot(found.position - x, found.velocity - u)[1:last] / (at[1:last] * (1.0 + START))
        worst = max(worst, float(errors.max()))
    assert worst < 2.0 * tolerance


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_no_step_passes_a_node_between_straight_lines(integrator):
    """mu = 0.4 + k s up to the node, 0.4 + k node beyond it, with s = START - X: oscillation of rate sqrt(1 + k), then
    of rate 1 about another place."""
    tolerance, worst = 1e-9, 0.0
    k = 0.3
    for node in np.linspace(0.4, 1.6, 61):
        found = drawn(LEVEL, np.array([0.0, *12 * (k * node,)]), node, tolerance, integrator, "slip")
        rate, middle = math.sqrt(1.0 + k), (0.4 + k * START) / (1.0 + k)
        reach = brentq(
            lambda t, rate=rate, middle=middle, node=node: (
                oscillation(rate, START - middle, 0.0, t)[0] - START + middle + node
            ),
            0.0,
            2.0,
            xtol=1e-15,
        )
        x0, u0 = oscillation(rate, START - middle, 0.0, reach)
        about = 0.4 + k * node
        states = []
        for t in found.time:
            if t <= reach:
                x, u = oscillation(rate, START - middle, 0.0, t)
                states.append((x + middle, u))
            else:
                x, u = oscillation(1.0, x0 + middle - about, u0, t - reach)
                states.append((x + about, u))
        x, u = np.array(states).T
        errors = np.hypot(found.position - x, found.velocity - u)[1:] / (found.time[1:] * (1.0 + START))
        worst = max(worst, float(errors.max()))
    assert worst < 2.0 * tolerance


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_samples_between_steps_are_as_good_as_steps(integrator):
    """Long steps of a cosine, through whose ends a quintic misses 4e-9 of it."""
    found = drawn(LEVEL, None, 1.0, 1e-11, integrator, "time")
    assert found.position == pytest.approx(0.4 + 2.6 * np.cos(found.time), abs=1e-10)
    assert found.velocity == pytest.approx(-2.6 * np.sin(found.time), abs=1e-10)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_friction_that_is_cut_for_a_part_of_a_step_is_seen(tolerance):
    """It falls below zero in the first half of a piece and is above zero in its middle and at both its ends.

    X = X0 cos t + the integral of sin(t - z) mu(z): free motion and the response to friction (Duhamel).
    """
    spacing, nodes = 0.05, np.array([0.415, -0.360, -0.207, -0.426, 0.0, 0.1, 0.1, 0.1]) + 0.371
    out = np.array([nodes[1] - nodes[0], *0.5 * (nodes[2:] - nodes[:-2]), nodes[-1] - nodes[-2]])
    mu = CubicHermiteSpline(spacing * np.arange(8), nodes, out / spacing)
    law, end = CoulombLaw(0.371, 0.371), 6.5 * spacing
    found = trajectory(
        FIXED, law, nodes - 0.371, spacing, end / (2 * math.pi), tolerance, START, True, "cubic", "time", "clip",
        "dormand_prince853", 2000,
    )  # fmt: skip
    assert mu(0.06) < 0.0 < min(mu(0.05), mu(0.075), mu(0.1))
    t = found.time[-1]
    kinks = [z for z in mu.roots(extrapolate=False) if z < t] + [spacing * k for k in range(1, 7) if spacing * k < t]
    parts = itertools.pairwise([0.0, *sorted(kinks), t])
    response = sum(quad(lambda z: math.sin(t - z) * max(float(mu(z)), 0.0), a, b, epsabs=1e-15)[0] for a, b in parts)
    assert found.position[-1] == pytest.approx(START * math.cos(t) + response, abs=5.0 * tolerance * t)


@pytest.mark.parametrize("pair", [FEHLBERG45, DORMAND_PRINCE853])
def test_steps_grow_again_behind_a_kink(pair):
    """A step that had to be 1e-4 of the one before is no trend: the steps after it, of no error, grow five times each
    up to the longest. They shrank 1e-4 times each, below the rounding of tau."""
    pace = next_pace(Pace(1e-2, 0.0, 0.0), 1e-2, 0.5, pair)
    pace = next_pace(pace, 1e-6, 0.5, pair)
    assert pace.allowed >= 0.2e-6
    for _ in range(12):
        longer = next_pace(pace, pace.allowed, 0.0, pair)
        assert longer.allowed == pytest.approx(min(5.0 * pace.allowed, LONGEST_STEP))
        pace = longer


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_rest_on_a_knot_needs_no_more_steps_than_rest_beside_it(integrator):
    """A damped mass comes to slide steadily at a knot: rounding about it does not count as passing it."""
    oscillator = Oscillator(1.0, 1.0, 0.4, 1.0, 1.0)
    steps = []
    for knot in (1.0, 5.0):
        law = TableLaw((0.0, knot, 9.0), (0.2, 0.2 + 0.1 * knot, 0.2 + 0.1 * knot), 0.2, "linear")
        steps.append(simulate(oscillator, law, None, 1.0, 60.0, start_position_m=0.9, integrator=integrator).steps)
    assert steps[0] < 1.5 * steps[1]
