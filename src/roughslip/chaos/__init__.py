"""Polynomial chaos of the random contact pressure: expansions of responses in Gaussian variables.

- multi_indices, hermite_basis, least_squares: an expansion of any response, term by term
- latin_hypercube: a design of the variables
- pressure_target, fit_in_contact: the smooth variable that is expanded; the paper's equations (8) and (9)

`__init__.pyi` lists all public names and their modules. local and strip: the pressure at the centre of the square, and
along a strip, in local functionals of the heights; scatter: the distribution of a target given its prediction.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
