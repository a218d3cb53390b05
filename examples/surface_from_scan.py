"""From a scan to a model of it, and a twin drawn from the model. The scan here is simulated, so we know its maker."""

import tempfile
from pathlib import Path

import numpy as np
import xarray as xr

from roughslip import Grid
from roughslip.scan import (
    Grinding,
    Topography,
    fitted_covariances,
    fitted_marginal,
    ground_surface,
    read_scan,
    remove_form,
    scan_statistics,
)
from roughslip.surface import gaussian_model

grid = Grid(nx=400, ny=200, dx=1e-6, dy=0.5e-6)
heights = ground_surface(Grinding(), grid, np.random.default_rng(1))
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder, "scan.nc")  # an instrument's file is read in the same way, with roughslip[scans]
    axes = {"x": ("x", grid.x(), {"units": "m"}), "y": ("y", grid.y(), {"units": "m"})}
    xr.Dataset({"heights": (("x", "y"), heights * 1e6, {"units": "um"})}, coords=axes).to_netcdf(path)
    scan = remove_form(read_scan(path), "plane")

found = scan_statistics(scan)
rms, skewness = found.rms_height, found.skewness
print(f"Sq {rms.value * 1e6:.3f} µm, 95 % interval {rms.low * 1e6:.3f} to {rms.high * 1e6:.3f}")
print(f"skewness {skewness.value:.2f}, {skewness.low:.2f} to {skewness.high:.2f}: ground surfaces have grooves")
fits, refused = fitted_covariances(["gaussian", "exponential", "matern"], scan, found)
best = fits[0].covariance
print(
    f"best covariance: {best.kind}, {best.axis_lengths_m[0] * 1e6:.1f} µm along the grooves, "
    f"{best.axis_lengths_m[1] * 1e6:.1f} µm across"
)

model = gaussian_model(best, marginal=fitted_marginal("empirical", scan, float(rms.value)))
twin = model.heights(model.sampler(grid)(np.random.default_rng(2)))
again = scan_statistics(Topography(twin, grid.dx, grid.dy, np.zeros(grid.shape, bool)))
print(f"twin: Sq {again.rms_height.value * 1e6:.3f} µm, skewness {again.skewness.value:.2f}")
