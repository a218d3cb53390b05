"""Friction with a memory under a drive of given speeds, pulled through a spring without mass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled

GAMMA = 1.0 - np.sqrt(0.5)  # of the diagonally implicit Runge-Kutta method of order 2 that damps what is stiff
SUBSTEP, OF_SPEED, MOST_SUBSTEPS = 0.2, 0.05, 40  # of D_c; of the share of speed that is missing
STEADY, SAME = 1e-4, 1e-3  # of age and speed, below which one step will do; of speeds that are one
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
    """(n,) friction [-] at the end of intervals, NaN where none is found.

    step : (n,) [m] of the drive in each, negative where steady sliding begins; seconds : (n,) [s]
    speed : (n,) [m/s] of the drive at the end; where it is another one than before, it changed when the step says
    slowest : [m/s] in place of less, for the logarithm. Without flexibility contacts slide as the drive does

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
        before, now, share = speed[i - 1], step[i] / seconds[i], 0.0  # share of the interval at the speed before
        if abs(speed[i] - before) > SAME * max(speed[i], before):
            share = min(max((speed[i] - now) / (speed[i] - before), 0.0), 1.0)
            now = speed[i]
        for lasts, mean in ((share * seconds[i], before), ((1.0 - share) * seconds[i], now)):
            if lasts > 0.0:
                stretch, age, w = _slid(lasts, mean, stretch, age, w, law)
        if flexibility > 0.0:
            friction[i] = stretch / flexibility
        else:
            friction[i] = _line(drive, law)[0] + law.ageing * (np.log(age / length) + drive)
    return friction


@compiled()
def _slid(lasts: float, mean: float, stretch: float, age: float, w: float, law: Law) -> tuple[float, float, float]:
    """Stretch of the spring [m], age [s] and logarithm of the sliding speed after a time at one speed of the drive."""
    length, gone = law.length, lasts * mean / law.length
    if law.flexibility <= 0.0:
        return stretch, age + lasts if gone < CLOSE else length / mean + (age - length / mean) * np.exp(-gone), w
    away = abs(mean / np.exp(w) - 1.0)
    is_steady = abs(age * np.exp(w) / length - 1.0) + away < STEADY
    count = 1 if is_steady else int(min(gone / SUBSTEP + away / OF_SPEED, MOST_SUBSTEPS)) + 1
    h = lasts / count
    part = GAMMA * h
    for _ in range(count):
        w = _speed(stretch + part * mean, age + part, part, w, law)
        v = np.exp(w)
        age = max(age + (h - part) * (1.0 - v * (age + part) / (length + part * v)), 0.0)
        stretch += h * mean - (h - part) * v
        w = _speed(stretch, age + part, part, w, law)
        stretch -= part * np.exp(w)
        age = length * (age + part) / (length + part * np.exp(w))
    return stretch, age, w


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
