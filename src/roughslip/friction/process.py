"""Stationary random friction along the belt: a marginal distribution and an autocorrelation.

mu_S is a Gaussian process translated to the marginal, less its mean (M. Grigoriu, J. Eng. Mech. 110 (1984) 610-620).
Paths come piece by piece from endless.py, or whole from paths.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from roughslip.errors import ParameterError, real
from roughslip.probability import BetaDistribution, beta_moments, translate
from roughslip.probability.translation import Translation
from roughslip.validation import gate, positive, reals

PAPER_SHAPES = (2.1, 5.0)  # of the Beta distribution in section 4 of the paper
TABLE_NODES, MOST_TERMS, NEGLIGIBLE_REMAINDER = 2**12 + 1, 200, 1e-9  # of the translation
PIECE_NODES = 4096  # of a path, drawn at a time
SMOOTHER = "take larger shapes of the Beta distribution, as of more windows in parallel"


@dataclass(frozen=True)
class Realisation:
    """One path: every iteration begins it anew and yields rows of mu_S [-], PIECE_NODES or more, from s = 0 on."""

    begin: Callable[[], Iterator[np.ndarray]]

    def __iter__(self) -> Iterator[np.ndarray]:
        return self.begin()


@dataclass(frozen=True, eq=False)
class Paths:
    """What paths of one process at one spacing have in common.

    spacing : [m] distance of the nodes
    translation : from a Gaussian path to mu_S
    correlation_error : [-] largest deviation of the autocorrelation of mu_S from that of the process at any lag
    """

    spacing: float
    translation: Translation
    correlation_error: float

    def realisation(self, seed: Sequence[int]) -> Realisation:
        """The path of a seed."""
        return Realisation(partial(self.pieces, tuple(seed)))

    def pieces(self, seed: tuple[int, ...]) -> Iterator[np.ndarray]:
        """Rows of mu_S, one after the other."""
        raise NotImplementedError


@gate
@dataclass(frozen=True, eq=False)
class CorrelationShape:
    """An autocorrelation in units of its own length L, the integral from zero on: straight between its lags.

    lags : (K,) [-] s / L, from 0 on, increasing
    values : (K,) [-] from 1 to 0 at the last lag, and beyond it
    """

    lags: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        lags, values = (reals(f"CorrelationShape.{name}", getattr(self, name)) for name in ("lags", "values"))
        are_rows = lags.ndim == 1 and lags.shape == values.shape and lags.size > 1
        if not (are_rows and lags[0] == 0.0 and (np.diff(lags) > 0.0).all()) or not (
            values[0] == 1.0 and values[-1] == 0.0 and (np.abs(values) <= 1.0).all()
        ):
            raise ParameterError(
                "lags and values of a CorrelationShape must be rows of equal length: lags that increase from 0, and "
                "values from 1 to 0, none above 1"
            )

    @classmethod
    @gate
    def of_lags(cls, lags_m: np.ndarray, values: np.ndarray) -> tuple[float, CorrelationShape]:
        """Length L [m] and shape of an autocorrelation at lags [m]; its last value counts as zero."""
        values = np.append(values[:-1], 0.0)
        length = float(np.trapezoid(values, lags_m))
        if not length > 0.0:
            raise ParameterError(f"the integral of an autocorrelation must be positive, not {length:g} m")
        return length, cls(lags_m / length, values)


@gate
@dataclass(frozen=True)
class FrictionProcess:
    """mu_S along the slipped distance s: mu of the marginal less its mean, with an autocorrelation of length L.

    marginal : distribution of mu
    correlation_length_m : [m] L > 0, the integral of the autocorrelation from zero on
    shape : of the autocorrelation; not given, it is exp(-s / L)
    """

    marginal: BetaDistribution
    correlation_length_m: float
    shape: CorrelationShape | None = None

    def __post_init__(self) -> None:
        positive("FrictionProcess.correlation_length_m", self.correlation_length_m)

    @gate
    def autocorrelation(self, s: np.ndarray) -> np.ndarray:
        """Autocorrelation (as s) [-] of mu_S at slipped distances s [m] >= 0."""
        u = s / self.correlation_length_m
        return np.exp(-u) if self.shape is None else np.interp(u, self.shape.lags, self.shape.values)

    def translation(self) -> Translation:
        """The translation of the Gaussian process to mu_S.

        Raises IllPosedError where 200 terms of the Hermite series leave out more than 1e-4 of the variance.
        """
        return translate(self.marginal, TABLE_NODES, MOST_TERMS, NEGLIGIBLE_REMAINDER)


@gate
def average_beta(window: BetaDistribution, windows: float) -> BetaDistribution:
    """Beta distribution with the first four moments of the mean of independent ones.

    window : the distribution of a single one
    windows : n, at least 1; correlated windows count as fewer, not a whole number

    Raises ParameterError for n below 1.

    The coefficient of n independent windows under equal loads is the mean of theirs: the cumulant of order k falls by
    n^(k - 1). As all windows slide together, the autocorrelation stays. Let s be the squared skewness and e the excess
    kurtosis of the mean. For every Beta 3 s > 2 e. The sum of its shapes is 6 (2 + e - s) / (3 s - 2 e) (Johnson, Kotz
    and Balakrishnan, Continuous Univariate Distributions 2, 1995, ch. 25).
    """
    if not (math.isfinite(real("windows", windows)) and windows >= 1.0):
        raise ParameterError(f"{windows} windows in parallel: at least 1")
    if windows == 1:
        return window
    mean, std, skewness, excess = beta_moments(window.a, window.b)
    s, e = skewness**2 / windows, excess / windows
    total = 6.0 * (2.0 + e - s) / (3.0 * s - 2.0 * e)
    share = math.copysign(math.sqrt(s / (s + 16.0 * (total + 1.0) / (total + 2.0) ** 2)), skewness)
    shapes = 0.5 * total * (1.0 - share), 0.5 * total * (1.0 + share)
    width = window.scale * std / math.sqrt(windows) / beta_moments(*shapes)[1]
    start = window.lower + window.scale * mean - width * shapes[0] / total
    return BetaDistribution(*shapes, start, start + width)
