"""Bowden-Tabor friction on windows that slide along a strip, its statistics, and its stochastic process.

bowden_tabor : window_sums, friction_coefficient
resampling : strip_weights, the bootstrap of whole strips
statistics : window_statistics, ratio_of_sums, combine (control variates)
correlation : autocorrelation, correlation_fit, white_autocorrelation
marginal, distribution_families : fit_beta, scaled_beta, distance_to_beta; fit_candidates
penetration : penetration_curve, trend, p_value, p_value_of_equality
process : FrictionProcess, average_beta
recursion, paths : recursion, and prepare for paths by any method

The package imports nothing by itself, so that a stage depends only on the modules that it names.
"""

__all__ = [
    "bowden_tabor",
    "correlation",
    "distribution_families",
    "marginal",
    "paths",
    "penetration",
    "process",
    "recursion",
    "resampling",
    "statistics",
]
