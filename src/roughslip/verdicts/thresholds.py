"""Effect sizes and numbers of the paper at which verdicts turn.

They stand apart from all text: numbers of strips follow from them, and an edit of a text must not solve strips again.
"""

from __future__ import annotations

from roughslip.probability import beta_moments

VISIBLE = 0.1  # Kolmogorov distance that a reader sees between two curves in print
FACTOR = 2.0  # between small probabilities that still match
SAME_LENGTH = 0.2  # relative difference of correlation lengths that would not be reported as a dependence
SAME_SKEWNESS = 0.5  # relative; that of the normal distribution, 0.05 from Beta(2.1, 5) in Kolmogorov distance, is 1
NON_NORMAL = 0.1  # skewness or excess kurtosis
CYCLING = 0.95  # share of the runs
CAN_CYCLE = 0.05  # share of the runs
SEEN_SHARE = 0.01  # of the time in stick-slip without scatter: more than a few single returns of all runs
STRAIGHT = 0.95  # R2 of a straight line: a correlation coefficient of 0.975
SAME_SHAPE = 0.2  # relative difference of the shapes of two Beta distributions that would be reported as one
SEEN_RANGE = 0.01  # of the limit of damping: a range beyond it that a reader of figure 5 sees
PAPER_LENGTH = 250e-6  # m
PAPER_BETA = (2.1, 5.0)
_, _, BETA_SKEWNESS, BETA_KURTOSIS = beta_moments(*PAPER_BETA)
SKEWNESS_RANGE = BETA_SKEWNESS * (1 - SAME_SKEWNESS), BETA_SKEWNESS * (1 + SAME_SKEWNESS)
