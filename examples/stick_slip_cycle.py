"""A mass on a belt: its stick-slip cycle, and the limits of damping where it begins and ends."""

import math
from dataclasses import replace

import numpy as np

from roughslip.oscillator import Oscillator, StribeckLaw, existence_limit, hopf_damping, limit_cycle, simulate

belt = Oscillator(
    mass_kg=1.0,
    natural_frequency_rad_per_s=316.0,
    damping_ratio=0.17,
    belt_velocity_m_per_s=0.948,
    normal_force_n=2500.0,
)
law = StribeckLaw(fit=0.3)

# The cycle as the root of a return map, and as what a long run settles on.
cycle = limit_cycle(belt, law)
run = simulate(belt, law, duration_periods=100.0)
settled = float(run.reattachments(after_periods=50.0)[-1])
period = float(np.diff(run.time[run.backwards])[-1])
print(f"sticks again at {cycle.reattachment * 1e3:.6f} mm, in a run of 100 periods at {settled * 1e3:.6f} mm")
print(f"period {cycle.period:.6f}, in the run {period:.6f}; without friction 2 pi = {2 * math.pi:.6f}")

# Steady sliding is unstable where the slope of friction outweighs the damper: D = -mu'(v0) N / (2 m omega).
slope = -0.3 * 1.42 / (1 + 1.42 * 0.948) ** 2 + 2 * 0.01 * 0.948
by_hand, hopf, end = -slope * 2500.0 / (2 * 316.0), hopf_damping(belt, law), existence_limit(belt, law)
print(f"sliding is unstable below D = {hopf:.4f}, by hand {by_hand:.4f}; the cycle exists up to {end:.4f}")
counts = {}
for damping in (0.2, 0.28, end - 0.001, end + 0.001):
    counts[damping] = simulate(replace(belt, damping_ratio=damping), law, duration_periods=100.0).cycles
    print(f"  D = {damping:.4f}: {counts[damping]} cycles in 100 natural periods")
