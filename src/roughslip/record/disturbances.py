"""What a record holds that the model of its scatter does not: noise in the speed, and scatter that repeats each turn.

Whitening differentiates the speed, and noise of a regressor flattens a slope (errors in variables: R. J. Carroll et
al., Measurement Error in Nonlinear Models, 2006, ch. 3 and 5). A median keeps ramps and steps of the speed as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy
from scipy.ndimage import median_filter, uniform_filter1d

from roughslip.record.curve import FrictionCurve
from roughslip.record.likelihood import SlidingSamples

LEAST_NOISE = 2e-3  # of the speed, below which it is left as measured
WINDOWS, FEWEST = (5, 11, 23, 47, 95, 191), 20  # samples in a window of medians, and windows in all records
MORE = 1.1  # times the noise between neighbours
UNBEARABLE = 2.0  # standard errors
LEAST = 4  # harmonics after the first
_deviation = partial(scipy.stats.median_abs_deviation, scale="normal")


def without_noise(samples: SlidingSamples) -> tuple[SlidingSamples, int, float]:
    """Samples with medians of the speed, the window in samples, and the deviation of the noise over the speed.

    The noise is that of samples about the means of their neighbours. The window grows as long as it takes out no more.
    """
    speed, found = samples.speed, (samples, 1, 0.0)
    noise = _deviation((speed[:-2] + speed[2:]) / speed[1:-1]) / np.sqrt(6.0)
    for window in WINDOWS:
        smooth = medians(samples, speed, window)
        if noise < LEAST_NOISE or FEWEST * window > speed.size or _deviation(speed / smooth) > MORE * noise:
            break
        change = uniform_filter1d(np.gradient(smooth) / samples.seconds, window)
        found = replace(samples, speed=smooth, change=change), window, noise
    return found


def with_noise(
    curve_of: Callable[[SlidingSamples], FrictionCurve], samples: SlidingSamples, window: int, noise: float
) -> tuple[FrictionCurve, list[str]]:
    """The curve of samples with how far the same noise moves it once more as a further error, and notes."""
    curve = curve_of(samples)
    if noise == 0.0:
        return curve, []
    again = samples.speed * np.exp(noise * np.random.default_rng(0).standard_normal(samples.speed.size))
    other = curve_of(replace(samples, speed=medians(samples, again, window)))
    moved = np.interp(curve.speeds_m_per_s, other.speeds_m_per_s, other.friction) - curve.friction
    errors = float(np.max(np.abs(moved) / np.linalg.norm(curve.factor, axis=1)))
    note = f"the speed has white noise of {noise:.1%}, and medians of {window} samples take its place"
    if errors > UNBEARABLE:
        note += f"; what is left moves the curve by {errors:.1f} standard errors: smooth the speed, or change it slower"
    at_rest = np.append(curve.factor_at_rest, other.at_rest - curve.at_rest)
    return replace(curve, factor=np.column_stack([curve.factor, moved]), factor_at_rest=at_rest), [note]


def medians(samples: SlidingSamples, speed: np.ndarray, window: int) -> np.ndarray:
    """(n,) [m/s] medians of a speed over windows within each record."""
    return np.concatenate([median_filter(speed[part], window, mode="nearest") for part in samples.records])


def repetition(
    samples: SlidingSamples, residual: np.ndarray, turn_m: float, length_m: float, first: int
) -> tuple[float, float]:
    """Share of the variance of a residual : (n,) that repeats each turn, and the p-value that none does.

    Power at harmonics of the turn is compared with power between them, from the first harmonic given to waves of two
    correlation lengths, by an analysis of variance between and within turns of the longest record. NaN below two turns.
    """
    last = int(min(max(0.5 * turn_m / length_m, first + LEAST), 0.5 * turn_m / np.max(samples.step)))
    parts = samples.records
    places = [samples.slipped[part] for part in parts]
    longest = int(np.argmax([np.ptp(place) for place in places]))
    turns = int(np.ptp(places[longest]) / turn_m)
    if turns < 2 or last < first:
        return np.nan, np.nan
    even = places[longest][0] + np.arange(4 * last * turns) * turn_m / (4 * last)
    harmonic = np.arange(first * turns - turns // 2, (last + 1) * turns - turns // 2)
    flat = 1.0 + (2.0 * np.pi * harmonic / turns * length_m / turn_m) ** 2  # of the fitted scatter
    powers = flat * np.abs(np.fft.rfft(np.interp(even, places[longest], residual[parts[longest]]))[harmonic]) ** 2
    of_turn = float(np.sum(powers[turns // 2 :: turns]))
    ratio = of_turn * (turns - 1) / (float(np.sum(powers)) - of_turn)
    freedom = 2.0 * (last - first + 1)
    return (ratio - 1.0) / (ratio - 1.0 + turns), float(scipy.stats.f.sf(ratio, freedom, freedom * (turns - 1)))
