"""Chaos of a scalar of your own, and Sobol' indices: which input decides it? Next to the exact ones.

Here: the damping below which steady sliding is unstable, a product of powers of its inputs.
"""

import numpy as np

from roughslip.chaos import hermite_basis, latin_hypercube, least_squares, multi_indices, sobol_indices
from roughslip.oscillator import Oscillator, StribeckLaw, hopf_damping

scatter = np.array([0.1, 0.2, 0.15])  # standard deviations of the logarithms of mass, frequency and load


def damping(mass: float, frequency: float, load: float) -> float:
    """Any function of a few numbers."""
    return hopf_damping(Oscillator(mass, frequency, 0.1, 0.948, load), StribeckLaw(fit=0.3))


terms = multi_indices(3, degree=4)
xi = latin_hypercube(np.random.default_rng(1), samples=200, variables=3)  # standard normals
inputs = np.array([1.0, 316.0, 2500.0]) * np.exp(scatter * xi)
fit = least_squares(hermite_basis(xi, terms), np.array([damping(*row) for row in inputs]))
first, total = sobol_indices(terms, fit)
exact = np.expm1(scatter**2) / np.expm1(np.sum(scatter**2))
print(f"{len(terms)} coefficients from {fit.samples} samples; they miss {fit.leave_one_out:.1e} of the variance")
for name, *row in zip(("mass", "frequency", "load"), first, exact, total, strict=True):
    print("{}: alone {:.4f}, exactly {:.4f}; in total {:.4f}".format(name, *row))
