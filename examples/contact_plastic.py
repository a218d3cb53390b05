"""Elastic-plastic contact under a load: the softer the surface, the nearer is its area to load over hardness."""

import numpy as np

from roughslip import Grid
from roughslip.contact import Influence, solve_loads
from roughslip.surface import covariance_of, gaussian_model

grid = Grid(nx=96, ny=96, dx=3e-8, dy=3e-8)
heights = gaussian_model(covariance_of("gaussian", 1e-7, 3e-7)).sampler(grid)(np.random.default_rng(1))
influence = Influence(grid, plane_strain_modulus_pa=2.3e11)
for hardness in (np.inf, 5e10, 5e9, 5e8):  # no pressure exceeds it
    curve = solve_loads(influence, heights, [2.5e7, 5e7], hardness_pa=hardness)
    print(f"hardness {hardness:.0e} Pa: in contact {curve.area}, load over hardness {curve.mean_pressure / hardness}")
