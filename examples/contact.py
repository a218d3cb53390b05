"""A ball and a wave next to Hertz and Westergaard; then an array of heights, by penetration, load and hardness."""

import numpy as np
import xarray as xr

from roughslip import Grid, to_xarray
from roughslip.contact import Influence, Material, solve, solve_load, solve_loads

steel = Material(young_modulus_pa=2.1e11, poisson_ratio=0.3).plane_strain_modulus_pa

# A ball of 1 mm radius, pushed 0.2 µm into the plane.
radius, penetration = 1e-3, 2e-7
contact_radius = np.sqrt(radius * penetration)
hertz = 4 / 3 * steel * contact_radius * penetration
grid = Grid(nx=128, ny=128, dx=2.5e-7, dy=2.5e-7)
x, y = np.meshgrid(grid.x() - grid.x().mean(), grid.y() - grid.y().mean(), indexing="ij")
pressed = solve(Influence(grid, steel), interference=penetration - (x**2 + y**2) / (2 * radius))
force, peak = pressed.pressure.sum() * grid.cell_area, 1.5 * hertz / (np.pi * contact_radius**2)
print(f"ball: force {force:.5f} N, Hertz {hertz:.5f} N")
print(f"ball: peak {pressed.pressure.max() / 1e6:.1f} MPa, Hertz {peak / 1e6:.1f} MPa")

# A wavy surface, one wavelength of it, at half of the pressure that flattens it.
amplitude, wavelength, share = 2e-7, 3e-5, 0.5
line = Grid(nx=256, ny=1, dx=wavelength / 256, dy=wavelength / 256)
crests = amplitude * np.cos(2 * np.pi * line.x() / wavelength)[:, None]
full = np.pi * steel * amplitude / wavelength
wavy = solve_load(Influence(line, steel, periodic=True), crests, mean_pressure_pa=share * full)
westergaard = 2 / np.pi * np.arcsin(np.sqrt(share))
print(f"wave: {wavy.area_fraction:.4f} of it in contact, Westergaard {westergaard:.4f}")

# Any heights [m] on equal cells: here waves in random directions.
x, y = np.meshgrid(1e-6 * np.arange(96), 1e-6 * np.arange(96), indexing="ij")
waves = np.random.default_rng(1).normal(0.0, [3e5, 3e5, 2.0], (40, 3))
heights = 2e-8 * np.sum([np.sin(kx * x + ky * y + phase) for kx, ky, phase in waves], axis=0)
influence = Influence(Grid.of(heights, dx=1e-6), steel)
pushed = solve(influence, heights, penetration_m=1e-7)
loaded = solve_load(influence, heights, mean_pressure_pa=pushed.mean_pressure)
print(f"100 nm deep: {pushed.mean_pressure / 1e6:.1f} MPa, under which it is {heights.max() - loaded.plane:.4e} m")
for each in solve_loads(influence, heights, np.geomspace(1e6, 1e9, 7)):
    area = each.shares.mean()
    print(f"{each.mean_pressure / 1e6:7.1f} MPa: {area:.4f} of the area in contact, residual {each.residual:.0e}")

# The softer the surface, the nearer is its area to the load over the hardness, which no pressure exceeds.
for hardness in (1e11, 1e10, 2e9):
    soft = solve_load(influence, heights, mean_pressure_pa=1e9, hardness_pa=hardness)
    print(f"hardness {hardness:.0e} Pa: {soft.shares.mean():.4f} in contact, load over hardness {1e9 / hardness:.4f}")

# A DataArray with coordinates brings its cells; results become Datasets.
field = xr.DataArray(heights, {"x": x[:, 0], "y": y[0]}, ("x", "y"))
print(to_xarray(solve(influence, field.to_numpy(), penetration_m=1e-7), Grid.of(field)).pressure[:2, :2])
