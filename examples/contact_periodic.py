"""A periodic surface, from the first touch to full contact: next to the two known ends of the curve."""

import numpy as np

from roughslip import Grid, to_xarray
from roughslip.contact import Influence, solve_load

# An egg box: cos(x) cos(y). Its light contact is many Hertz contacts, its last gaps are cracks that close.
# (K. L. Johnson, J. A. Greenwood and J. G. Higginson, Int. J. Mech. Sci. 27 (1985) 383.)
amplitude, wavelength, modulus = 1e-6, 1e-4, 2.3e11
grid = Grid(nx=256, ny=256, dx=wavelength / 256, dy=wavelength / 256)
wave = 2 * np.pi / wavelength
heights = amplitude * np.cos(wave * grid.x())[:, None] * np.cos(wave * grid.y())[None, :]
influence = Influence(grid, modulus, periodic=True)

full = np.sqrt(2) * np.pi * modulus * amplitude / wavelength
area = {}
print(f"full contact at {full / 1e9:.2f} GPa; share of the surface in contact:")
for load in (0.001, 0.01, 0.1, 0.5, 0.9, 0.99):
    solution = solve_load(influence, heights, mean_pressure_pa=load * full)
    area[load] = solution.shares.mean()
    light, heavy = np.pi * (3 * load / (8 * np.pi)) ** (2 / 3), 1 - 3 / (2 * np.pi) * (1 - load)
    print(f"  load {load:5}: {area[load]:.4f}   Hertz, light contact: {light:.4f}   cracks, heavy contact: {heavy:.4f}")

# The same result with coordinates and units, for xarray.
print(to_xarray(solution, grid)["pressure"].isel(y=0, x=slice(0, 3)))
