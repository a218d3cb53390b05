"""Polynomial chaos of the random contact pressure: expansions of responses in Gaussian variables.

- sampling: designs of the Gaussian variables; empirical distributions and their comparison
- functionals: variables that are linear in the heights around a node; hermite: terms and Sobol' indices
- pressure: the smooth variable that is expanded; the paper's equations (8) and (9)
- regression: least squares and censored; left_out: predictions of samples that a fit has not seen
- local, selection, enrichment: the pressure at the centre of the square, in how many variables, from how many solves
- strip: the pressure along a strip; field, single_index: the pressure at every node of the square

Import names from these modules. The package itself imports no module, because a stage that needs a design would then
run again after every edit of an expansion.
"""
