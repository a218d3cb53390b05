"""Machines: what is said of them without a long run, each judged by SciPy's integrator or by runs.

Laws have humps, belts are slow, and damping ratios lie about the Hopf and the existence limit, some within 1e-6. The
first loop of slip is integrated anew on both sides of the limit. Answers and budgets are compared with their limits for
scatter that is small against the distance, theory with the ends of states that runs show.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.friction import Friction
from roughslip.oscillator.answers import answer
from roughslip.oscillator.budget import uncertainty_budget
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.grazing import grazing_response
from roughslip.oscillator.laws import CoulombLaw, FrictionLaw, StribeckLaw
from roughslip.oscillator.limits import existence_limit, hopf_damping, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.states import Durations, run_until_known
from roughslip.oscillator.table_law import TableLaw, friction_law
from tests.properties.campaign import Trial, choose, log_uniform

KINDS = ("stribeck", "coulomb", "table", "hump", "fall")
PLACES = ("hopf", "existence", "hopf-nearly", "existence-nearly", "any")
NEARLY, LEAST = 1e-6, 1e-9  # relative distance from a limit at which both sides are known; absolute
OF_FUNCTIONS = 2e-8  # of static friction, by which the table of a law that is a function errs
RUNS, PERIODS = 3, 1000.0  # that show the ends of states, from rest: a start in sliding would count as one that begins
FACTOR = 12.0  # of a rate by theory: at most 3 where it was compared with splitting
ENOUGH = 25.0  # ends


def attempt(trial: Trial) -> None:
    """Draw a machine, judge its limits, its cycle, its theory, its answer and its budget."""
    rng = trial.rng
    omega, mass = log_uniform(rng, 0, 4), log_uniform(rng, -3, 3)
    belt, per_belt = log_uniform(rng, -6, 0), log_uniform(rng, -1, 2.5)  # V [m] and F / V
    static = log_uniform(rng, -1.5, 0)
    law, mu = draw_law(trial, static, belt * omega)
    oscillator = Oscillator(mass, omega, 0.1, belt * omega, belt * per_belt * mass * omega**2)
    h = 1e-4 * belt * omega
    slope = (mu(belt * omega + h) - mu(belt * omega - h)) / (2 * h)
    hopf = hopf_damping(oscillator, law)
    slack = 1e-3 * oscillator.F * omega * static / (belt * omega)
    trial.check("Hopf limit", abs(hopf + 0.5 * oscillator.F * omega * slope), slack)
    trial.answers = (ConvergenceError,)
    try:
        limit = existence_limit(oscillator, law)
    except IllPosedError:
        limit = 0.0
        trial.check("no cycle without damping", first_peak(oscillator, law, mu, NEARLY), 1.0 + NEARLY)
    of_law = 2.0 * math.pi * OF_FUNCTIONS * static * per_belt * (trial.case["law"] in ("hump", "fall"))
    for side in (-1.0, 1.0) if limit > LEAST else ():
        peak = first_peak(oscillator, law, mu, limit + side * max(NEARLY * limit, LEAST))
        trial.check(f"loop beyond the limit, {side:+g}", side * (peak - 1.0), of_law)
    place = choose(rng, PLACES)
    near = max(hopf if place.startswith("hopf") else limit, 0.0) if place != "any" else 0.0
    factor = 1.0 + (NEARLY if place.endswith("nearly") else 0.1) * rng.uniform(-1, 1)
    oscillator = replace(oscillator, damping_ratio=factor * near or log_uniform(rng, -3, 0))
    trial.case |= {"place": place, "F/V": per_belt, "D": oscillator.damping_ratio, "limit": limit, "hopf": hopf}
    length = 2 * math.pi * belt * log_uniform(rng, -2, 1)
    friction = Friction(static, static * log_uniform(rng, -3, -0.5), length, multiplies=rng.random() < 0.3)
    judge_scatter(trial, Machine(oscillator, law, friction), limit, hopf)


def judge_scatter(trial: Trial, machine: Machine, limit: float, hopf: float) -> None:
    """Check what scatter makes of a machine."""
    ratio = machine.oscillator.damping_ratio
    slip_loop(machine.oscillator, machine.law)
    found = answer(machine, 72, 20.0 * choose(trial.rng, (1, 1, 10)), ("damping",) if trial.rng.random() < 0.2 else ())
    budget, theory = uncertainty_budget(lambda _: machine, (), limits=()), found.durations_by_theory
    for values in (theory.stick_slip, theory.sliding, theory.birth) if theory else ():
        assert not np.any(values < 0.0), "a negative duration"
    if limit == 0.0:
        trial.check("probability without a limit", budget.probability.value, 0.0)
        return
    blur = machine.scattering.path_deviation * grazing_response(machine).scatter(machine.scattering.autocorrelation)
    distance = (limit - ratio) / blur
    trial.case["distance"] = distance
    wanted = 0.5 * math.erfc(-distance / math.sqrt(2.0))
    trial.check("probability of the budget", abs(budget.probability.value - wanted), 1e-6)
    if distance > 40.0 and ratio < 0.5 * hopf:
        trial.check("certain stick-slip", 1.0 - found.probability.value, 0.05)
    if distance < -40.0 and ratio > 2.0 * max(limit, hopf):
        trial.check("certain sliding", found.probability.value, 0.05)
    if theory:
        judge_theory(trial, machine, theory)


def judge_theory(trial: Trial, machine: Machine, theory: Durations) -> None:
    """Check mean durations by theory against the ends of states in runs, as far as these are many or should be."""
    paths = [machine.kept_path([number]) for number in range(RUNS)]
    runs = [run_until_known(machine, path, machine.paths.spacing, PERIODS)[2] for path in paths]
    for name, mean in (("stick_slip", theory.stick_slip[0]), ("sliding", theory.sliding[0])):
        if math.isnan(mean):
            continue
        expected = sum(float(np.diff(getattr(run, name)).sum()) for run in runs) / mean
        ends = sum(np.count_nonzero(getattr(run, f"{name}_ended")) for run in runs)
        trial.check(f"{name}: ends more often than by theory", ends - ENOUGH, FACTOR * expected)
        trial.check(f"{name}: ends less often than by theory", expected / FACTOR - ENOUGH, ends)


def draw_law(trial: Trial, static: float, speed: float) -> tuple[FrictionLaw, Callable[[float], float]]:
    """A law, and its coefficient in slip by the judge. speed : [m/s] of the belt"""
    rng = trial.rng
    kind, knee, kinetic = choose(rng, KINDS), speed * log_uniform(rng, -1, 1), static * rng.uniform(0.3, 1.0)
    trial.case["law"] = kind
    if kind == "coulomb":
        return CoulombLaw(kinetic, static), lambda v: kinetic
    if kind == "stribeck":
        rise = static * log_uniform(rng, -4, -1) / speed**2
        own = StribeckLaw(kinetic, static, 1 / knee, rise)
        return own, lambda v: kinetic / (1 + abs(v) / knee) + static - kinetic + rise * v * v
    if kind == "table":
        knots = np.append(0.0, np.cumsum(rng.uniform(0.1, 1.0, 6))) * speed
        values = static * np.append(rng.uniform(0.8, 1.0), rng.uniform(0.3, 1.0, 6))
        curve = PchipInterpolator(knots, values)
        return TableLaw(tuple(knots), tuple(values), static), lambda v: float(curve(min(abs(v), knots[-1])))
    height, width = (static - kinetic) * rng.uniform(-0.6, 0.9), rng.uniform(0.3, 1.0)
    height = max(height, -0.5 * kinetic) * (kind == "hump")  # the hump is at most 1.7 high

    def mu(v: float) -> float:
        x = abs(v) / knee
        return kinetic + 0.9 * (static - kinetic) * math.exp(-x) + height * x * math.exp(-(((x - 1.5) / width) ** 2))

    return friction_law(mu, static=static), mu


def first_peak(oscillator: Oscillator, law: FrictionLaw, mu: Callable[[float], float], ratio: float) -> float:
    """X' / V at the first peak of slip from the departure point, where friction beyond the belt is mu(|v|); else 0."""
    per_belt, v0 = oscillator.F / oscillator.V, oscillator.belt_velocity_m_per_s

    def rate(_: float, z: np.ndarray) -> tuple[float, float]:
        return z[1], per_belt * max(mu(v0 * (1.0 - z[1])), 0.0) - 2.0 * ratio * z[1] - z[0]

    def turns(tau: float, z: np.ndarray) -> float:
        return rate(tau, z)[1]

    turns.terminal, state = True, (per_belt * law.static - 2.0 * ratio, 1.0)
    for turns.direction in (1.0, -1.0):  # from the trough on
        end = solve_ivp(rate, (0.0, 1e3), state, "LSODA", rtol=1e-12, atol=1e-13, events=turns, first_step=1e-3)
        if not end.t_events[0].size:
            return 0.0
        state = end.y_events[0][0]
    return float(state[1])
