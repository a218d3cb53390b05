"""Friction of windows that slide along rough strips, and a stochastic process with the same statistics."""

import numpy as np

from roughslip import Grid
from roughslip.contact import Influence, contact_shares, solve
from roughslip.friction import (
    FrictionProcess,
    friction_coefficient,
    sample_path,
    strip_weights,
    window_statistics,
    window_sums,
)
from roughslip.probability import BetaDistribution
from roughslip.surface import covariance_of, gaussian_model

# Strips of 3000 µm x 25 µm, the plane at the median of the heights. Windows are 600 µm long, and lie 300 µm from ends.
grid = Grid(nx=1200, ny=10, dx=2.5e-6, dy=2.5e-6)
surface = gaussian_model(covariance_of("gaussian", rms_height_m=5e-8, correlation_length_m=1.416e-5))
draw, influence = surface.sampler(grid), Influence(grid, plane_strain_modulus_pa=2.3e11)
area, force = [], []
for number in range(60):
    strip = solve(influence, interference=draw(np.random.default_rng([1, number])), tolerance=1e-6)
    cells = np.stack([contact_shares(strip.pressure), strip.pressure]).sum(axis=2)[:, 120:-120]
    for name, sums in zip((area, force), window_sums(cells, window_nodes=240, stride_nodes=12), strict=True):
        name.append(grid.cell_area * sums)

# Junctions shear at one strength. It is not known, so it is set to give the mean of 0.3.
ratio = np.mean(np.array(area) / np.array(force))
mu, valid = friction_coefficient(np.array(area), np.array(force), shear_strength_pa=0.3 / ratio, least_area_m2=1e-12)
found = window_statistics(mu, valid, strip_weights(len(mu), 200, np.random.default_rng(2)))
variation = found.variation
print(f"mean {found.mean.value:.3f}, scatter {variation.value:.1%} of it, {variation.low:.1%} to {variation.high:.1%}")
print("the full study finds 11.1 % (10.8 % to 11.3 %), on cells of half the edge and 240 strips")

# A process with these moments, a Beta marginal and an exponential correlation, at 20000 places 25 µm apart.
marginal = BetaDistribution.of_moments(2.1, 5.0, float(found.mean.value), float(found.std.value))
process = FrictionProcess(marginal, correlation_length_m=2.9e-4)
path = sample_path(process, spacing_m=2.5e-5, nodes=20_000, seed=[3])
correlation = np.mean(path[12:] * path[:-12]) / path.var()
print(
    f"path: scatter {path.std() / found.mean.value:.1%}, correlation at 300 µm {correlation:.3f}, "
    f"exponential {np.exp(-300 / 290):.3f}"
)
