"""Scatter of friction near the limit of stick-slip: an ensemble of paths, and theory of first order."""

import numpy as np

from roughslip.friction import FrictionProcess, path_sampler
from roughslip.oscillator import (
    KeptPath,
    Oscillator,
    StribeckLaw,
    count_difference,
    ensemble,
    grazing_response,
)
from roughslip.probability import BetaDistribution

belt = Oscillator(
    mass_kg=1.0,
    natural_frequency_rad_per_s=316.0,
    damping_ratio=0.17,
    belt_velocity_m_per_s=0.948,
    normal_force_n=2500.0,
)
law = StribeckLaw(fit=0.3)
process = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.03), correlation_length_m=2.9e-4)

# To first order, each loop of the orbit has its own limit of damping: normal about the limit without scatter.
response = grazing_response(belt, law)
scatter = 0.03 * response.scatter(process.correlation_length_m)
print(f"without scatter the cycle ends at D = {response.limit:.4f}; with it the limit scatters by {scatter:.4f}")

dampings = response.limit + scatter * np.array([-4.0, -2.0, -1.0, 1.0, 4.0])
paths = path_sampler(process, spacing_m=process.correlation_length_m / 4, length_m=2.0)
runs = [KeptPath(paths.realisation([1, number])) for number in range(24)]
counts = ensemble(belt, law, runs, paths.spacing, over={"damping": dampings}).cycles
(without,) = ensemble(belt, law, [None], over={"damping": dampings}).cycles
lost = count_difference(without, counts)
print("cycles in 100 natural periods:")
for row in zip(dampings, without, lost.mean, lost.low, lost.high, strict=True):
    print("  D = {:.4f}: {} without scatter, {:.1f} with it; lost {:.1f} to {:.1f}".format(*row))
