"""Amplitude of the vibration against belt velocity, with and without scatter of friction, from both initial states."""

from dataclasses import replace

import numpy as np

from roughslip.friction import FrictionProcess, sample_path
from roughslip.oscillator import Oscillator, StribeckLaw, equilibrium, trajectory
from roughslip.probability import BetaDistribution

pad, law = Oscillator(1.0, 316.0, 0.25, 0.948, 2500.0), StribeckLaw(fit=0.3)
process = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.01), correlation_length_m=2.9e-4)
path = sample_path(process, spacing_m=7e-5, nodes=30_000, seed=[1])


def amplitude(belt: Oscillator, mu: np.ndarray | None, start: float | tuple[float, float]) -> float:
    """Half the range [mm] of X over the last 20 of 60 natural periods."""
    run = trajectory(belt, law, mu, 7e-5, 60.0, start_m=start)
    return float(np.ptp(run.position[-20 * 400 :])) * 500


velocities, up, down, scattered = np.linspace(0.4, 1.6, 13), [], [], []
for velocity in velocities:
    belt = replace(pad, belt_velocity_m_per_s=velocity)
    sliding = equilibrium(belt, law), 0.05 * belt.V  # X and X': steady sliding, a little moved
    up.append(amplitude(belt, None, sliding))
    down.append(amplitude(belt, None, 0.0))  # from rest on the belt
    scattered.append((amplitude(belt, path, sliding), amplitude(belt, path, 0.0)))
    row = velocity, up[-1], down[-1], *scattered[-1]
    print("{:.1f} m/s: {:.3f} mm from sliding, {:.3f} from stick; with scatter {:.3f} and {:.3f}".format(*row))
