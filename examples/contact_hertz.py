"""A sphere, a wave and a rough surface, pressed by a rigid plane: next to Hertz, Westergaard and Tamaas."""

import importlib.util

import numpy as np

from roughslip import Grid
from roughslip.contact import Influence, Material, solve, solve_load
from roughslip.surface import covariance_of, gaussian_model

steel = Material(young_modulus_pa=2.1e11, poisson_ratio=0.3).plane_strain_modulus_pa

# A ball of 1 mm radius, pushed 0.2 µm into the plane.
radius, penetration = 1e-3, 2e-7
contact_radius = np.sqrt(radius * penetration)
hertz = 4 / 3 * steel * contact_radius * penetration
grid = Grid(nx=128, ny=128, dx=2.5e-7, dy=2.5e-7)
x, y = np.meshgrid(grid.x() - grid.x().mean(), grid.y() - grid.y().mean(), indexing="ij")
pressed = solve(Influence(grid, steel), interference=penetration - (x**2 + y**2) / (2 * radius))
force = pressed.pressure.sum() * grid.cell_area
print(f"ball: force {force:.5f} N, Hertz {hertz:.5f} N")
print(
    f"ball: peak {pressed.pressure.max() / 1e6:.1f} MPa, Hertz {1.5e-6 * hertz / (np.pi * contact_radius**2):.1f} MPa"
)

# A wavy surface, one wavelength of it, at half of the pressure that flattens it.
amplitude, wavelength, share = 2e-7, 3e-5, 0.5
line = Grid(nx=256, ny=1, dx=wavelength / 256, dy=wavelength / 256)
crests = amplitude * np.cos(2 * np.pi * line.x() / wavelength)[:, None]
full = np.pi * steel * amplitude / wavelength
wavy = solve_load(Influence(line, steel, periodic=True), crests, mean_pressure_pa=share * full)
westergaard = 2 / np.pi * np.arcsin(np.sqrt(share))
print(f"wave: {wavy.area_fraction:.4f} of it in contact, Westergaard {westergaard:.4f}")

# A rough surface under 50 MPa, next to Tamaas where that is installed: the same equations, solved by others.
rough = gaussian_model(covariance_of("gaussian", rms_height_m=5e-8, correlation_length_m=3e-6))
heights = rough.sampler(grid)(np.random.default_rng(1))
loaded = solve_load(Influence(grid, steel, periodic=True), heights, mean_pressure_pa=5e7)
print(f"rough: {loaded.area_fraction:.4f} of it in contact, residual {loaded.residual:.0e}")
if importlib.util.find_spec("tamaas"):
    import tamaas

    tamaas.set_log_level(tamaas.LogLevel.error)
    model = tamaas.Model(tamaas.model_type.basic_2d, [grid.nx * grid.dx, grid.ny * grid.dy], list(grid.shape))
    model.E, model.nu = steel, 0.0
    tamaas.PolonskyKeerRey(model, heights, 1e-12).solve(5e7)
    print(f"rough: {np.count_nonzero(model.traction) / grid.size:.4f} in Tamaas")
