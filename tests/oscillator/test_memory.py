"""Friction with a memory: the law and its limits, growth about steady sliding, stick in closed form, and motions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.special import lambertw

from roughslip.errors import ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import CoulombLaw, StribeckLaw
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from roughslip.oscillator.slip_orbit import critical_stiffness, equilibrium, growth_rates, slip_flow
from roughslip.oscillator.table_law import TableLaw

LAW = MemoryLaw(StribeckLaw(0.1, 0.4 + 0.015 * math.log(101), 20.0, 0.0), 0.01, 0.015, 2e-6, 1e-4, 1e-2, 1e-7)
BELT = Oscillator(0.2, 150.0, 0.05, 1e-4, 10.0)
AGE = LAW.memory_length_m / LAW.cutoff_speed_m_per_s


def test_the_law_has_the_usual_limits():
    """Steady sliding with slope (a - b) / v between v_r and v_c; b ln(10) a decade of hold."""
    coulomb = replace(LAW, curve=CoulombLaw(0.6, 0.6), rest_speed_m_per_s=1e-12, cutoff_speed_m_per_s=1e3)
    v = np.array([1e-5, 1e-2])
    assert coulomb.mu(v) == pytest.approx(0.6 + 0.01 * np.log(v / 1e-4) + 0.015 * np.log(1e-4 / v), abs=1e-6)
    assert LAW.slope(v) == pytest.approx((LAW.mu(v + 1e-5 * v) - LAW.mu(v - 1e-5 * v)) / (2e-5 * v), rel=1e-7)
    assert LAW.static_friction(0.0) == pytest.approx(0.4 + 0.01 * math.log(1e-3), rel=1e-14)
    assert LAW.static_friction(1e4) - LAW.static_friction(900.0, 100.0) == pytest.approx(0.015 * math.log(10), rel=1e-5)
    assert coulomb.times(2.0).static_friction(5.0) == pytest.approx(2 * coulomb.static_friction(5.0), rel=1e-14)


def test_what_has_no_meaning_with_a_memory_is_refused():
    cases = {
        "contacts have no age": lambda: simulate(BELT, LAW.curve, age_s=1.0),
        "MemoryLaw.rest_speed_m_per_s must be larger": lambda: replace(LAW, rest_speed_m_per_s=1e-22),
        "MemoryLaw.curve must": lambda: replace(LAW, curve=CoulombLaw(0.3, 0.4)),
        "ask static_friction": lambda: slip_flow(BELT, LAW),
        "takes no excitation": lambda: simulate(replace(BELT, excitation_force_n=1.0), LAW),
    }
    for line, call in cases.items():
        with pytest.raises(ParameterError, match=line):
            call()


def growth_in_runs(belt):
    """Exponent [1/s] of the swing about steady sliding, by a linear recurrence of the odd part of two runs (Prony)."""
    start, size = equilibrium(belt, LAW), 1e-3 * belt.V
    runs = [trajectory(belt, LAW, None, 1.0, 6.0, MotionOptions(1e-13, 40), (start + x, 0.0)) for x in (size, -size)]
    z = (runs[0].position - runs[1].position)[20:] / size
    recurrence, *_ = np.linalg.lstsq(np.stack([z[i : z.size - 3 + i] for i in range(3)], 1), z[3:], rcond=None)
    roots = np.roots([1.0, *-recurrence[::-1]])
    return np.log(roots[np.argmax(roots.imag)]) * belt.natural_frequency_rad_per_s * 40 / (2 * math.pi)


def test_growth_of_the_exact_polynomial_and_of_runs_changes_sign_at_the_critical_stiffness():
    """And k_c is the usual one for v_c far above v0."""
    alpha = 10.0 * (-0.1 * 20.0 / (1 + 2e-3) ** 2 + 0.01 / (1e-4 + 1e-7)) + BELT.damper_kg_per_s
    limit = (10.0 * 0.015 / 2e-6 - alpha * 50.0) * (1 + 0.2 * 50.0 / alpha)
    far = critical_stiffness(BELT, replace(LAW, cutoff_speed_m_per_s=1e6))
    assert far == pytest.approx((limit, math.sqrt(limit * 50.0 / (0.2 * 50.0 + alpha))), rel=1e-9)
    k, omega = critical_stiffness(BELT, LAW)
    at_limit = replace(BELT, natural_frequency_rad_per_s=math.sqrt(k / 0.2), damping_ratio=7.5 / math.sqrt(k / 0.2))
    assert growth_rates(at_limit, LAW)[:2] == pytest.approx([1j * omega, -1j * omega], abs=1e-9 * omega)
    assert growth_in_runs(at_limit) == pytest.approx(1j * omega, abs=1e-6 * omega)
    softer = replace(at_limit, natural_frequency_rad_per_s=0.9 * math.sqrt(k / 0.2))
    assert growth_in_runs(softer) == pytest.approx(growth_rates(softer, LAW)[0], rel=1e-6)


def test_stick_ends_where_lambert_has_it():
    """k v0 t + d v0 = N g (mu_0 + b ln(1 + t / t_c)) of fresh contacts, by the lower branch of W; g = 1.25."""
    rate, growth = BELT.stiffness_n_per_m * 1e-4 * AGE, 12.5 * 0.015
    level = 12.5 * LAW.static_friction(0.0) - BELT.damper_kg_per_s * 1e-4
    since = -lambertw(-rate / growth * math.exp(-(level + rate) / growth), -1).real * growth / rate
    motion = simulate(BELT, LAW, np.full(3, 0.25), 1.0, 400.0, MotionOptions(scatter="multiplicative"))
    assert motion.time[0] == pytest.approx(150.0 * AGE * (since - 1.0), rel=1e-13)


def test_a_motion_begins_with_contacts_of_a_given_age():
    """Slide, hold, slide: break-away friction is that of the whole rest. In slip the age is that of steady sliding."""
    age, start = LAW.memory_length_m / 1e-4, equilibrium(BELT, LAW)
    motion = simulate(BELT, LAW, None, 1.0, 400.0, start_m=start, age_s=age + 50.0)
    friction = LAW.static_friction(motion.time[0] / 150.0, age + 50.0)
    assert motion.position[0] + 2.0 * 0.05 * BELT.V == pytest.approx(BELT.F * friction, rel=1e-13)
    runs = [trajectory(BELT, LAW, None, 1.0, 9.0, start_m=(0.0, 0.0), age_s=one) for one in (None, age, 2.0 * age)]
    usual, given, older = (run.position for run in runs)
    assert given == pytest.approx(usual, rel=1e-12)
    assert np.all(older[1:9] > given[1:9])


def test_friction_without_effects_or_cut_to_zero_needs_no_short_steps():
    """Motion is that of the curve, or of a free mass; at rest on a belt at rest nothing moves."""
    belt = Oscillator(2.3, 2.1, 16.5, 1.9, 0.23)
    law, start = MemoryLaw(CoulombLaw(0.4, 0.4), 0.0, 0.0, 1e-8, 0.04, 1.4, 0.08), (0.4 * belt.F, 1.02 * belt.V)
    runs = [trajectory(belt, one, None, 1.0, 9.0, MotionOptions(1e-7), start) for one in (law, law.curve)]
    assert runs[0].position == pytest.approx(runs[1].position, abs=1e-6 * belt.F)
    steep = replace(LAW, curve=StribeckLaw(0.2, 0.5, 1e8, 0.0))
    free = trajectory(BELT, steep, np.full(2000, -1.0), 0.1 * BELT.F, 9.0)
    x = BELT.V * np.exp(-0.05 * free.time) * np.sin((wave := math.sqrt(1.0 - 0.05**2)) * free.time) / wave
    assert free.position == pytest.approx(x, abs=1e-6 * BELT.V)
    assert free.motion.steps < 1000
    assert simulate(replace(BELT, belt_velocity_m_per_s=0.0), LAW, np.full(3, -1.0), 1.0).kind.size == 0


CREEP = MemoryLaw(StribeckLaw(0.2, 0.5, 2.2e5, 0.0), 0.015, 0.029, 1e-6, 2.1e-6, 4.4e-7, 2.2e-10)
STEEP = TableLaw((0.0, 2.2e-8, 7.2e-8, 2.2e-7), (0.4, 0.35, 0.3, 0.32))
FLAT = MemoryLaw(STEEP, 0.0, 3.4e-4, 4.7e-4, 4.5e-6, 1.1e-9, 8.3e-12)
LANDINGS = {
    "stiff": (CREEP, Oscillator(320.0, 0.54, 0.58, 4.8e-6, 1100.0), 1.0),
    "steep": (FLAT, Oscillator(0.56, 27.0, 0.033, 7.2e-8, 1000.0), 0.1),
}


@pytest.mark.parametrize("name", LANDINGS)
def test_slip_lands_where_radau_has_it(name):
    """Of creep with F / V = 1e6, where a step that ends beyond the belt has a w' of another size than one before it;
    and of a curve whose cubic, beyond the belt, is friction of hundreds. In units of V."""
    law, belt, u = LANDINGS[name]
    scale, v0, force, level = belt.F / belt.V, belt.belt_velocity_m_per_s, 0.4 * belt.F / belt.V, law.parameters().level
    v_r, v_c, D = law.rest_speed_m_per_s, law.cutoff_speed_m_per_s, belt.damping_ratio

    def rate(tau, y):
        v, renewed = max(v0 * y[1], -0.5 * v_r), law.memory_length_m * belt.natural_frequency_rad_per_s
        mu = float(law.curve.mu(max(v, 0.0))) + law.direct_effect * math.log((v + v_r) / law.reference_speed_m_per_s)
        pull = scale * max(mu + law.ageing_effect * (y[2] - level), 0.0)
        return y[1], force + tau - y[0] + 2 * D * (1 - y[1]) - pull, ((v + v_c) * math.exp(-y[2]) - v) / renewed

    def at_belt(tau, y):
        return y[1]

    at_belt.terminal, at_belt.direction = True, -1.0
    start = (0.0, 1.0 - u, math.log1p(v_c / (v0 * (1.0 - u))) if u < 1.0 else 0.0)
    run = solve_ivp(rate, (0, 9), start, "Radau", rtol=1e-9, atol=(1e-3, 1e-9, 1e-9), first_step=1e-9, events=at_belt)
    place = 0.4 * belt.F if u == 1.0 else (0.4 * belt.F, u * belt.V)
    motion = simulate(belt, law, None, 1.0, 1.2, MotionOptions(1e-6), place)
    assert (motion.kind[1], motion.time[1]) == (REATTACHMENT, pytest.approx(run.t[-1], rel=1e-5))
    assert motion.position[1] == pytest.approx((force + run.t[-1] - run.y[0, -1]) * belt.V, abs=1e-6 * belt.F)
    assert motion.steps < 200


def test_a_belt_a_million_times_faster_than_creep_costs_no_more():
    """Steps of three cycles; errors of order 4 sum up to the tolerance^(3/4). A path in pieces is that path."""
    law, belt = replace(LAW, rest_speed_m_per_s=1e-10), replace(BELT, natural_frequency_rad_per_s=50.0)
    path = 0.01 * np.sin(np.arange(4000) / 3)
    coarse, fine = (simulate(belt, law, path, 2e-5, 2000.0, MotionOptions(error)) for error in (1e-9, 1e-11))
    assert coarse.cycles == fine.cycles == 3
    assert fine.steps < 100_000
    assert coarse.local_error / fine.local_error == pytest.approx(100**0.75, rel=0.1)
    assert coarse.position == pytest.approx(fine.position, abs=1e-7 * belt.F)
    pieces = simulate(belt, law, list(path.reshape(-1, 5)), 2e-5, 2000.0, MotionOptions(1e-9))
    assert np.array_equal(pieces.position, coarse.position)


def against_radau(seed):
    """Largest difference of tau and X / F at events and the end from scipy's Radau in SI units, of a random machine."""
    rng = np.random.default_rng([55, seed])
    a, length, v0, load = 10.0 ** rng.uniform((-2.7, -7, -6, 0), (-1.7, -4, -1, 3))
    b, mu, young = a * 10 ** rng.uniform(-0.3, 0.5), rng.uniform(0.3, 0.7), length / v0 * 10 ** -rng.uniform(0, 4)
    steady = b * math.log1p(length / (young * v0))
    mu += steady
    curve = CoulombLaw(mu, mu) if seed % 2 else StribeckLaw(0.1, mu, 10 ** rng.uniform(-1, 1) / v0, 0.0)
    rest, k = v0 * 10 ** (-6 * rng.uniform() ** 2), load * b / length * 10 ** rng.uniform(-2.5, 0.2)
    m = load * a * length / v0**2 * 10 ** rng.uniform(-2, 2)
    law = MemoryLaw(curve, a, b, length, v0, length / young, rest)
    omega, belt = math.sqrt(k / m), Oscillator(m, math.sqrt(k / m), rng.uniform(0, 0.3), v0, load)
    d, level, side, speed, age = belt.damper_kg_per_s, law.static_friction(0.0), 0, 0.0, None
    path = np.convolve(rng.standard_normal(60_000), np.full(6, 0.02 * 6**-0.5), "valid") * (seed % 3 > 0)
    path, spacing, multiplies = path - path[0], 0.3 * belt.F * 10 ** rng.uniform(-2, -0.5), seed // 2 % 2
    mu_s = CubicHermiteSpline(spacing * np.arange(path.size), path, np.gradient(path, spacing))

    def friction(v, theta, s):
        mean = a * math.log(max(v + rest, 0.5 * rest) / v0) + b * math.log1p(theta / young)
        mean += float(curve.mu(max(v, 0.0))) - steady
        return load * max(mean + mu_s(s) * (mean if multiplies else 1.0), 0.0)

    def slip(dt, y):
        force = side * (k * (x + v0 * dt) + d * v0) - k * y[0] - d * y[1]
        return y[1], (force - friction(y[1], math.exp(y[2]), s + y[0])) / m, math.exp(-y[2]) - y[1] / length

    def at_belt(dt, y):
        return y[1]

    at_belt.terminal, at_belt.direction = True, -1.0
    periods = (0.05 * level + b * math.log1p(belt.F / (v0 * young))) * belt.F / belt.V / (2 * math.pi) + 4.0
    options = MotionOptions(1e-10, 8, ("additive", "multiplicative")[multiplies])
    if seed % 3 == 1:  # begins in slip with old or young contacts
        side, age, speed = 1 - 2 * (seed % 2), young * 10 ** rng.uniform(-1, 4), v0 * rng.uniform(0.1, 2)
    start = 0.95 * belt.F * level - d * v0 / k, (v0 - side * speed) / omega if side else belt.V
    run = trajectory(belt, law, path, spacing, periods, options, start, age)
    ends = [*zip(run.motion.kind, run.motion.time, run.motion.position, strict=True)]
    ends = [end for end in ends[abs(side) :] if end[1] < run.time[-1]] + [(None, run.time[-1], run.position[-1])]
    worst, t, x, s, theta = 0.0, 0.0, run.position[0], 0.0, age or 0.0
    for kind, tau, place in ends:
        dt = tau / omega - t
        if side == 0:
            x, theta = x + v0 * dt, theta + dt
            spare = (friction(0.0, theta, s) - k * x - d * v0) / load
            worst, side = max(worst, abs(spare) if kind == DEPARTURE else -spare), 1
        else:
            options = {"rtol": 1e-9, "atol": (1e-11 * belt.F, 1e-10 * min(v0, rest / a), 1e-10), "events": at_belt}
            span, start = (0.0, dt if kind is None else 1.01 * dt), (0.0, speed, math.log(theta))
            whole = solve_ivp(slip, span, start, "Radau", first_step=1e-6 / omega, **options)
            assert whole.status == (kind is not None)
            dt, (slipped, _, log_age), speed = whole.t[-1], whole.y[:, -1], 0.0
            x, s, theta = x + v0 * dt - side * slipped, s + slipped, math.exp(log_age)
            worst, side = max(worst, abs(omega * (t + dt) - tau)), 0 if kind == REATTACHMENT else -side
        worst, t = max(worst, abs(place - x) / belt.F), t + dt
    return worst


@pytest.mark.parametrize("seeds", [(2, 15, 16, 21, 23), pytest.param(range(100), marks=pytest.mark.nightly)])
def test_random_motions_against_radau(seeds):
    """At rtol 1e-9 of Radau and 1e-10 of the motion."""
    assert max(map(against_radau, seeds)) <= 1e-6
