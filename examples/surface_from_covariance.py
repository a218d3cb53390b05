"""A rough surface from a covariance: draw it, and find in it what was asked for."""

import numpy as np

from roughslip import Grid
from roughslip.surface import covariance_of, gaussian_model, karhunen_loeve

covariance = covariance_of("matern", rms_height_m=1e-6, correlation_length_m=1e-5, smoothness=1.5)
surface = gaussian_model(covariance)
grid = Grid(nx=512, ny=512, dx=1e-6, dy=1e-6)
draw = surface.sampler(grid)
heights = draw(np.random.default_rng(7))

rms = heights.std()
lag = round(covariance.correlation_length_m / grid.dx)
correlation = np.mean(heights[lag:] * heights[:-lag]) / np.mean(heights**2)
print(f"Sq {rms * 1e6:.3f} µm, asked for {covariance.rms_height_m * 1e6:.3f} µm")
print(f"correlation at {lag} cells {correlation:.3f}, asked for 1/e = {np.exp(-1):.3f}")
above = np.mean(heights > surface.plane_height(percentile=20))
print(f"20 % of all such heights lie above the plane of that percentile, of this surface {above:.1%}")

# On a small mesh a few modes hold most of the surface: the Karhunen-Loève expansion.
small = Grid(nx=32, ny=32, dx=1e-6, dy=1e-6)
modes = karhunen_loeve(covariance, small, order=60)
xi = np.random.default_rng(8).standard_normal((2000, len(modes.modes)))
drawn = np.tensordot(xi, modes.modes, axes=1)
print(f"{len(modes.modes)} of {small.size} modes hold {modes.captured_variance:.1%} of the variance")
print(f"and 2000 surfaces from them {drawn.var() / covariance.rms_height_m**2:.1%}")
