"""A self-affine surface of a given rms slope, with a lay, and what a sample has of it."""

import numpy as np

from roughslip import Grid
from roughslip.scan import Topography, scan_statistics
from roughslip.surface import gaussian_model, self_affine

lay = {"rolloff_wavelength_m": 6e-5, "rolloff_wavelength_across_m": 2e-5, "cutoff_wavelength_m": 8e-6}
ground = self_affine(rms_slope=0.1, hurst=0.8, **lay)
grid = Grid(nx=512, ny=512, dx=5e-7, dy=5e-7)
heights = gaussian_model(ground).sampler(grid)(np.random.default_rng(1))
found = scan_statistics(Topography(heights, grid.dx, grid.dy, np.zeros(grid.shape, dtype=bool)))
print(f"slope {ground.rms_slope:.3f}: {found.rms_slope}; curvature {ground.rms_curvature:.3g}: {found.rms_curvature}")
