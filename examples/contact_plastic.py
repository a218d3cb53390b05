"""Elastic-plastic contact: a ball begins to yield where Hertz says, and a rough surface tends to load over hardness."""

import numpy as np

from roughslip import Grid
from roughslip.contact import HertzSphere, Influence, contact_shares, solve, solve_load
from roughslip.surface import covariance_of, gaussian_model

modulus, hardness = 2.3e11, 5e9

# No pressure can exceed the hardness. A ball of 20 µm reaches it at the centre of the contact first.
limit = HertzSphere.at_yield(radius_m=2e-5, hardness_pa=hardness, plane_strain_modulus_pa=modulus)
grid = Grid(nx=96, ny=96, dx=3e-8, dy=3e-8)
x, y = np.meshgrid(grid.x() - grid.x().mean(), grid.y() - grid.y().mean(), indexing="ij")
shape = -(x**2 + y**2) / (2 * limit.radius_m)
influence = Influence(grid, modulus)
print(f"Hertz: a ball yields from a penetration of {limit.penetration_m * 1e9:.2f} nm on")
yielded = {}
for ratio in (0.9, 1.1, 2.0):
    ball = solve(influence, interference=shape + ratio * limit.penetration_m, hardness_pa=hardness)
    yielded[ratio] = int(np.count_nonzero(ball.plastic_displacement))
    print(f"  {ratio} of it: {yielded[ratio]} nodes yield, by {ball.plastic_displacement.max() * 1e9:.2f} nm at most")

# A surface that yields everywhere carries the hardness wherever it touches: its contact area is load over hardness.
rough = gaussian_model(covariance_of("gaussian", rms_height_m=1e-7, correlation_length_m=3e-7))
heights = rough.sampler(grid)(np.random.default_rng(1))
load, area = 0.1 * hardness, {}
print(f"rough surface, load over hardness {load / hardness}:")
for name, softness in (("elastic", np.inf), ("as hard as it is", 1.0), ("soft", 0.1)):
    solution = solve_load(
        influence, heights, softness * load if softness < 1 else load, hardness_pa=softness * hardness
    )
    area[name] = contact_shares(solution.pressure, softness * hardness).mean()
    print(f"  {name}: {area[name]:.4f} of it in contact")
