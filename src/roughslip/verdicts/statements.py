"""What the paper says, in the order of its text, and which hypotheses of the friction statistics go with it."""

# Statement and the paper's number, by id.
STATEMENTS = {
    "fig2-mcs-lhs": ("Latin hypercube sampling gives the distribution of Monte Carlo sampling", "curves coincide"),
    "fig2-pc-lhs": ("The polynomial chaos of eq. (8) gives the sampled distribution", "curves coincide"),
    "fig2-pc-tail": ("Polynomial chaos matches even for low probabilities", "matches well"),
    "fig2-variants-agree": ("The variants of eqs. (8) and (9) are nearly indistinguishable", "curves coincide"),
    "fig3-mean-decreases": ("The mean friction coefficient decreases with penetration", "decreases"),
    "fig3-std-decreases": ("The standard deviation decreases with penetration", "decreases"),
    "fig3-cov-decreases": ("The coefficient of variation decreases with penetration", "decreases"),
    "mu-correlation-exponential": ("The friction coefficient is exponentially correlated", "exponential"),
    "mu-correlation-250um": ("Its correlation length is 250 um", "250 um"),
    "mu-correlation-any-depth": ("The correlation length does not depend on the penetration", "independent"),
    "mu-right-skewed": ("The friction coefficient is right skewed", "skewness > 0"),
    "mu-leptokurtic": ("The friction coefficient is leptokurtic", "excess kurtosis > 0"),
    "mu-beta-2.1-5": ("Scaled to (0, 1) the friction coefficient follows Beta(2.1, 5)", "Beta(2.1, 5)"),
    "mu-beta-any-depth": ("It follows Beta(2.1, 5) at every penetration", "independent"),
    "fig5-limit-cycle": ("The mass moves on a stick-slip limit cycle, with and without scatter", "limit cycle"),
    "fig5-reattachment-nonnormal": ("The reattachment point is not normally distributed", "non-normal"),
    "fig5-sharp-limit": ("Without scatter the cycle ceases at a sharp limit of damping", "sharp limit"),
    "fig5-range-beyond-limit": ("With scatter there is a range of damping where the cycle goes on", "a range"),
}

# The hypothesis that a p-value of the friction statistics tests, by the statement whose note reports it.
P_VALUES = {
    "fig3-mean-decreases": ("p_no_change_of_mean", "no change"),
    "fig3-std-decreases": ("p_no_change_of_std", "no change"),
    "fig3-cov-decreases": ("p_no_change_of_variation", "no change"),
    "mu-correlation-exponential": ("p_exponential_nearer", "both being as near"),
    "mu-correlation-any-depth": ("p_equal_correlation", "one autocorrelation at all penetrations"),
    "mu-right-skewed": ("p_no_skewness", "no skewness"),
    "mu-leptokurtic": ("p_no_kurtosis", "no excess kurtosis"),
    "mu-beta-any-depth": ("p_equal_law", "one standardised distribution at all penetrations"),
}
