"""When a mass that slips without sticking vibrates, under scattering friction.

A long slip vibrates in a natural period in which half of peak to peak of X is nearer to that of the vibration without
scatter, A, than to that of the linear response to the noise. With as much noise in both, the amplitude R has the
densities of Rayleigh and Rice. They are equal at R = A / 2 up to a term of the noise (S. O. Rice, Bell Syst. Tech. J.
24 (1945) 46), so that the middle is the arithmetic one.

Linear response: about stable sliding X'' + 2 d X' + X = F g mu_S with d = D - D_Hopf, g being 1, or mu_D(v0) where
scatter multiplies. For mu_S of deviation sigma and correlation exp(-a tau), a = V / L, its variance is

    (F g sigma)^2 (2 d + a) / (2 d (1 + 2 d a + a^2)),

that of slow noise for a -> 0 and of white noise for a -> infinity. A sine of that variance has the amplitude L, sqrt(2)
times its root. Where sliding is unstable, d < 0, L is that at -d, as far on the stable side. For averaged motion with
the growth rate -d (1 - (R / A)^2) then has R^2 normal about A^2 with deviation A L, cut at 0 (R. L. Stratonovich,
Topics in the Theory of Random Noise 1, 1963). So for r = L / A the share that vibrates is

    Phi((1 - (1 + r)^2 / 4) / r) / Phi(1 / r):

95 % at r = 0.34, and 59 % where r -> 1. From L = A on, the cycle is hidden by the noise: nothing vibrates, as
without a vibration of the motion without scatter. So with scatter a vibration ends before the Hopf point, at L = A.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from roughslip.errors import ConvergenceError
from roughslip.oscillator.answer_runs import Run, Runs
from roughslip.oscillator.attractors import State, attractors_of
from roughslip.oscillator.limits import growth_of_sliding
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import Trajectory
from roughslip.oscillator.slip_orbit import equilibrium
from roughslip.oscillator.states import States, is_within
from roughslip.validation import gate

TURN = 2.0 * math.pi


@gate
def linear_response(machine: Machine) -> float:
    """Amplitude [m] of the response of steady sliding to the scatter of friction this far from the Hopf point."""
    oscillator, friction = machine.oscillator, machine.scattering
    margin = abs(growth_of_sliding(oscillator, machine.law))
    if margin == 0.0:
        return math.inf
    multiplies = machine.options.scatter == "multiplicative"
    gain = float(machine.law.mu(oscillator.belt_velocity_m_per_s)) if multiplies else 1.0
    rate = oscillator.V / friction.correlation_length_m
    part = (2.0 * margin + rate) / (2.0 * margin * (1.0 + 2.0 * margin * rate + rate**2))
    return math.sqrt(2.0 * part) * oscillator.F * gain * friction.path_deviation


@gate
def least_amplitude(machine: Machine) -> float | None:
    """Half of peak to peak [m] from which slip without sticking is a vibration.

    None where nothing vibrates, or nothing that differs from the response to the scatter, and where slip is too
    stiff to follow: there are two states then.
    """
    try:
        found = attractors_of(machine.oscillator, machine.law)
    except ConvergenceError:
        return None
    vibrations = [one.amplitude for one in (found.from_rest, found.from_sliding) if one.state is State.VIBRATION]
    response = linear_response(machine)
    return 0.5 * (min(vibrations) + response) if vibrations and response < min(vibrations) else None


@gate
def vibrations(drawn: Trajectory, states: States, least: float) -> np.ndarray:
    """(times, 2) [natural periods] beginning and end of each time of vibration in slips without sticking.

    least : [m] as `least_amplitude` gives it; each natural period of a slip is judged, and the rest after the last
    """
    times: list[tuple[float, float]] = []
    for begin, end in states.sliding:
        marks = [*np.arange(begin, max(end - 1.0, begin + 0.5)), end]
        for first, last in pairwise(marks):
            inside = slice(*np.searchsorted(drawn.time, (TURN * first, TURN * last)))
            if drawn.position[inside].size and 0.5 * np.ptp(drawn.position[inside]) > least:
                if first > begin and times and times[-1][1] == first:
                    first = times.pop()[0]
                times.append((float(first), float(last)))
    return np.reshape(times, (-1, 2))


@gate
def vibration_cycles(drawn: Trajectory, times: np.ndarray, machine: Machine) -> np.ndarray:
    """(cycles, 2) half of peak to peak [m] and duration [tau] of each cycle of a vibration, as `whole_cycles` has them.

    times : of the vibration; a cycle lasts from one upward passage of the place of steady sliding to the next
    """
    place, rows = drawn.position - equilibrium(machine.oscillator, machine.law), []
    for begin, end in TURN * times:
        first, last = np.searchsorted(drawn.time, (begin, end))
        ups = first + np.flatnonzero((place[first : last - 1] < 0.0) & (place[first + 1 : last] >= 0.0))
        part = place[ups] / (place[ups] - place[ups + 1])
        passed = drawn.time[ups] + part * (drawn.time[ups + 1] - drawn.time[ups])
        for (a, b), duration in zip(pairwise(ups), np.diff(passed), strict=True):
            rows.append((0.5 * float(np.ptp(place[a : b + 1])), float(duration)))
    return np.reshape(rows, (-1, 2))


def vibrating_runs(
    runs: Runs, of: Mapping[str, Sequence[Run]], starts: Mapping[str, bool]
) -> tuple[dict[str, list[Run]], list[np.ndarray]]:
    """Runs of the own machine by name, their states with times of vibration; its cycles in runs that begin at rest.

    starts : whether those of a name begin in sliding

    Runs that slip for long are drawn again, where the motion without scatter has a vibration.
    """
    own, least = runs.own, least_amplitude(runs.own)
    found, cycles = {name: list(started) for name, started in of.items()}, list[np.ndarray]()
    for name, number in ((name, number) for name, started in of.items() for number in range(len(started))):
        run = found[name][number]
        if least is None or not run.states.sliding.size:
            continue
        start = (equilibrium(own.oscillator, own.law), 0.0) if starts[name] else 0.0
        drawn = runs.drawn(own, runs.path(number), run.motion.duration / TURN, start)
        times = vibrations(drawn, run.states, least)
        found[name][number] = replace(run, states=replace(run.states, vibration=times))
        if not starts[name]:
            cycles.append(vibration_cycles(drawn, times, own))
    return found, cycles


def unsteady_at(runs: Runs, name: str, value: float, numbers: range) -> np.ndarray:
    """(runs,) whether the mass stick-slips or vibrates, from rest, with one parameter at another value."""
    machine, found = runs.own.changed({name: value}), list[bool]()
    least, periods = least_amplitude(machine), runs.periods(machine)
    for number in numbers:
        run = runs.one(machine, number, periods, False)
        found.append(run.cycles)
        if not run.cycles and least is not None and run.states.sliding.size:
            drawn = runs.drawn(machine, runs.path(number), run.motion.duration / TURN)
            found[-1] = is_within(vibrations(drawn, run.states, least), run.looked_at)
    return np.array(found, dtype=bool)
