"""A periodic surface, from the first touch to full contact: next to the two known ends of the curve."""

import numpy as np

from roughslip import Grid, to_xarray
from roughslip.contact import CrossedWaves, Influence, solve_load

# An egg box: cos(x) cos(y). Its light contact is many Hertz contacts, its last gaps are cracks that close.
box = CrossedWaves(amplitude_m=1e-6, wavelength_m=1e-4, plane_strain_modulus_pa=2.3e11)
grid = Grid(nx=256, ny=256, dx=box.wavelength_m / 256, dy=box.wavelength_m / 256)
wave = 2 * np.pi / box.wavelength_m
heights = box.amplitude_m * np.cos(wave * grid.x())[:, None] * np.cos(wave * grid.y())[None, :]
influence = Influence(grid, box.plane_strain_modulus_pa, periodic=True)

full = box.full_contact_pressure_pa
area = {}
print(f"full contact at {full / 1e9:.2f} GPa; share of the surface in contact:")
for load in (0.001, 0.01, 0.1, 0.5, 0.9, 0.99):
    solution = solve_load(influence, heights, mean_pressure_pa=load * full)
    area[load] = solution.shares.mean()
    light, heavy = box.light_area_fraction(load * full), 1 - box.open_fraction(load * full)
    print(f"  load {load:5}: {area[load]:.4f}   Hertz, light contact: {light:.4f}   cracks, heavy contact: {heavy:.4f}")

# The same result with coordinates and units, for xarray.
print(to_xarray(solution, grid)["pressure"].isel(y=0, x=slice(0, 3)))
