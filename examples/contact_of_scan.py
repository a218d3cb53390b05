"""Contact of a scan: at a penetration, under a load, and its area against load."""

from pathlib import Path

import numpy as np

from roughslip.contact import Influence, Material, solve, solve_load, solve_loads
from roughslip.scan import read_scan, remove_form

file = Path(__file__).resolve().parents[1] / "config/scans/ground.nc"  # or of an instrument, as a path or as text
scan = remove_form(read_scan(file), "plane")
influence = Influence(scan.grid, Material(young_modulus_pa=2.1e11, poisson_ratio=0.3).plane_strain_modulus_pa)
deep = solve(influence, scan.heights, penetration_m=3e-7, tolerance=1e-8)
pressed = solve_load(influence, scan.heights, deep.mean_pressure, tolerance=1e-8)
print(f"300 nm deep: {deep.mean_pressure / 1e6:.1f} MPa; under that load {deep.plane - pressed.plane:.1e} m from there")
curve = solve_loads(influence, scan.heights, np.geomspace(1e6, 1e9, 7), tolerance=1e-8)
for pressure, area in zip(curve.mean_pressure, curve.area, strict=True):
    print(f"{pressure / 1e6:7.1f} MPa: {area:.4f} of the area in contact")
