"""Scatter of friction near the limit of stick-slip: an ensemble of paths, and theory of first order."""

import numpy as np

from roughslip.friction import Friction
from roughslip.oscillator import (
    Machine,
    Oscillator,
    StribeckLaw,
    count_difference,
    ensemble,
    grazing_response,
)

belt = Oscillator(
    mass_kg=1.0,
    natural_frequency_rad_per_s=316.0,
    damping_ratio=0.17,
    belt_velocity_m_per_s=0.948,
    normal_force_n=2500.0,
)
machine = Machine(belt, StribeckLaw(fit=0.3), Friction(mean=0.3, deviation=0.03, length_m=2.9e-4))

# To first order, each loop of the orbit has its own limit of damping: normal about the limit without scatter.
response = grazing_response(machine)
scatter = 0.03 * response.scatter(2.9e-4)
print(f"without scatter the cycle ends at D = {response.limit:.4f}; with it the limit scatters by {scatter:.4f}")

dampings = response.limit + scatter * np.array([-4.0, -2.0, -1.0, 1.0, 4.0])
runs = [machine.kept_path([1, number]) for number in range(24)]
counts = ensemble(machine, runs, machine.paths.spacing, over={"damping": dampings}).cycles
(without,) = ensemble(machine, [None], over={"damping": dampings}).cycles
lost = count_difference(without, counts)
print("cycles in 100 natural periods:")
for row in zip(dampings, without, lost.mean, lost.low, lost.high, strict=True):
    print("  D = {:.4f}: {} without scatter, {:.1f} with it; lost {:.1f} to {:.1f}".format(*row))
