"""Stationary random friction along the belt: a marginal distribution and an exponential autocorrelation.

mu_S is a Gaussian process translated to the marginal, less its mean (M. Grigoriu, J. Eng. Mech. 110 (1984) 610-620).
Paths come from recursion.py, piece by piece, and from paths.py, whole.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from roughslip.errors import ParameterError, real
from roughslip.probability import BetaDistribution, QuantileDistribution, Translation, beta_moments, tabulate
from roughslip.validation import gate

PAPER_SHAPES = (2.1, 5.0)  # of the Beta distribution in section 4 of the paper
TABLE_NODES, MOST_TERMS, NEGLIGIBLE_REMAINDER = 2**12 + 1, 200, 1e-9  # of the translation
Marginal = BetaDistribution | QuantileDistribution


@gate
@dataclass(frozen=True)
class FrictionProcess:
    """mu_S along the slipped distance s: mu of the marginal less its mean, with the autocorrelation exp(-s / L).

    marginal : distribution of mu
    correlation_length_m : [m] L > 0
    """

    marginal: Marginal
    correlation_length_m: float

    def __post_init__(self) -> None:
        length = self.correlation_length_m
        if not (math.isfinite(real("FrictionProcess.correlation_length_m", length)) and length > 0.0):
            raise ParameterError(f"FrictionProcess.correlation_length_m must be finite and positive, not {length}")

    @property
    def smoother(self) -> str:
        """What to take in place of a marginal with which no Gaussian process has the autocorrelation."""
        if isinstance(self.marginal, BetaDistribution):
            a, b = self.marginal.a, self.marginal.b
            return (
                f"take larger shapes of the Beta distribution than {a:.3g} and {b:.3g}, as of more windows in parallel"
            )
        return "take a Beta distribution in place of the measured one (ensemble.marginal: beta)"

    def translation(self) -> Translation:
        """The translation of the Gaussian process to mu_S.

        Raises IllPosedError where 200 terms of the Hermite series leave out more than 1e-4 of the variance.
        """
        return tabulate(
            self.marginal.centred,
            scale=self.marginal.scale,
            nodes=TABLE_NODES,
            most_terms=MOST_TERMS,
            negligible_remainder=NEGLIGIBLE_REMAINDER,
        )


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
    if not (math.isfinite(real("the number of windows in parallel", windows)) and windows >= 1.0):
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
