"""Friction with a memory: the law and its limits, growth about steady sliding, stick in closed form, and motions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq
from scipy.special import lambertw

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator, coefficients
from roughslip.oscillator.event_loop import CROSSING, DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import CoulombLaw, StribeckLaw
from roughslip.oscillator.limits import critical_stiffness, growth_rates, hopf_damping, limit_cycle
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.memory_step import MemoryState, rosenbrock
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from roughslip.oscillator.path import Piece
from roughslip.oscillator.slip_orbit import equilibrium

LAW = MemoryLaw(StribeckLaw(0.1, 0.4, 20.0, 0.0), 0.01, 0.015, 2e-6, 1e-4, 1e-2, 1e-7)
BELT = Oscillator(0.2, 150.0, 0.05, 1e-4, 10.0)


def test_the_law_has_the_usual_limits():
    """Friction of steady sliding with slope (a - b) / v between v_r and v_c; b ln(10) a decade of hold."""
    coulomb = replace(LAW, curve=CoulombLaw(0.3, 0.3), rest_speed_m_per_s=1e-12, cutoff_speed_m_per_s=1e3)
    v = np.array([1e-5, 1e-2])
    assert coulomb.mu(v) == pytest.approx(0.3 + 0.01 * np.log(v / 1e-4) + 0.015 * np.log(1e3 / v), abs=1e-6)
    assert coulomb.slope(v) * v == pytest.approx([-0.005, -0.005], rel=1e-4)
    assert coulomb.slope(1e9) * 1e9 == pytest.approx(0.01, rel=1e-5)
    h = 1e-5 * v
    assert LAW.slope(v) == pytest.approx((LAW.mu(v + h) - LAW.mu(v - h)) / (2 * h), rel=1e-7)
    assert LAW.static_friction(0.0) == pytest.approx(0.4 + 0.01 * math.log(1e-3), rel=1e-14)
    assert LAW.static_friction(1e4) - LAW.static_friction(1e3, 0.0) == pytest.approx(0.015 * math.log(10), rel=1e-5)
    assert LAW.static_friction(2.0, 3.0) == LAW.static_friction(5.0)
    assert coulomb.times(2.0).static_friction(5.0) == pytest.approx(2 * coulomb.static_friction(5.0), rel=1e-14)


def test_what_has_no_meaning_with_a_memory_is_refused():
    cases = {
        "under the slip law": lambda: replace(LAW, evolution="slip"),
        "MemoryLaw.curve must": lambda: replace(LAW, curve=CoulombLaw(0.3, 0.4)),
        "MemoryLaw.memory_length_m must": lambda: replace(LAW, memory_length_m=0.0),
        "ask static_friction": lambda: LAW.static,
        "takes no excitation": lambda: simulate(replace(BELT, excitation_force_n=1.0), LAW),
        "ask growth_rates": lambda: hopf_damping(BELT, LAW),
        "of friction without memory": lambda: limit_cycle(BELT, LAW),
    }
    for line, call in cases.items():
        with pytest.raises(ParameterError, match=line):
            call()


def growth_in_runs(belt, law):
    """Exponents [1/s] of the swing about steady sliding, by a linear recurrence of odd parts of two runs (Prony)."""
    start, size = equilibrium(belt, law), 1e-3 * belt.V * min(belt.natural_frequency_rad_per_s * 1e-2, 1.0)
    options = MotionOptions(1e-13, 40)
    up, down = (trajectory(belt, law, None, 1.0, 6.0, options, (start + x, 0.0)).position for x in (size, -size))
    z = (up - down)[20:] / size
    recurrence, *_ = np.linalg.lstsq(np.stack([z[i : z.size - 3 + i] for i in range(3)], 1), z[3:], rcond=None)
    roots = np.roots([1.0, *-recurrence[::-1]])
    swing = roots[np.argmax(roots.imag)]
    return np.log(swing) * belt.natural_frequency_rad_per_s * 40 / (2 * math.pi)


def test_the_critical_stiffness_is_where_growth_of_the_exact_polynomial_and_of_runs_changes_sign():
    """Of the Jacobian about steady sliding, whose limit for v_c >> v0 has kappa = N b / D_c."""
    k, omega = critical_stiffness(BELT, LAW)
    alpha = 10.0 * (-0.1 * 20.0 / (1 + 2e-3) ** 2 + 0.01 / (1e-4 + 1e-7)) + BELT.damper_kg_per_s
    limit = (10.0 * 0.015 / 2e-6 - alpha * 50.0) * (1 + 0.2 * 50.0 / alpha)
    far = critical_stiffness(BELT, replace(LAW, cutoff_speed_m_per_s=1e6))
    assert far == pytest.approx((limit, math.sqrt(limit * 50.0 / (0.2 * 50.0 + alpha))), rel=1e-9)
    at_limit = replace(BELT, natural_frequency_rad_per_s=math.sqrt(k / 0.2))
    at_limit = replace(at_limit, damping_ratio=BELT.damper_kg_per_s / (0.4 * math.sqrt(k / 0.2)))
    assert growth_rates(at_limit, LAW)[:2] == pytest.approx([1j * omega, -1j * omega], abs=1e-9 * omega)
    assert growth_in_runs(at_limit, LAW) == pytest.approx(1j * omega, abs=1e-6 * omega)
    softer = replace(at_limit, natural_frequency_rad_per_s=0.9 * at_limit.natural_frequency_rad_per_s)
    assert growth_in_runs(softer, LAW) == pytest.approx(growth_rates(softer, LAW)[0], rel=1e-6)


def test_stick_ends_where_lambert_has_it():
    """Of fresh contacts: k v0 t + d v0 = N (mu_0 + b ln(1 + t / t_c)), by the lower branch of W."""
    age, b = LAW.memory_length_m / LAW.cutoff_speed_m_per_s, LAW.ageing_effect
    for scatter, nodes, share in (("additive", None, 1.0), ("multiplicative", np.full(3, 0.25), 1.25)):
        rate, growth = BELT.stiffness_n_per_m * 1e-4, 10.0 * b * share
        level = 10.0 * share * LAW.static_friction(0.0) - BELT.damper_kg_per_s * 1e-4
        u = -lambertw(-rate * age / growth * math.exp(-(level + rate * age) / growth), -1).real * growth / (rate * age)
        motion = simulate(BELT, LAW, nodes, 1.0, 400.0, MotionOptions(scatter=scatter))
        assert motion.time[0] == pytest.approx(150.0 * age * (u - 1.0), rel=1e-13)


def test_the_step_has_order_four():
    """By halving; on a path, with scatter that multiplies."""
    p = coefficients(BELT, LAW, "multiplicative")
    piece, start, ends = Piece(0.1, 0.2, -0.1, 0.1, 0.0, 1e-4, 1e4), MemoryState(0.0, 1.3e-3, 0.0, 1e-5, 3.0), []
    for steps in (128, 256, 512, 4096):
        y = start
        for _ in range(steps):
            y, _ = rosenbrock(y, 0.5 / steps, 1.0, piece, p)
        ends.append(y.w)
    coarse, middle, fine = (abs(end - ends[-1]) for end in ends[:-1])
    assert np.log2([coarse / middle, middle / fine]) == pytest.approx([4.0, 4.0], abs=0.15)


def test_a_belt_a_million_times_faster_than_creep_costs_no_more():
    """Steps of three cycles; the same ones by another tolerance, and on the path in pieces bit by bit."""
    law, belt = replace(LAW, rest_speed_m_per_s=1e-10), replace(BELT, natural_frequency_rad_per_s=50.0)
    path = 0.01 * np.sin(np.arange(4000) / 3)
    coarse, fine = (simulate(belt, law, path, 2e-5, 2000.0, MotionOptions(error)) for error in (1e-7, 1e-9))
    assert coarse.cycles == fine.cycles == 3
    assert fine.steps < 100_000
    assert coarse.position == pytest.approx(fine.position, abs=1e-6 * belt.F)
    pieces = simulate(belt, law, list(path.reshape(-1, 5)), 2e-5, 2000.0, MotionOptions(1e-7))
    assert np.array_equal(pieces.position, coarse.position)


def reference(belt, law, mu_s, multiplies, x, times):
    """X at times [s] and events (kind, time, X, s), in SI units and with ln(theta), by Radau and brentq."""
    m, k, d, v0 = belt.mass_kg, belt.stiffness_n_per_m, belt.damper_kg_per_s, belt.belt_velocity_m_per_s
    a, b, length = law.direct_effect, law.ageing_effect, law.memory_length_m
    rest, age = law.rest_speed_m_per_s, length / law.cutoff_speed_m_per_s

    def friction(v, theta, s):
        mean = float(law.curve.mu(max(v, 0.0))) + b * math.log1p(theta / age)
        mean += a * math.log(max(v + rest, 0.5 * rest) / law.reference_speed_m_per_s)
        return belt.normal_force_n * max(mean * (1 + mu_s(s)) if multiplies else mean + mu_s(s), 0.0)

    def excess(dt):
        return k * (x + v0 * dt) + d * v0 - friction(0.0, theta + dt, s)

    def slip(dt, y):
        force = side * (k * (x + v0 * dt) + d * v0) - k * y[0] - d * y[1]
        return y[1], (force - friction(y[1], math.exp(y[2]), s + y[0])) / m, math.exp(-y[2]) - y[1] / length

    def at_belt(dt, y):
        return y[1]

    at_belt.terminal, at_belt.direction = True, -1.0
    t, s, theta, side, sticks, events, drawn = 0.0, 0.0, 0.0, 1, True, [], np.full(times.size, x)
    scales = (1e-11 * belt.F, 1e-10 * min(v0, rest / a), 1e-10)
    while t < times[-1]:
        inside = times > t
        if sticks:
            low = max(belt.normal_force_n * b * (1 + mu_s(s) if multiplies else 1) / (k * v0) - theta - age, 0.0)
            high = 2 * low + age
            while excess(high) < 0:
                high *= 2
            dt = brentq(excess, low, high, xtol=1e-300, rtol=1e-15)
            inside &= times <= t + dt
            drawn[inside] = x + v0 * (times[inside] - t)
            t, x, theta, sticks, side = t + dt, x + v0 * dt, theta + dt, False, 1
            events += [(DEPARTURE, t, x, s)] if t < times[-1] else []
            continue
        first = 1e-6 / belt.natural_frequency_rad_per_s
        run = solve_ivp(
            *(slip, (0.0, times[-1] - t), (0.0, 0.0, math.log(theta)), "Radau"), dense_output=True, events=at_belt,
            rtol=1e-9, atol=scales, first_step=first,
        )  # fmt: skip
        dt, (slipped, _, psi) = run.t[-1], run.y[:, -1]
        inside &= times <= t + dt
        drawn[inside] = x + v0 * (times[inside] - t) - side * run.sol(times[inside] - t)[0]
        t, x, s, theta = t + dt, x + v0 * dt - side * slipped, s + slipped, math.exp(psi)
        if run.status == 1:
            sticks = abs(k * x + d * v0) <= friction(0.0, theta, s)
            side = side if sticks else -side
            events.append((REATTACHMENT if sticks else CROSSING, t, x, s))
    return drawn, np.array(events)


def against_radau(seed):
    """Largest differences of X / F at equal times, and of tau and X / F of events, of a random machine."""
    rng = np.random.default_rng([55, seed])
    a, length, v0, load = 10.0 ** rng.uniform((-2.7, -7, -6, 0), (-1.7, -4, -1, 3))
    b, mu = a * 10 ** rng.uniform(-0.3, 0.5), rng.uniform(0.3, 0.7)
    curve = CoulombLaw(mu, mu) if seed % 2 else StribeckLaw(0.1, mu, 10 ** rng.uniform(-1, 1) / v0, 0.0)
    law = MemoryLaw(curve, a, b, length, v0, v0 * 10 ** rng.uniform(0, 4), v0 * 10 ** (-6 * rng.uniform() ** 2))
    stiffness, mass = (
        load * b / length * 10 ** rng.uniform(-2.5, 0.2),
        load * a * length / v0**2 * 10 ** rng.uniform(-2, 2),
    )
    belt = Oscillator(mass, math.sqrt(stiffness / mass), rng.uniform(0, 0.3), v0, load)
    options = MotionOptions(1e-10, 8, ("additive", "multiplicative")[seed // 2 % 2])
    level, omega = belt.F * law.static_friction(0.0), belt.natural_frequency_rad_per_s
    age = length / law.cutoff_speed_m_per_s
    wait = (0.05 * level + belt.F * b * math.log1p(belt.F / (v0 * age))) / belt.V
    periods, spacing = wait / (2 * math.pi) + 4.0, 0.3 * belt.F * 10 ** rng.uniform(-2, -0.5)
    nodes = int((20 * belt.F + 7.5 * periods * belt.V) / spacing) + 200
    path = 0.02 * np.convolve(rng.standard_normal(nodes + 5), np.full(6, 6**-0.5), "valid") * (seed % 3 > 0)
    path -= path[0]
    mu_s = CubicHermiteSpline(spacing * np.arange(nodes), path, np.gradient(path, spacing))
    x = 0.95 * level - 2 * belt.damping_ratio * belt.V
    run = trajectory(belt, law, path, spacing, periods, options, x)
    drawn, events = reference(belt, law, lambda s: float(mu_s(s)), seed // 2 % 2, x, run.time / omega)
    motion, count = run.motion, len(events)
    assert list(motion.kind[:count]) == list(events[:, 0])
    assert motion.kind.size - count <= np.count_nonzero(motion.time >= run.time[-1])
    of_time = np.abs(motion.time[:count] - omega * events[:, 1]).max()
    of_place = np.abs(motion.position[:count] - events[:, 2]).max() / belt.F
    return np.abs(drawn - run.position).max() / belt.F, of_time, of_place


@pytest.mark.parametrize("seed", [2, 15, 16, 21, 23])
def test_random_motions_against_radau(seed):
    """At rtol 1e-9 of Radau and 1e-10 of the motion."""
    assert max(against_radau(seed)) <= 1e-7


@pytest.mark.nightly
def test_a_hundred_random_motions_against_radau():
    assert np.all(np.array([against_radau(seed) for seed in range(100)]) <= 1e-6)
