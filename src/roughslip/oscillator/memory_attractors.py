"""Where motion without scatter ends where the contact has a memory: by following it, as its slip has three variables.

All departures from stick lie on a line: the place of the mass gives the limit of stick, and that the age of the
contacts. So stick-slip is settled where two departures are alike. Slip that does not stick is followed from extreme to
extreme, until its swings are alike. Where they are small, the growth of small motions decides (`slip_orbit`).

A run is bounded. Where swings still shrink at its end, it ends in steady sliding if that is stable, else in a
vibration. Where they still grow from sliding, it ends where motion from rest does. So a limit at which a vibration
begins or ends is right to about one over the swings that were followed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from roughslip.errors import ConvergenceError
from roughslip.oscillator.equation import Coefficients, Oscillator, coefficients
from roughslip.oscillator.event_loop import HELD, UPPER, RunState
from roughslip.oscillator.memory_law import MemoryLaw, steady_psi
from roughslip.oscillator.memory_motion import MemoryState, continue_with_memory, start_at, stick_left, stuck
from roughslip.oscillator.path import Path
from roughslip.oscillator.slip import Horizon, Samples, Status
from roughslip.oscillator.slip_orbit import equilibrium, growth_rates

TURN = 2.0 * math.pi
NO_PATH = Path(np.zeros(0), 0, 1.0, True)
AT_REST = MemoryState(0.0, 0.0, 0.0, 0.0, 0.0)  # on the belt, with a relaxed spring and fresh contacts
TOLERANCE = 1e-6  # of the steps: moves limits by 1e-6
ALIKE = 1e-5  # relative, of departures and of swings
DISTURBED, SMALL = 0.05, 0.01  # of the belt's velocity: the first swing from sliding, and one that growth decides
TURNS, LOADINGS = 10.0, 1.0  # natural periods and times of loading that are followed at once
PER_TURN, MOST_SAMPLES = 64, 2**15
MOST_STRETCHES, MOST_STEPS = 24, 1_000_000
FEWEST = 7  # extremes, whose last swings are compared


@dataclass(frozen=True)
class Ending:
    """Where a motion without scatter ends.

    cycle : (5,) of stick-slip, the fields of `limits.LimitCycle`; None where it does not stick
    amplitude : [m] half of peak to peak of the displacement; 0 in steady sliding
    period : [-] of a cycle in tau; NaN in steady sliding
    fastest : [m/s] largest sliding speed
    loop : [natural periods] of the slip of the cycle; else of the first loop of slip, 0 without one
    """

    cycle: tuple[float, ...] | None
    amplitude: float
    period: float
    fastest: float
    loop: float


class Stretch(NamedTuple):
    """A part of a motion: how it ends; times, X, X' of samples; fastest [m/s]."""

    run: RunState
    time: np.ndarray
    x: np.ndarray
    u: np.ndarray
    fastest: float


