"""Polynomial chaos of a contact pressure, and Sobol' indices: which modes of the surface decide it?"""

import numpy as np

from roughslip import Grid
from roughslip.chaos import hermite_basis, latin_hypercube, least_squares, multi_indices, sobol_indices
from roughslip.contact import Influence, solve
from roughslip.surface import covariance_of, karhunen_loeve

# Surfaces of six modes, pressed to the median of their heights.
grid = Grid(nx=16, ny=16, dx=1e-6, dy=1e-6)
modes = karhunen_loeve(covariance_of("gaussian", rms_height_m=5e-8, correlation_length_m=1.2e-5), grid, 6).modes
influence = Influence(grid, plane_strain_modulus_pa=2.3e11)
node = 5, 7


def state(xi: np.ndarray) -> float:
    """Pressure [MPa] at the node; out of contact minus the gap, as the pressure of this cell that would close it."""
    solution = solve(influence, interference=np.tensordot(xi, modes, axes=1))
    return 1e-6 * (solution.pressure[node] - solution.gap[node] / influence.diagonal)


terms = multi_indices(6, degree=3)
xi = latin_hypercube(np.random.default_rng(1), samples=1500, variables=6)
fit = least_squares(hermite_basis(xi, terms), np.array([state(row) for row in xi]))
first, total = sobol_indices(terms, fit.coefficients, np.eye(6))
print(f"{len(terms)} coefficients from {fit.samples} solves; they miss {fit.leave_one_out:.1%} of the variance")

# The same by brute force: change one variable, solve again (Jansen's estimate of the total index).
rng = np.random.default_rng(2)
a, b = rng.standard_normal((2, 1000, 6))
before = np.array([state(row) for row in a])
brute = np.empty(6)
for mode in range(6):
    changed = np.where(np.arange(6) == mode, b, a)
    brute[mode] = np.mean((before - np.array([state(row) for row in changed])) ** 2) / (2 * before.var())
for mode in range(6):
    print(f"mode {mode + 1}: alone {first[mode]:.3f}, in total {total[mode]:.3f}, by brute force {brute[mode]:.3f}")
