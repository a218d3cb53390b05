"""Friction with a memory on a mass that a spring pulls at given speeds; the spring shows the friction."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled

GAMMA = 1.0 - np.sqrt(0.5)  # of the diagonally implicit Runge-Kutta method of order 2 that damps what is stiff
SUBSTEP, OF_SPEED, OF_SWING, MOST_SUBSTEPS = 0.2, 0.05, 0.2, 40  # of D_c; of the share of speed that is missing; radian
STEADY, SAME = 1e-4, 1e-3  # of age and speed, below which one step will do; of speeds that are one
MOST_NEWTON, LARGEST, CLOSE = 60, 2.0, 1e-10  # steps; of the logarithm of speed


class Law(NamedTuple):
    """Logarithms of speeds (L,) with steady friction there, b, D_c [m], normal force over stiffness [m] and mass over
    normal force [s^2/m].

    Of several laws (m,) with the same speeds, steady is (m, L) and the others (m,).
    """

    nodes: np.ndarray
    steady: Any
    ageing: Any
    length: Any
    flexibility: Any
    inertia: Any


@compiled()
def followed(steps: np.ndarray, seconds: np.ndarray, speed: np.ndarray, slowest: float, laws: Law) -> np.ndarray:
    """(m, n) friction [-] of m laws at the end of intervals, NaN where none is found.

    steps : (m, n) [m] of the drive in each, negative where steady sliding begins; seconds : (n,) [s]
    speed : (n,) [m/s] of the drive at the end; where it is another one than before, it changed when the step says
    slowest : [m/s] in place of less, for the logarithm. Without flexibility contacts slide as the drive does

    All laws take the time steps of the first, so that differences of neighbours are derivatives.

    Method: E. Hairer & G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. 1996, IV.6.
    """
    friction, states, counts = np.empty(steps.shape), np.zeros((len(steps), 3)), np.ones(2, np.int64)
    for i in range(speed.size):
        drive = np.log(max(speed[i], slowest))
        for j in range(len(steps)):
            law = Law(laws.nodes, laws.steady[j], laws.ageing[j], laws.length[j], laws.flexibility[j], laws.inertia[j])
            if steps[j, i] < 0.0:
                friction[j, i] = _line(drive, law)[0]
                states[j] = law.flexibility * friction[j, i], law.length / np.exp(drive), drive
                continue
            before, now, share = speed[i - 1], steps[j, i] / seconds[i], 0.0  # share of the time at the speed before
            if abs(speed[i] - before) > SAME * max(speed[i], before):
                share = min(max((speed[i] - now) / (speed[i] - before), 0.0), 1.0)
                now = speed[i]
            for part, lasts, mean in ((0, share * seconds[i], before), (1, (1.0 - share) * seconds[i], now)):
                if j == 0:
                    counts[part] = _count(lasts, mean, states[0], law)
                if lasts > 0.0:
                    _slide(lasts, mean, counts[part], states[j], law)
            stretch, age, _ = states[j]
            if law.flexibility > 0.0:
                friction[j, i] = stretch / law.flexibility
            else:
                friction[j, i] = _line(drive, law)[0] + law.ageing * (np.log(age / law.length) + drive)
    return friction


@compiled()
def _count(lasts: float, mean: float, state: np.ndarray, law: Law) -> int:
    """Time steps for a time at one speed of the drive, from a state."""
    _, age, w = state
    away = abs(mean / np.exp(w) - 1.0) if law.flexibility > 0.0 else 0.0
    if abs(age * np.exp(w) / law.length - 1.0) + away < STEADY:
        return 1
    count = lasts * mean / law.length / SUBSTEP + away / OF_SPEED
    swing = OF_SWING * np.sqrt(law.flexibility * law.inertia)  # [s] of a step; much faster swings die out in one
    count += lasts / swing if swing * MOST_SUBSTEPS > lasts else 0.0
    return int(min(count, MOST_SUBSTEPS)) + 1


@compiled()
def _slide(lasts: float, mean: float, count: int, state: np.ndarray, law: Law) -> None:
    """Stretch of the spring [m], age [s] and logarithm of the sliding speed after a time at one speed, in place."""
    stretch, age, w = state
    length, gone = law.length, lasts * mean / law.length
    if law.flexibility <= 0.0:
        state[1] = age + lasts if gone < CLOSE else length / mean + (age - length / mean) * np.exp(-gone)
        return
    h = lasts / count
    part = GAMMA * h
    for _ in range(count):
        start = np.exp(w)
        w = _speed(stretch + part * mean, age + part, start, part, w, law)
        v = np.exp(w)
        age = max(age + (h - part) * (1.0 - v * (age + part) / (length + part * v)), 0.0)
        stretch += h * mean - (h - part) * v
        w = _speed(stretch, age + part, start + (h - part) / part * (v - start), part, w, law)
        stretch -= part * np.exp(w)
        age = length * (age + part) / (length + part * np.exp(w))
    state[:] = stretch, age, w


@compiled()
def _line(w: float, law: Law) -> tuple[float, float]:
    """Steady friction, a line that goes on beyond its ends, and its slope; a constant of one speed."""
    nodes, values = law.nodes, law.steady
    if nodes.size == 1:
        return values[0], 0.0
    i = min(max(int(np.searchsorted(nodes, w)), 1), nodes.size - 1)
    slope = (values[i] - values[i - 1]) / (nodes[i] - nodes[i - 1])
    return values[i] + slope * (w - nodes[i]), slope


@compiled()
def _speed(stretch: float, age: float, free: float, part: float, w: float, law: Law) -> float:
    """Logarithm of the sliding speed at the end of an implicit stage of `part` s, where spring, mass and friction meet.

    stretch : [m] of the spring, and age : [s] of the contacts, if nothing slid in the stage
    free : [m/s] speed of the mass without forces in the stage; w : a first guess
    """
    for _ in range(MOST_NEWTON):
        speed = np.exp(w)
        v = part * speed
        value, slope = _line(w, law)
        value += law.ageing * (np.log(age / (law.length + v)) + w) + law.inertia * (speed - free) / part
        slope += law.ageing * law.length / (law.length + v) + law.inertia * speed / part
        change = (stretch - v - law.flexibility * value) / (v + law.flexibility * slope)
        w += min(max(change, -LARGEST), LARGEST)
        if abs(change) < CLOSE:
            return w
    return np.nan
