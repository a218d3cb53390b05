"""Polynomial chaos of the random contact pressure: expansions of responses in Gaussian variables.

- monte_carlo, latin_hypercube, sobol: samples of the Gaussian variables; kolmogorov_distance compares results
- multi_indices, hermite_basis, least_squares, sobol_indices: an expansion of any response, term by term
- pressure_target, fit_in_contact: the smooth variable that is expanded; the paper's equations (8) and (9)
- fit_local, fit_strip: the pressure at the centre of the square, and along a strip

`__init__.pyi` lists all public names and their modules. functionals: variables linear in the heights around a node;
left_out: predictions of samples that a fit has not seen.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
