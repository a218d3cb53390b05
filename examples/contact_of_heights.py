"""Contact of an array of heights: at a penetration, under loads, elastic and plastic; and with coordinates."""

import numpy as np
import xarray as xr

from roughslip import Grid, to_xarray
from roughslip.contact import Influence, Material, solve, solve_load, solve_loads

# Any heights [m] on equal cells: here waves in random directions.
x, y = np.meshgrid(1e-6 * np.arange(96), 1e-6 * np.arange(96), indexing="ij")
waves = np.random.default_rng(1).normal(0.0, [3e5, 3e5, 2.0], (40, 3))
heights = 2e-8 * np.sum([np.sin(kx * x + ky * y + phase) for kx, ky, phase in waves], axis=0)
steel = Material(young_modulus_pa=2.1e11, poisson_ratio=0.3).plane_strain_modulus_pa
influence = Influence(Grid.of(heights, dx=1e-6), steel)

pushed = solve(influence, heights, penetration_m=1e-7)
pressed = solve_load(influence, heights, mean_pressure_pa=pushed.mean_pressure)
print(f"100 nm deep: {pushed.mean_pressure / 1e6:.1f} MPa, under which it is {heights.max() - pressed.plane:.4e} m")
for each in solve_loads(influence, heights, np.geomspace(1e6, 1e9, 7)):
    area = each.shares.mean()
    print(f"{each.mean_pressure / 1e6:7.1f} MPa: {area:.4f} of the area in contact, residual {each.residual:.0e}")

# The softer the surface, the nearer is its area to the load over the hardness, which no pressure exceeds.
for hardness in (1e11, 1e10, 2e9):
    soft = solve_load(influence, heights, mean_pressure_pa=1e9, hardness_pa=hardness)
    print(f"hardness {hardness:.0e} Pa: {soft.shares.mean():.4f} in contact, load over hardness {1e9 / hardness:.4f}")

# A DataArray with coordinates brings its cells; results become Datasets.
field = xr.DataArray(heights, {"x": x[:, 0], "y": y[0]}, ("x", "y"))
grid = Grid.of(field)
print(to_xarray(solve(Influence(grid, steel), field.to_numpy(), penetration_m=1e-7), grid).pressure[:2, :2])
