"""Friction of windows that slide along rough strips, and its statistics with intervals."""

import numpy as np

from roughslip import Grid
from roughslip.contact import Influence, contact_shares, solve
from roughslip.friction import friction_coefficient, strip_weights, window_statistics, window_sums
from roughslip.surface import covariance_of, gaussian_model

# Strips of 3000 µm x 25 µm, the plane at the median of the heights. Windows are 600 µm long, and lie 300 µm from ends.
grid = Grid(nx=1200, ny=10, dx=2.5e-6, dy=2.5e-6)
surface = gaussian_model(covariance_of("gaussian", rms_height_m=5e-8, correlation_length_m=1.416e-5))
draw, influence, sums = surface.sampler(grid), Influence(grid, plane_strain_modulus_pa=2.3e11), []
for number in range(60):
    strip = solve(influence, draw(np.random.default_rng([1, number])), tolerance=1e-6)
    cells = np.stack([contact_shares(strip.pressure), strip.pressure]).sum(axis=2)[:, 120:-120]
    sums.append(grid.cell_area * window_sums(cells, window_nodes=240, stride_nodes=12))
area, force = np.stack(sums, axis=1)

# Junctions shear at one strength. It is not known, so it is set to give the mean of 0.3.
mu, valid = friction_coefficient(area, force, shear_strength_pa=0.3 / np.mean(area / force), least_area_m2=1e-12)
found = window_statistics(mu, valid, strip_weights(len(mu), 200, np.random.default_rng(2)))
print(f"mean {found.mean}, standard deviation {found.std}, skewness {found.skewness}")
print(f"scatter over mean {found.variation}, on half the cells and 240 strips 0.111 [0.108, 0.113]")
