"""Synthetic records: a known curve and process along a course of speeds, as an instrument shows them."""

from __future__ import annotations

import numpy as np

from roughslip.record.process import Window, modes


def scatter_at(
    shape: str, length_m: float, parameters: tuple[float, ...], slipped_m: np.ndarray, generator: np.random.Generator
) -> np.ndarray:
    """A Gaussian path of unit variance at slipped distances : (n,) [m], which do not fall.

    Each mode is an exact recursion. An average over a window is the increment of Brownian motion over it.
    """
    found = modes(shape, length_m, parameters)
    if isinstance(found, Window):
        ends = np.concatenate([slipped_m, slipped_m + found.length])
        order = np.argsort(ends, kind="stable")
        motion = np.empty(ends.size)
        motion[order] = np.cumsum(
            np.sqrt(np.diff(ends[order], prepend=ends[order[0]])) * generator.standard_normal(ends.size)
        )
        return np.asarray((motion[slipped_m.size :] - motion[: slipped_m.size]) / np.sqrt(found.length))
    path = np.zeros(slipped_m.size)
    for rate, variance in zip(*found, strict=True):
        keep = np.exp(-rate * np.diff(slipped_m, prepend=-np.inf))
        kicks = np.sqrt(variance * (1.0 - keep**2)) * generator.standard_normal(keep.size)
        x = 0.0
        for t, (kept, kick) in enumerate(zip(keep, kicks, strict=True)):
            x = kept * x + kick
            path[t] += x
    return path


def through_instrument(values: np.ndarray, memory: np.ndarray) -> np.ndarray:
    """values : (n,) after a first-order low-pass. memory : (n,) exp(-dt / time constant)"""
    shown, level = np.empty(values.size), values[0]
    for t, (value, a) in enumerate(zip(values, memory, strict=True)):
        level = a * level + (1.0 - a) * value
        shown[t] = level
    return shown
