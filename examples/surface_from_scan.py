"""From a scan to a model of it, and a twin drawn from the model."""

from pathlib import Path

import numpy as np

from roughslip.probability import empirical_distribution
from roughslip.scan import Topography, fitted_covariances, read_scan, remove_form, scan_statistics
from roughslip.surface import gaussian_model

file = Path(__file__).resolve().parents[1] / "config/scans/ground.nc"  # or of an instrument, with roughslip[scans]
scan = remove_form(read_scan(file), "plane")
grid = scan.grid

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

model = gaussian_model(best, marginal=empirical_distribution(scan.heights, float(rms.value)))
twin = model.heights(model.sampler(grid)(np.random.default_rng(2)))
again = scan_statistics(Topography(twin, grid.dx, grid.dy, np.zeros(grid.shape, bool)))
print(f"twin: Sq {again.rms_height.value * 1e6:.3f} µm, skewness {again.skewness.value:.2f}")
