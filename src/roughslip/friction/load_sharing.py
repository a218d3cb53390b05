"""Windows that bear a load in parallel: the friction of many scatters less than that of one.

The coefficient of n independent windows under equal loads is the mean of theirs: cumulants of order k fall by
n^(k - 1), so the standard deviation falls by sqrt(n), skewness by sqrt(n), excess kurtosis by n. As all of them slide
together, the autocorrelation stays. A Beta distribution is again one to the fourth moment (`average_beta`).
"""

from __future__ import annotations

import math

from roughslip.errors import ParameterError, whole
from roughslip.probability import beta_moments


def average_beta(a: float, b: float, lower: float, upper: float, windows: int) -> tuple[float, float, float, float]:
    """Beta distribution with the first four moments of the mean of independent ones.

    a, b, lower, upper : shapes and ends of one
    windows : n, at least 1

    Returns (a, b, lower, upper). With s = skewness^2 and e the excess kurtosis, both of the mean, the sum of its shapes
    is 6 (2 + e - s) / (3 s - 2 e) (Johnson, Kotz and Balakrishnan, Continuous Univariate Distributions 2, 1995,
    ch. 25): 3 s > 2 e for every Beta, and both fall as 1 / n. Raises ParameterError for n below 1.
    """
    if whole("the number of windows in parallel", windows) < 1:
        raise ParameterError(f"{windows} windows in parallel: at least 1")
    if windows == 1:
        return a, b, lower, upper
    mean, std, skewness, excess = beta_moments(a, b)
    s, e = skewness**2 / windows, excess / windows
    total = 6.0 * (2.0 + e - s) / (3.0 * s - 2.0 * e)
    share = math.copysign(math.sqrt(s / (s + 16.0 * (total + 1.0) / (total + 2.0) ** 2)), skewness)
    shapes = 0.5 * total * (1.0 - share), 0.5 * total * (1.0 + share)
    width = (upper - lower) * std / math.sqrt(windows) / beta_moments(*shapes)[1]
    start = lower + (upper - lower) * mean - width * shapes[0] / total
    return *shapes, start, start + width