@lru_cache(maxsize=4096)
def ending(oscillator: Oscillator, law: MemoryLaw, from_sliding: bool = False) -> Ending:
    """Where the motion without scatter ends, from rest on the belt, or from sliding that is disturbed a little.

    Raises ParameterError with excitation or a belt at rest, ConvergenceError where the steps do not suffice.
    """
    p, stable = coefficients(oscillator, law), bool(growth_rates(oscillator, law)[0].real <= 0.0)
    v0, level = oscillator.belt_velocity_m_per_s, equilibrium(oscillator, law)
    found = slides = Ending(None, 0.0, math.nan, v0, 0.0)
    if from_sliding and stable:
        return slides
    y, tau, sigma, before = departure(AT_REST, p), TURNS * TURN + LOADINGS * level / p.V, UPPER, math.nan
    if from_sliding:
        y = MemoryState(0.0, level, 0.0, p.V * (1.0 - DISTURBED), float(steady_psi(v0, p.law)))
    for _ in range(MOST_STRETCHES):
        part = stretch(y, sigma, tau, p)
        y, sigma, held = part.run.y, part.run.sigma, part.run.sigma == HELD
        if held:
            y, sigma = departure(y, p), UPPER
        if held and part.run.backwards:
            found = _cycle(part, y, p)
            if abs(y.x - before) <= ALIKE * found.amplitude:
                return found
            before = y.x
            continue
        slides, before = replace(slides, loop=slides.loop or _first_loop(part)), math.nan
        times, places = extremes(part)
        swings = np.abs(np.diff(places))
        if stable and np.max(np.abs(part.u[part.u.size // 2 :])) < SMALL * p.V:
            return slides
        if places.size < FEWEST:
            tau *= 2.0
            continue
        amplitude, period = 0.5 * float(swings[-1]), float(times[-1] - times[-3])
        found = replace(slides, amplitude=amplitude, period=period, fastest=part.fastest)
        if abs(swings[-1] / swings[-5] - 1.0) <= ALIKE:
            return found
        if stable and swings[-1] < swings[-5]:
            found = slides
    return ending(oscillator, law) if from_sliding and found.cycle is None else found  # as far as it may still grow


def departure(y: MemoryState, p: Coefficients) -> MemoryState:
    """The state at the end of the stick that begins at y, with time and slip counted from there."""
    return stuck(y, stick_left(y, NO_PATH, p), p)._replace(tau=0.0, s=0.0)


def stretch(y: MemoryState, sigma: int, tau: float, p: Coefficients) -> Stretch:
    """Slip from y on, for a time tau, or until the mass sticks after it moved backwards."""
    size = min(math.ceil(tau * PER_TURN / TURN), MOST_SAMPLES)
    samples = Samples(tau / size, np.full(size, np.nan), np.full(size, np.nan))
    samples.x[0], samples.u[0] = y.x, p.V - sigma * y.w
    run, events = start_at(y._replace(tau=0.0, s=0.0), sigma, p)
    status, run, _ = continue_with_memory(run, events, NO_PATH, p, TOLERANCE, Horizon(tau, MOST_STEPS, 0.0), samples)
    if status in (Status.STEPS_OVER, Status.STEP_LOST):
        reason = f"slip without scatter takes more than {run.steps} steps: raise the rest speed or the memory length"
        keys = "oscillator.memory.rest_speed_m_per_s, oscillator.memory.memory_length_m"
        raise ConvergenceError(reason, scene_keys=keys, residual=run.y.tau, work=run.steps)
    time = samples.interval * np.flatnonzero(kept := np.isfinite(samples.x))
    x, u = samples.x[kept], samples.u[kept]
    return Stretch(run, time, x, u, p.omega * float(np.max(np.abs(p.V - u))))


def extremes(part: Stretch) -> tuple[np.ndarray, np.ndarray]:
    """Times and places of the extremes of X between samples, by the cubic that has their X and X'."""
    x, u = part.x, part.u
    at = np.flatnonzero(u[:-1] * u[1:] < 0.0)
    t, h = u[at] / (u[at] - u[at + 1]), part.time[at + 1] - part.time[at]
    place = x[at] * (1 + 2 * t) * (1 - t) ** 2 + x[at + 1] * t**2 * (3 - 2 * t)
    return part.time[at] + t * h, place + h * (u[at] * t * (1 - t) ** 2 - u[at + 1] * t**2 * (1 - t))


def _cycle(part: Stretch, left: MemoryState, p: Coefficients) -> Ending:
    """The cycle of a slip that sticks, up to the next departure."""
    (_, places), end = extremes(part), part.run.y
    slip, stick = end.tau, (left.x - end.x) / p.V
    low, high = float(places.min(initial=end.x)), float(places.max(initial=left.x))
    found = (left.x, end.x, slip, slip + stick, end.s)
    return Ending(found, 0.5 * (high - low), slip + stick, part.fastest, slip / TURN)


def _first_loop(part: Stretch) -> float:
    """Natural periods from the beginning of slip to the first peak of X' after a trough; 0 without one."""
    rises = np.diff(part.u) > 0.0
    trough = int(np.argmax(rises)) if rises.any() else rises.size
    falls = ~rises[trough:]
    return float(part.time[trough + int(np.argmax(falls))]) / TURN if falls.any() else 0.0
