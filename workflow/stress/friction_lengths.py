"""The judge of exponentials fitted to autocorrelations: losses on a table of lengths, and plain searches along lags."""

from __future__ import annotations

import math

import numpy as np

from roughslip.friction.correlation import CorrelationFit
from roughslip.probability import Estimate
from workflow.stress.friction_judge import Met, interval

TRIALS = 4001
THREE, HALF = 3.0, 0.5  # windows, up to which lags enter


def judge(lags: np.ndarray, curve: Estimate, window: float, found: CorrelationFit) -> Met:
    """Lengths by four recipes, the misfits, and whether a length is at the end of its range.

    lags : (K,) [m] of the autocorrelation; window [m]
    """
    used, near = (int(np.sum(lags <= share * window * (1 + 1e-9))) for share in (THREE, HALF))
    lags = lags[:used]
    met: Met = {}
    for name in ("least_squares", "half_window", "one_over_e", "integral", "misfit_difference"):
        met |= {f"{name}: {what}": limits for what, limits in interval(getattr(found, name)).items()}
    triangle = np.maximum(1 - lags / window, 0)
    for row in (0, len(curve.rows) - 1):
        r = curve.rows[row, :used]
        whole, half = (float(getattr(found, name).rows[row]) for name in ("least_squares", "half_window"))
        loss = float(np.mean((np.exp(-lags / whole) - r) ** 2))
        met |= {
            f"no better length, row {row}": (_loss(lags, r, whole) - _least(lags, r), _slack(r)),
            f"half a window, row {row}": (
                _loss(lags[:near], r[:near], half) - _least(lags[:near], r[:near]),
                _slack(r),
            ),
            f"1/e, row {row}": (abs(float(found.one_over_e.rows[row]) - _one_over_e(lags, r)) / lags[-1], 1e-12),
            f"integral, row {row}": (
                abs(float(found.integral.rows[row]) - float(np.sum(0.5 * (r[1:] + r[:-1]) * np.diff(lags)))) / lags[-1],
                1e-12 * (1 + np.abs(r).max()),
            ),
            f"misfit, row {row}": (abs(float(found.misfit_exponential.rows[row]) ** 2 - loss), 1e-12 * (1 + loss)),
            f"misfit of the triangle, row {row}": (
                abs(float(found.misfit_triangle.rows[row]) ** 2 - np.mean((triangle - r) ** 2)),
                1e-12 * (1 + float(np.mean(r**2))),
            ),
        }
    ends = float(found.least_squares.value) / (100 * lags[-1]), lags[1] / 20 / float(found.least_squares.value)
    met["told at a bound"] = (float((max(ends) > 1 - 1e-9) != found.at_bound), 0)
    return met


def _loss(lags: np.ndarray, r: np.ndarray, length: float) -> float:
    return float(np.sum((np.exp(-lags / length) - r) ** 2))


def _least(lags: np.ndarray, r: np.ndarray) -> float:
    """On a table of lengths from a 20th of the first lag to 100 times the last."""
    lengths = np.geomspace(lags[1] / 20, 100 * lags[-1], TRIALS)
    return float(np.min(np.sum((np.exp(-lags / lengths[:, None]) - r) ** 2, axis=1)))


def _slack(r: np.ndarray) -> float:
    return 1e-9 * (1 + float(np.sum(r**2)))


def _one_over_e(lags: np.ndarray, r: np.ndarray) -> float:
    """The first crossing of 1/e, walked to from lag to lag; the last lag without one."""
    for k in range(1, len(r)):
        if r[k] < math.exp(-1):
            share = (r[k - 1] - math.exp(-1)) / (r[k - 1] - r[k])
            return float(lags[k - 1] + share * (lags[k] - lags[k - 1]))
    return float(lags[-1])
