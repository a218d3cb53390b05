"""Distributions of heights and of friction coefficients: of Beta type by its ends, and of measured heights.

Each is a translation x(g) = F^-1(Phi(g)) of a standard normal variable g, so both tails keep relative accuracy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from scipy.special import betainccinv, betaincinv, ndtr, ndtri

from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import finite, gate, positive

EDGE = 8.5  # normal score beyond which lies a probability of 2e-17
FINE = 1.0 / 256.0
LEAST_BEYOND = 10  # values beyond the outermost node on either side
MOST_SHARED = 0.05  # of the values at the lowest or at the highest one
STEEPER = (5.0, 1.0)  # slope of a tail over that to the extreme value, at most; the second where the first adds spread
MOST_STRETCH = 0.03  # by which all values are stretched for the deviation that the table lost or added
TIE = 0.01  # of the mean deviation over n: the mean distance of neighbours is some three hundred times as long


class Moments(NamedTuple):
    """Mean, standard deviation, skewness and excess kurtosis."""

    mean: float
    standard_deviation: float
    skewness: float
    excess_kurtosis: float


@gate
def beta_moments(a: float, b: float) -> Moments:
    """Moments of Beta(a, b) on (0, 1)."""
    total = positive("a", a) + positive("b", b)
    variance = a * b / (total**2 * (total + 1.0))
    skewness = 2.0 * (b - a) * math.sqrt(total + 1.0) / ((total + 2.0) * math.sqrt(a * b))
    excess = 6.0 * ((a - b) ** 2 * (total + 1.0) - a * b * (total + 2.0)) / (a * b * (total + 2.0) * (total + 3.0))
    return Moments(a / total, math.sqrt(variance), skewness, excess)


def beta_from_gaussian(normal: np.ndarray, a: float, b: float) -> np.ndarray:
    """Quantiles of Beta(a, b) on (0, 1) : (as normal) at standard normal scores, each tail from its own probability."""
    lower, upper = ndtr(np.minimum(normal, 0.0)), ndtr(-np.maximum(normal, 0.0))
    quantile = np.where(normal < 0.0, betaincinv(a, b, lower), betainccinv(a, b, upper))
    # scipy 1.17 returns NaN for some shapes and probabilities below 1e-15, where x is at the end of the support
    return np.where(np.isnan(quantile), normal > 0.0, quantile)


@gate
@dataclass(frozen=True)
class BetaDistribution:
    """x = lower + (upper - lower) Beta(a, b).

    a, b : [-] shapes > 0. With a > b the tail hangs below a plateau, as of worn surfaces
    lower, upper : [unit of x] ends of the support; equal ones stand for no scatter
    """

    a: float
    b: float
    lower: float
    upper: float

    def __post_init__(self) -> None:
        for name in ("a", "b"):
            positive(f"BetaDistribution.{name}", getattr(self, name))
        lower, upper = finite("lower", self.lower), finite("upper", self.upper)
        if lower > upper:
            raise ParameterError(f"lower and upper must be in order, not {self.lower} and {self.upper}")

    @classmethod
    @gate
    def of_moments(cls, a: float, b: float, mean: float, standard_deviation: float) -> BetaDistribution:
        """The Beta distribution of these shapes, mean and standard deviation."""
        width = standard_deviation / beta_moments(a, b).standard_deviation
        lower = mean - width * a / (a + b)
        return cls(a, b, lower, lower + width)

    @property
    def mean(self) -> float:
        """Mean of x."""
        return self.lower + self.scale * self.a / (self.a + self.b)

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of x."""
        return self.scale * beta_moments(self.a, self.b).standard_deviation

    @property
    def scale(self) -> float:
        """Width of the support, the unit of `centred`; 0 stands for no scatter."""
        return self.upper - self.lower

    @gate
    def centred(self, normal: np.ndarray) -> np.ndarray:
        """(x - mean) / scale : (as normal) [-] at standard normal scores."""
        return beta_from_gaussian(normal, self.a, self.b) - self.a / (self.a + self.b)

    @gate
    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """x - mean : (as normal) [unit of x] at standard normal scores."""
        return self.scale * self.centred(normal)


