"""A surface with a given distribution of heights: worn, with deep grooves and flat tops, skewness -1.5."""

import numpy as np

from roughslip import Grid
from roughslip.probability import BetaDistribution, beta_moments
from roughslip.surface import covariance_of, gaussian_model

shapes = 5.0, 0.73
heights_of = BetaDistribution.of_moments(*shapes, mean=0.0, standard_deviation=1e-6)
covariance = covariance_of("exponential", rms_height_m=1e-6, correlation_length_m=4e-6)
grid = Grid(nx=1024, ny=1024, dx=1e-6, dy=1e-6)

for correct in (False, True):  # whether the covariance is that of the heights, or of the Gaussian field behind them
    surface = gaussian_model(covariance, marginal=heights_of, correct_correlation=correct)
    z = surface.heights(surface.sampler(grid)(np.random.default_rng(3))) / covariance.rms_height_m
    skewness, kurtosis = np.mean(z**3), np.mean(z**4) - 3
    correlation = np.mean(z[4:] * z[:-4])
    print(
        f"{'corrected' if correct else 'uncorrected'}: skewness {skewness:.2f}, correlation at 4 µm {correlation:.3f}"
    )
moments = beta_moments(*shapes)
print(f"asked for: skewness {moments.skewness:.2f}, correlation {np.exp(-1):.3f}")
print(f"excess kurtosis {kurtosis:.2f}, that of the Beta distribution {moments.excess_kurtosis:.2f}")

# Deep grooves and flat tops: the plane that touches a tenth of the surface stands much lower than for Gaussian heights.
gaussian = gaussian_model(covariance).plane_height(percentile=10)
skewed = surface.plane_height(percentile=10)
print(f"10 % lie above {skewed * 1e6:.2f} µm, of Gaussian heights above {gaussian * 1e6:.2f} µm")
