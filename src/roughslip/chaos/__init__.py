"""Polynomial chaos of the random contact pressure: expansions of responses in Gaussian variables.

Variables and bases
    designs : samples of the Gaussian variables: monte_carlo, latin_hypercube, sobol
    functionals : local_functionals, linear in the heights around a node
    hermite : hermite_basis, multi_indices
    selection : fit_count, number and directions of the variables

Fits
    pressure : PressureTarget, the smooth variable that is expanded; the paper's equations (8) and (9)
    regression, censored : least_squares, censored_regression
    leave_group_out : fits without groups of samples
    residual_distribution : distribution of the target given its prediction

Expansions
    local : fit_local, the pressure at the centre of the square; enrichment : enrich, with enough contact solves
    strip : fit_strip, the pressure along a strip
    field : fit_field, the pressure at every node of the square; single_index : fit_link

Results
    sensitivity : Sobol' indices
    distribution : distributions of the pressure given contact, and their comparison

Import names from these modules. The package itself imports no module, because a stage that needs a design would then
run again after every edit of an expansion.
"""
