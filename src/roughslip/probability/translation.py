"""Translation of a Gaussian field or process to another distribution, x = F^-1(Phi(g)), and its effect on correlation.

With normalised Hermite polynomials h_n the translation is x(g) = sum_n c_n h_n(g). By Mehler's formula, Gaussian
variables of correlation rho give x the correlation rho_x = sum_n w_n rho^n, with w_n = c_n^2 / var x (M. Grigoriu,
J. Eng. Mech. 110 (1984) 610). It increases from rho_x(-1), the least that the distribution allows, to 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.validation import finite, gate, reals

TABLE_EDGE, TABLE_NODES = 8.5, 2**13 + 1  # normal scores; beyond the edge lies a probability of 2e-17
MOST_TERMS = 120
NEGLIGIBLE_REMAINDER = 1e-12  # share of the variance at which the series ends
LEFT_OUT = 1e-4  # share of the variance that the series may leave out at most
CORRELATION_NODES = 4097  # of the table from which correlations are inverted
CORRELATION_ERROR, WORST_CORRELATION_ERROR = 1e-14, 1e-12  # of the inverse, in rho_x
MOST_STEPS = 100
SMALLEST_SLOPE = 1e-9  # keeps Newton's steps finite where rho_x is flat, near rho = -1


class Distribution(Protocol):
    """What a translation needs of a distribution."""

    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """x - E x : (as normal) at standard normal scores."""


@dataclass(frozen=True, eq=False)
class Translation:
    """A distribution as a table over normal scores, and its Hermite series.

    normal, values : (nodes,) [-] standard normal g, equally spaced, and [unit of x] x(g) less its mean
    shares : (N,) [-] w_1, w_2, ..., which sum to one
    left_out : [-] share of the variance that the series leaves out; rho_x errs by no more than twice as much
    """

    normal: np.ndarray
    values: np.ndarray
    shares: np.ndarray
    left_out: float

    @gate
    def apply(self, gaussian: np.ndarray) -> np.ndarray:
        """x - E x : (as gaussian) of standard normal variables [-], constant beyond the table."""
        field = np.ascontiguousarray(finite("gaussian", gaussian))
        shifted = np.empty_like(field)
        per_node = (self.normal.size - 1) / (self.normal[-1] - self.normal[0])
        _interpolate(field.ravel(), float(self.normal[0]), per_node, self.values, shifted.ravel())
        return shifted

    @cached_property
    def series(self) -> np.polynomial.Polynomial:
        """rho_x as a polynomial in rho."""
        return np.polynomial.Polynomial(np.concatenate(([0.0], self.shares)))

    @gate
    def correlation(self, gaussian_correlation: float | np.ndarray) -> np.ndarray:
        """rho_x : (as the argument) [-] of variables whose Gaussian ones have that correlation."""
        return self.series(checked_correlations(gaussian_correlation))

    @property
    def least_correlation(self) -> float:
        """rho_x(-1) [-], below which no two variables of this distribution can be correlated by a Gaussian field."""
        return float(self.correlation(-1.0))

    @property
    def least_error(self) -> float:
        """Bound of the error of the least correlation [-]."""
        return 1e-9 + 2.0 * abs(self.left_out)

    @gate
    def gaussian_correlation(self, correlation: float | np.ndarray) -> np.ndarray:
        """rho : (as the argument) [-] of the Gaussian variables that give x the correlation.

        Newton's method to 1e-14 of rho_x, within the cells of a table. Raises IllPosedError below the least one.
        """
        wanted = checked_correlations(correlation)
        minimum = self.least_correlation
        if np.any(wanted < minimum - self.least_error):
            raise IllPosedError(
                f"correlation {float(np.min(wanted)):.4g} is wanted, but this distribution allows none below "
                f"{minimum:.4g}; use a less skewed distribution, or leave the correlation uncorrected",
                scene_keys="roughness.correct_correlation",
            )
        wanted = np.maximum(wanted, minimum)
        nodes = np.linspace(-1.0, 1.0, CORRELATION_NODES)
        table = self.series(nodes)
        cell = np.clip(np.searchsorted(table, wanted), 1, nodes.size - 1)
        rho, low, high = np.interp(wanted, table, nodes), nodes[cell - 1], nodes[cell]
        slope = self.series.deriv()
        for _ in range(MOST_STEPS):
            excess = self.series(rho) - wanted
            residual = float(np.max(np.abs(excess), initial=0.0))
            if residual < CORRELATION_ERROR:
                return rho
            rho = np.clip(rho - excess / np.maximum(slope(rho), SMALLEST_SLOPE), low, high)
        if residual < WORST_CORRELATION_ERROR:
            return rho
        raise ConvergenceError(
            f"no Gaussian correlation was found to within {WORST_CORRELATION_ERROR:.0e}; use a less skewed "
            "distribution, or leave the correlation uncorrected",
            residual,
            _ + 1,
            scene_keys="roughness.correct_correlation",
        )


@compiled()
def _interpolate(at: np.ndarray, first: float, per_node: float, values: np.ndarray, out: np.ndarray) -> None:
    """Straight between equally spaced nodes, without the search for them that takes `np.interp` most of its time."""
    last = values.size - 1
    for k in range(at.size):
        place = min(max((at[k] - first) * per_node, 0.0), float(last))
        node = min(int(place), last - 1)
        out[k] = values[node] + (place - node) * (values[node + 1] - values[node])


@gate
def translate(
    distribution: Distribution,
    nodes: int = TABLE_NODES,
    most_terms: int = MOST_TERMS,
    negligible_remainder: float = NEGLIGIBLE_REMAINDER,
) -> Translation:
    """The translation to a distribution; one without scatter has a single term.

    nodes : of the table; most_terms : of the series, which ends at a remainder of the variance

    Coefficients follow from the trapezoidal rule on the table. With the normal weight it converges faster than any
    power for smooth x, and faster than Gauss-Hermite for others, most of whose nodes lie where the weight is negligible
    (L. N. Trefethen, SIAM Review 64 (2022) 132). Raises IllPosedError where the series leaves out 1e-4 of the variance.
    """
    normal = np.linspace(-TABLE_EDGE, TABLE_EDGE, nodes)
    values = distribution.from_gaussian(normal)
    if not (np.isfinite(values).all() and (np.diff(values) >= 0.0).all()):
        raise ParameterError("the quantile function of the distribution must be finite and increase")
    measure = np.exp(-0.5 * normal**2) / math.sqrt(2.0 * math.pi) * (normal[1] - normal[0])
    variance = float(np.sum(measure * values**2) - np.sum(measure * values) ** 2)
    before, now = np.ones_like(normal), normal.copy()
    shares: list[float] = []
    for n in range(1, most_terms + 1 if variance else 2):
        shares.append(float(np.sum(measure * values * now)) ** 2 / variance if variance else 1.0)
        if sum(shares) > 1.0 - negligible_remainder:
            break
        before, now = now, (normal * now - math.sqrt(n) * before) / math.sqrt(n + 1.0)
    carried = sum(shares)
    if not abs(1.0 - carried) < LEFT_OUT:
        raise IllPosedError(
            f"the Hermite series leaves out {1.0 - carried:.1e} of the variance after {len(shares)} terms: the "
            "distribution is too close to steps, as of few values, or its tail too long, as of outliers: leave these "
            "out, or take a Beta distribution of larger shapes"
        )
    return Translation(normal, values, np.array(shares) / carried, 1.0 - carried)


def checked_correlations(values: float | np.ndarray) -> np.ndarray:
    """The values, real numbers between -1 and 1; raises ParameterError for others."""
    rho = reals("correlations", values)
    if not np.all(np.abs(rho) <= 1.0 + 1e-9):
        raise ParameterError(f"correlations must lie between -1 and 1, not in {rho.min():.4g} to {rho.max():.4g}")
    return np.clip(rho, -1.0, 1.0)
