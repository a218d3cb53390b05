"""The correlation of two translated normal variables, by a double integral: what Mehler's series is judged by.

Trapezoidal rule for both variables, on a cubic spline through the quantile function; everything once more with half the
nodes tells the error.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

EDGE, NODES, TABLE = 9.0, 201, 4097
FINE = 2**15 + 1
SAFE = 10.0  # times the change from half the nodes
ROUNDING = 1e-12

Quantile = Callable[[np.ndarray], np.ndarray]  # of the normal score


def pair_correlation(quantile: Quantile, rho: np.ndarray) -> tuple[np.ndarray, float]:
    """Correlation (n,) of quantile(g) and quantile(h), g and h of correlations rho : (n,), and the largest error."""
    table = np.linspace(-1.5 * EDGE, 1.5 * EDGE, TABLE)
    values = quantile(table)
    whole, half = (_integrals(CubicSpline(table[::s], values[::s]), rho, (NODES - 1) // s + 1) for s in (1, 2))
    return whole, SAFE * float(np.abs(whole - half).max()) + ROUNDING


def left_out(quantile: Quantile, terms: int) -> float:
    """Share of the variance beyond so many Hermite polynomials."""
    g = np.linspace(-EDGE, EDGE, FINE)
    weight = np.exp(-0.5 * g**2)
    weight /= weight.sum()
    z = quantile(g)
    z = z - weight @ z
    before, now, carried = np.ones_like(g), g.copy(), 0.0
    for n in range(1, terms + 1):
        carried += float(weight @ (z * now)) ** 2
        before, now = now, (g * now - np.sqrt(n) * before) / np.sqrt(n + 1.0)
    return abs(1.0 - carried / float(weight @ z**2))


def _integrals(spline: CubicSpline, rho: np.ndarray, nodes: int) -> np.ndarray:
    g = np.linspace(-EDGE, EDGE, nodes)
    weight = np.exp(-0.5 * g**2)
    weight /= weight.sum()
    z = spline(g)
    mean = float(weight @ z)
    z = z - mean
    variance = float(weight @ z**2)
    found = np.empty(len(rho))
    for k, r in enumerate(rho):
        other = spline(np.clip(r * g[:, None] + np.sqrt(max(1.0 - r**2, 0.0)) * g, -1.5 * EDGE, 1.5 * EDGE)) - mean
        found[k] = (weight * z) @ (other @ weight) / variance
    return found
