"""What the paper states, in the order of its text, and the written rule that judges each statement."""

from __future__ import annotations

import numpy as np

from roughslip.verdicts.thresholds import (
    BETA_SKEWNESS,
    CAN_CYCLE,
    CYCLING,
    FACTOR,
    NON_NORMAL,
    SAME_LENGTH,
    SEEN_RANGE,
    SKEWNESS_RANGE,
    VISIBLE,
)

# Statement and the paper's number, by id; `cov` in an id is the coefficient of variation, not a covariance.
STATEMENTS = {
    "fig2-mcs-lhs": ("Latin hypercube sampling gives the distribution of Monte Carlo sampling", "curves coincide"),
    "fig2-pc-lhs": ("The polynomial chaos of eq. (8) gives the sampled distribution", "curves coincide"),
    "fig2-pc-tail": ("Polynomial chaos matches even for low probabilities", "matches well"),
    "fig2-variants-agree": ("The variants of eqs. (8) and (9) are nearly indistinguishable", "curves coincide"),
    "fig3-mean-decreases": ("The mean friction coefficient decreases with penetration", "decreases"),
    "fig3-std-decreases": ("The standard deviation decreases with penetration", "decreases"),
    "fig3-cov-decreases": ("The coefficient of variation decreases with penetration", "decreases"),
    "mu-correlation-exponential": ("The friction coefficient is exponentially correlated", "exponential"),
    "mu-correlation-250um": ("Its correlation length is 250 µm", "250 µm"),
    "mu-correlation-any-depth": ("The correlation length does not depend on the penetration", "independent"),
    "mu-right-skewed": ("The friction coefficient is right skewed", "skewness > 0"),
    "mu-leptokurtic": ("The friction coefficient is leptokurtic", "excess kurtosis > 0"),
    "mu-beta-2.1-5": ("Scaled to (0, 1) the friction coefficient follows Beta(2.1, 5)", "Beta(2.1, 5)"),
    "mu-beta-any-depth": ("It follows Beta(2.1, 5) at every penetration", "independent"),
    "fig5-limit-cycle": ("The mass moves on a stick-slip limit cycle, with and without scatter", "limit cycle"),
    "fig5-reattachment-nonnormal": ("The reattachment point is not normally distributed", "non-normal"),
    "fig5-sharp-limit": ("Without scatter the cycle ceases at a sharp limit of damping", "sharp limit"),
    "fig5-range-beyond-limit": ("With scatter there is a range of damping where the cycle goes on", "a range"),
    "own-fig5-under-load": (
        f"Our own statement: on windows that bear the stated force this range exceeds {SEEN_RANGE:.0%} of the limit",
        "not stated",
    ),
}

# Unit of our number, by id, and the factor to the one that a reader uses. Others have none and are shown as they are.
UNITS = {
    "fig2-pc-tail": ("decades", 1.0, " decades"),
    "mu-correlation-250um": ("m", 1e6, " µm"),
    "mu-correlation-any-depth": ("m", 1e6, " µm"),
    "fig5-limit-cycle": ("1", 100.0, " %"),
    "fig5-range-beyond-limit": ("1", 100.0, " %"),
    "own-fig5-under-load": ("1", 100.0, " %"),
}
UNITLESS = ("1", 1.0, "")

# P-value of the friction statistics that the note on a statement reports, and the hypothesis that it tests.
P_VALUES = {
    "fig3-mean-decreases": ("p_no_change_of_mean", "no change"),
    "fig3-std-decreases": ("p_no_change_of_std", "no change"),
    "fig3-cov-decreases": ("p_no_change_of_variation", "no change"),
    "mu-correlation-exponential": ("p_exponential_nearer", "both being as near"),
    "mu-correlation-any-depth": ("p_equal_correlation", "one autocorrelation at all penetrations"),
    "mu-right-skewed": ("p_no_skewness", "no skewness"),
    "mu-leptokurtic": ("p_no_kurtosis", "no excess kurtosis"),
    "mu-beta-any-depth": ("p_equal_distribution", "one standardised distribution at all penetrations"),
}

_COINCIDE = f"the interval of the Kolmogorov distance given contact lies below {VISIBLE}"
_DECREASES = (
    "the intervals of the change along a straight line over penetration and of the last less the first level both lie "
    "below zero"
)
_LIKE_BETA = (
    f"the interval of the Kolmogorov distance, both standardised, lies below {VISIBLE} and that of the skewness lies "
    f"from {SKEWNESS_RANGE[0]:.2f} to {SKEWNESS_RANGE[1]:.2f}, around the {BETA_SKEWNESS:.2f} of Beta(2.1, 5)"
)

# What the 95 % interval of our number must satisfy.
RULES = {
    "fig2-mcs-lhs": _COINCIDE,
    "fig2-pc-lhs": _COINCIDE,
    "fig2-pc-tail": f"where the solved samples lie between 0.001, or the least that they resolve, and 0.1, eq. (8) is "
    f"within a factor of {FACTOR:g} of it: the interval of the largest |log10| of their ratio lies below "
    f"{np.log10(FACTOR):.3f}",
    "fig2-variants-agree": _COINCIDE,
    "fig3-mean-decreases": _DECREASES,
    "fig3-std-decreases": _DECREASES,
    "fig3-cov-decreases": _DECREASES,
    "mu-correlation-exponential": "at median penetration the mean square distance to the fitted exponential is less "
    "than that to the triangle of the window itself: the interval of their difference lies below zero",
    "mu-correlation-250um": "at median penetration the interval of the least-squares length lies within "
    f"{SAME_LENGTH:.0%} of 250 µm",
    "mu-correlation-any-depth": "the interval of the change from the first to the last level, along a straight line "
    f"through all, lies within {SAME_LENGTH:.0%} of the mean length",
    "mu-right-skewed": "the interval of the skewness at median penetration lies above zero",
    "mu-leptokurtic": "the statement contradicts itself if the paper's own Beta(2.1, 5) has negative excess kurtosis; "
    "else the interval of the excess kurtosis at median penetration lies above zero",
    "mu-beta-2.1-5": f"at median penetration {_LIKE_BETA}",
    "mu-beta-any-depth": f"at every level {_LIKE_BETA}",
    "fig5-limit-cycle": "the damping lies below the deterministic limit, and the interval of the share of runs that "
    f"cycle to the end lies above {CYCLING}",
    "fig5-reattachment-nonnormal": "the interval of the skewness or that of the excess kurtosis lies beyond "
    f"{NON_NORMAL} on either side of zero",
    "fig5-sharp-limit": "every damping of the list below the limit gives at least half the cycles of the least "
    "damping, and every one above it gives at most one. It is not tested if the list has only one side",
    "fig5-range-beyond-limit": "at some damping of the list above the deterministic limit the interval of the share of "
    f"runs that cycle to the end lies above {CAN_CYCLE}. It is not tested if the list has none",
    "own-fig5-under-load": "the range ends between the last damping of the list where the interval of that share lies "
    f"above {CAN_CYCLE} and the next where it lies below. To first order it is in proportion to the scatter of "
    f"friction. Scaled to that of the windows that bear the force, its interval lies above {SEEN_RANGE} of the limit",
}
