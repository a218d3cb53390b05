"""Polynomial chaos of the random contact pressure: expansions of responses in Gaussian variables.

- multi_indices, hermite_basis, least_squares: an expansion of any response, term by term
- latin_hypercube: a design of the variables; local_functionals of the heights are variables at a node
- pressure_target, fit_in_contact: the smooth variable that is expanded; the paper's equations (8) and (9)
- fit_local, fit_strip: the pressure at the centre of the square, and along a strip

`__init__.pyi` lists all public names and their modules. regression: fits, and predictions of samples that they have not
seen; scatter: the distribution of a target given its prediction.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
