"""How the specimen of a record moves at one speed: it slides, sticks and slips, or swings at its natural frequency.

Stick and slip are irreversible: friction rises slowly and falls fast, many times. A stationary Gaussian scatter, a
monotone transform of one, and slow waves are reversible: rises last as long as falls. Both are counted between turning
points that are far enough apart, in means over several lengths of time. So the rate of samples does not matter, nor
do a few bumps, however high: all teeth weigh the same. A swing without stick is a narrow line of the spectrum.
"""

from __future__ import annotations

import numpy as np
import scipy

SHARES = (0.7, 0.5, 0.35, 0.25)  # of the range of friction, from which a rise or fall counts
MANY = 32  # lengths of a mean, over which drift and slow waves are taken out
FEWEST_TEETH, UNEVEN = 4, 0.5  # least difference in the logarithms of durations: rises last 1.6 times as long
CLEAR, CLEARER, VARIANCE = 2.8, 0.4, 0.25  # standard errors of it, more for e speeds; added to the variance of few
TEETH = 0.7  # that difference in a line of teeth, and not of a swing: rises last twice as long as falls
NEAR, WIDE = 1.2, 3.0  # factors on the frequency of a line, within which it is and with what it is compared
LINE, LEAST_OF_ALL = 0.5, 0.1  # least shares of a line in the variance there, and in all
CYCLES, IN_CYCLE, SEGMENT = 30, 4, 64  # least number of cycles, of samples in one, and in a segment of a spectrum


def motion(runs: list[np.ndarray], interval: float, speeds: int = 1) -> tuple[bool, float]:
    """Whether the specimen sticks and slips, or else the frequency [Hz] at which it swings; 0 where it slides.

    runs : friction [-] at one speed, in parts without a gap; interval : [s] between samples
    speeds : of the record that are judged, one of which may seem uneven by chance

    A line with clearly uneven rises and falls is that of teeth of equal length.
    """
    uneven, frequency = _unevenness(runs, CLEAR + CLEARER * np.log(speeds)), _line(max(runs, key=len), interval)
    sticks = uneven > (TEETH if frequency else 0.0)
    return sticks, 0.0 if sticks else frequency


def _unevenness(runs: list[np.ndarray], clearest: float) -> float:
    """How much longer rises of friction last than falls, in logarithms; 0 below so many standard errors.

    Means over a length are less those over many, which hold drift and slow waves.
    """
    found, length, mean = 0.0, 1, scipy.ndimage.uniform_filter1d
    while length == 1 or 2 * MANY * length <= sum(run.size for run in runs):
        step, long = max(1, length // 4), [run for run in runs if run.size > 2 * length]
        means = [(mean(run, length) - mean(run, MANY * length))[::step] for run in long]
        size = float(np.ptp(np.quantile(np.concatenate(means), [0.02, 0.98]))) if means else 0.0
        for share in SHARES if size > 0.0 else ():
            of_runs = zip(*(_durations(run, share * size) for run in means), strict=True)
            rises, falls = (np.concatenate(of_run) for of_run in of_runs)
            if (teeth := min(rises.size, falls.size)) >= FEWEST_TEETH:
                uneven = float(np.mean(rises) - np.mean(falls))
                clear = uneven / np.sqrt((np.var(rises) + np.var(falls) + VARIANCE) / teeth)
                if clear > clearest and uneven > UNEVEN:
                    found, clearest = uneven, clear
        length *= 2
    return found


def _durations(run: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms of the numbers of steps that rises and falls of at least so much last."""
    sides = (np.append(np.min(side), side) for side in (run, -run))  # the first extreme counts
    tops, feet = (scipy.signal.find_peaks(side, prominence=least)[0] for side in sides)
    turns, is_top = np.append(tops, feet), np.arange(tops.size + feet.size) < tops.size
    order = np.argsort(turns)
    logs, up = np.log(np.diff(turns[order])), np.diff(is_top[order].astype(int))
    return logs[up > 0], logs[up < 0]


def _line(values: np.ndarray, interval: float) -> float:
    """Frequency [Hz] of the narrow line that is most of the variance of values : (n,) nearby; 0 without one."""
    size = min(max(values.size // 4, SEGMENT), values.size)
    frequency, power = scipy.signal.welch(values, 1.0 / interval, nperseg=size, detrend="linear")
    cycles, in_cycle = frequency * interval * values.size, 1.0 / np.maximum(frequency * interval, 1e-9)
    top = frequency[np.argmax(power * frequency * (cycles >= CYCLES) * (in_cycle >= IN_CYCLE))]
    near, wide = (np.sum(power[(frequency > top / by) & (frequency < top * by)]) for by in (NEAR, WIDE))
    return float(top) if near > LINE * wide and near > LEAST_OF_ALL * np.sum(power) else 0.0