@dataclass(frozen=True, eq=False)
class EmpiricalDistribution:
    """Values of zero mean whose quantile function x(g), g the standard normal score, is linear between the nodes.

    normal : (n,) [-] ascending nodes
    values : (n,) [unit of x] ascending values there, constant beyond the last nodes
    """

    normal: np.ndarray
    values: np.ndarray

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of x."""
        return math.sqrt(_moment(self.normal, self.values, 2))

    @gate
    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """x : (as normal) at standard normal scores g."""
        return np.interp(normal, self.normal, self.values)


@gate
def empirical_distribution(values: np.ndarray, standard_deviation: float | None = None) -> EmpiricalDistribution:
    """The distribution of measured values.

    values : (any shape) [unit of x] finite values, of heights after removal of the form
    standard_deviation : [unit of x] of the values and of the distribution; theirs where not given. Where outliers,
        fewer than a table holds, make more than MOST_STRETCH of it, the bulk of the values is kept instead

    Each value has the normal score of its middle rank. Ties share theirs, which bridges plateaus and the steps of a
    digitised instrument. Neighbours closer than TIE are ties: those of a plateau differ by rounding once its form is
    removed. Nodes are n^(-1/5) apart in the score, as the width of a kernel in a density estimate. They
    reach as far as ten values and the middle of the extreme ones lie beyond, and a monotone cubic joins them (Fritsch
    and Carlson, SIAM J. Numer. Anal. 17 (1980) 238). In the tails x is linear in the score with the slope of the last
    interval, a normal tail of that local spread. Where outliers begin there, it is a multiple of the slope to the
    extreme value.

    Raises IllPosedError for constant values, fewer than 100, or more than 5 % at one end.
    """
    x = finite("values", values).ravel()
    if not x.size or np.ptp(x) <= 1e-12 * np.max(np.abs(x)):
        raise IllPosedError(f"all {x.size} values are equal: give values that differ")
    deviation = float(np.std(x)) if standard_deviation is None else standard_deviation
    positive("standard_deviation", deviation)
    if x.size < 10 * LEAST_BEYOND:
        raise IllPosedError(
            f"{x.size} values make no distribution; take at least {10 * LEAST_BEYOND}, or Gaussian heights"
        )
    values, counts = _ties(x)
    shared = max(counts[0], counts[-1]) / x.size
    if shared > MOST_SHARED:
        raise IllPosedError(
            f"{100.0 * shared:.2g} % of the values are equal to the lowest or highest one, as in a clipped or coarsely "
            "digitised scan; remove those points or take Gaussian heights",
            scene_keys="roughness.scan.marginal",
        )
    score = ndtri((np.cumsum(counts) - 0.5 * counts) / x.size)
    spacing = x.size**-0.2
    reach = min(-float(score[0]), float(score[-1]), -float(ndtri(LEAST_BEYOND / x.size)))
    half = math.floor(reach / spacing)
    inner = spacing * np.arange(-half, half + 1)
    known = np.interp(inner, score, values)
    normal = np.linspace(-EDGE, EDGE, round(2.0 * EDGE / FINE) + 1)
    for steeper in STEEPER:
        slopes = [
            min(
                abs(known[end] - known[beside]) / spacing,
                steeper * abs((values[end] - known[end]) / (score[end] - inner[end])),
            )
            for end, beside in ((0, 1), (-1, -2))
        ]
        ends = known[0] - slopes[0] * (EDGE + inner[0]), known[-1] + slopes[1] * (EDGE - inner[-1])
        curve = scipy.interpolate.PchipInterpolator(
            np.concatenate(([-EDGE], inner, [EDGE])), np.concatenate((ends[:1], known, ends[1:]))
        )
        table = curve(normal)
        table -= _moment(normal, table, 1)
        lost = float(np.std(x)) / math.sqrt(_moment(normal, table, 2))
        if lost >= 1.0 - MOST_STRETCH:
            break
    table *= deviation / float(np.std(x)) * min(max(lost, 1.0 - MOST_STRETCH), 1.0 + MOST_STRETCH)
    return EmpiricalDistribution(normal, table)


def _ties(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ascending values, the mean of each group of ties, and how many values are in each."""
    x = np.sort(x)
    near = TIE * float(np.mean(np.abs(x - np.median(x)))) / x.size
    first = np.flatnonzero(np.diff(x, prepend=-math.inf) > near)
    counts = np.diff(first, append=x.size)
    return x[first] + np.add.reduceat(x - np.repeat(x[first], counts), first) / counts, counts


def _moment(normal: np.ndarray, values: np.ndarray, order: int) -> float:
    """E x^order of x linear in g between the nodes, by the trapezoidal rule with a normal weight."""
    density = np.exp(-0.5 * normal**2) / math.sqrt(2.0 * math.pi)
    return float(np.trapezoid(density * values**order, normal))
