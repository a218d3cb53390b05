"""The translation of a Gaussian process to a marginal, and what it does to the autocorrelation.

With normalised Hermite polynomials mu(z) = sum_n c_n h_n(z), and normal variables of correlation r give mu the
correlation f(r) = sum_n w_n r^n, w_n = c_n^2 / sum c^2 (M. Grigoriu, J. Eng. Mech. 110 (1984) 610-620).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.compilation import compiled
from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.friction.process import Marginal

TABLE_EDGE, TABLE_NODES = 8.5, 2**12 + 1  # normal quantiles; beyond the edge lies a probability of 2e-17
MOST_TERMS = 200  # of the Hermite series
LEFT_OUT = 1e-4  # share of the variance that the Hermite series may leave out


@dataclass(frozen=True, eq=False)
class Translation:
    """A marginal as a table over normal scores, and the shares of its Hermite series.

    normal, friction : (table,) [-] standard normal scores, equally spaced, and mu_S there
    table_error : [-] bound of the error of mu_S by linear interpolation in the table
    weights : (N,) [-] w_1, w_2, ..., scaled to sum to one
    left_out : [-] share of the variance that they left out before
    """

    normal: np.ndarray
    friction: np.ndarray
    table_error: float
    weights: np.ndarray
    left_out: float

    def apply(self, z: np.ndarray) -> np.ndarray:
        """mu_S : (nodes,) [-] at the standard normal scores z."""
        return translated(z, self.normal, self.friction)

    def correlation(self, gaussian: np.ndarray) -> np.ndarray:
        """f(r) : (as gaussian) [-] autocorrelation of mu_S where that of z is r."""
        return np.polynomial.Polynomial(np.concatenate(([0.0], self.weights)))(gaussian)

    def gaussian_correlation(self, target: np.ndarray) -> np.ndarray:
        """r : (as target) [-] with f(r) = target in [0, 1]: Newton, f being increasing and convex."""
        series = np.polynomial.Polynomial(np.concatenate(([0.0], self.weights)))
        slope = series.deriv()
        rho = np.minimum(target / max(self.weights[0], 1e-300), 1.0)
        residual = math.inf
        for _ in range(100):
            excess = series(rho) - target
            residual = float(np.max(np.abs(excess)))
            if residual < 1e-14:
                return rho
            rho = np.clip(rho - excess / np.maximum(slope(rho), 1e-300), 0.0, 1.0)
        raise ConvergenceError("the Gaussian correlation was not found; use larger shapes a, b", residual, 100)


def translate(marginal: Marginal) -> Translation:
    """The table of a marginal and its Hermite series, by the trapezoidal rule.

    Raises IllPosedError where 200 terms leave out more than 1e-4 of the variance.
    """
    z = np.linspace(-TABLE_EDGE, TABLE_EDGE, TABLE_NODES)
    values = marginal.centred(z)
    shares = _hermite_weights(z, values)
    carried = sum(shares)
    return Translation(
        normal=z,
        friction=marginal.scale * values,
        table_error=marginal.scale * float(np.max(np.abs(np.diff(values, 2)))) / 8.0,
        weights=np.array(shares) / carried,
        left_out=1.0 - carried,
    )


def _hermite_weights(z: np.ndarray, values: np.ndarray) -> list[float]:
    """Shares w_n, n = 1, 2, ..., of the variance of g(z) in the Hermite polynomials."""
    measure = np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi) * (z[1] - z[0])
    variance = float(np.sum(measure * values**2) - np.sum(measure * values) ** 2)
    before, now = np.ones_like(z), z.copy()
    weights: list[float] = []
    for n in range(1, MOST_TERMS + 1):
        weights.append(float(np.sum(measure * values * now)) ** 2 / variance)
        if sum(weights) > 1.0 - 1e-9:
            break
        before, now = now, (z * now - math.sqrt(n) * before) / math.sqrt(n + 1.0)
    if not sum(weights) > 1.0 - LEFT_OUT:
        raise IllPosedError(
            f"the Hermite series of the marginal leaves out {1.0 - sum(weights):.1e} of its variance after "
            f"{MOST_TERMS} terms: it is too close to steps; use larger shapes a, b of a Beta marginal"
        )
    return weights


@compiled()
def interpolated(x: float, normal: np.ndarray, friction: np.ndarray) -> float:
    """Linear interpolation in a table of equidistant normal scores, constant beyond it: the bits of np.interp."""
    last = normal.size - 1
    if x <= normal[0]:
        return friction[0]
    if x >= normal[last]:
        return friction[last]
    j = min(int((x - normal[0]) * (last / (normal[last] - normal[0]))), last - 1)
    if x < normal[j]:  # just below a node: the quotient is rounded up
        j -= 1
    slope = (friction[j + 1] - friction[j]) / (normal[j + 1] - normal[j])
    return slope * (x - normal[j]) + friction[j]


@compiled()
def translated(z: np.ndarray, normal: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """mu_S at every score."""
    result = np.empty(z.size)
    for k in range(z.size):
        result[k] = interpolated(z[k], normal, friction)
    return result
