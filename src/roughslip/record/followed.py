"""Friction with a memory under a drive of given speeds, pulled through a spring without mass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled

GAMMA = 1.0 - np.sqrt(0.5)  # of the diagonally implicit Runge-Kutta method of order 2 that damps what is stiff
SUBSTEP, MOST_SUBSTEPS, STEADY = 0.2, 40, 1e-4  # of D_c; of age and speed, below which one step will do
MOST_NEWTON, LARGEST, CLOSE = 60, 2.0, 1e-10  # steps; of the logarithm of speed


class Law(NamedTuple):
    """Logarithms of speeds (L,) with steady friction there, b, D_c [m], and normal force over stiffness [m]."""

    nodes: np.ndarray
    steady: np.ndarray
    ageing: float
    length: float
    flexibility: float


@compiled()
def followed(step: np.ndarray, seconds: np.ndarray, speed: np.ndarray, slowest: float, law: Law) -> np.ndarray:
    """(n,) friction [-] at the end of intervals, in which the drive has one speed; NaN where none is found.

    step : (n,) [m] of the drive in each, negative where steady sliding begins; seconds : (n,) [s]
    speed : (n,) [m/s] of the drive at the end, at least `slowest`; without flexibility contacts slide with it

    Method: E. Hairer & G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. 1996, IV.6.
    """
    friction, stretch, age, w = np.empty(step.size), 0.0, 0.0, 0.0
    length, flexibility = law.length, law.flexibility
    for i in range(step.size):
        drive = np.log(max(speed[i], slowest))
        if step[i] < 0.0:
            w, age = drive, length / np.exp(drive)
            friction[i] = _line(w, law)[0]
            stretch = flexibility * friction[i]
            continue
        mean, gone = step[i] / seconds[i], step[i] / length
        if flexibility <= 0.0:
            age = age + seconds[i] if gone < CLOSE else length / mean + (age - length / mean) * np.exp(-gone)
            friction[i] = _line(drive, law)[0] + law.ageing * (np.log(age / length) + drive)
            continue
        is_steady = abs(age * np.exp(w) / length - 1.0) + abs(mean / np.exp(w) - 1.0) < STEADY
        count = 1 if is_steady else min(int(gone / SUBSTEP) + 1, MOST_SUBSTEPS)
        h = seconds[i] / count
        part = GAMMA * h
        for _ in range(count):
            w = _speed(stretch + part * mean, age + part, part, w, law)
            v = np.exp(w)
            age = max(age + (h - part) * (1.0 - v * (age + part) / (length + part * v)), 0.0)
            stretch += h * mean - (h - part) * v
            w = _speed(stretch, age + part, part, w, law)
            stretch -= part * np.exp(w)
            age = length * (age + part) / (length + part * np.exp(w))
        friction[i] = stretch / flexibility
    return friction


@compiled()
def _line(w: float, law: Law) -> tuple[float, float]:
    """Steady friction, a line that goes on beyond its ends, and its slope; a constant of one speed."""
    nodes, values = law.nodes, law.steady
    if nodes.size == 1:
        return values[0], 0.0
    i = min(max(np.searchsorted(nodes, w), 1), nodes.size - 1)
    slope = (values[i] - values[i - 1]) / (nodes[i] - nodes[i - 1])
    return values[i] + slope * (w - nodes[i]), slope


@compiled()
def _speed(stretch: float, age: float, part: float, w: float, law: Law) -> float:
    """Logarithm of the sliding speed at which the spring bears friction at the end of an implicit stage of `part` s.

    stretch : [m] of the spring, and age : [s] of the contacts, if nothing slid in the stage; w : a first guess
    """
    for _ in range(MOST_NEWTON):
        v = part * np.exp(w)
        value, slope = _line(w, law)
        value += law.ageing * (np.log(age / (law.length + v)) + w)
        slope += law.ageing * law.length / (law.length + v)
        change = (stretch - v - law.flexibility * value) / (v + law.flexibility * slope)
        w += min(max(change, -LARGEST), LARGEST)
        if abs(change) < CLOSE:
            return w
    return np.nan
