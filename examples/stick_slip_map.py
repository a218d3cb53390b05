"""Where does it squeal? The probability of stick-slip over damping and belt velocity, as a picture of letters."""

from dataclasses import replace

import numpy as np

from roughslip.friction import FrictionProcess, sample_path
from roughslip.oscillator import Machine, Oscillator, StribeckLaw, existence_limit, hopf_damping, run_until_known
from roughslip.probability import BetaDistribution

pad = Oscillator(
    mass_kg=1.0,
    natural_frequency_rad_per_s=316.0,
    damping_ratio=0.17,
    belt_velocity_m_per_s=0.948,
    normal_force_n=2500.0,
)
law = StribeckLaw(fit=0.3)
process = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.03), correlation_length_m=2.9e-4)
paths = [sample_path(process, spacing_m=7e-5, nodes=15_000, seed=[1, number]) for number in range(4)]


def stick_slip_share(belt: Oscillator, path: np.ndarray) -> float:
    """Of the second half of 20 natural periods after the first departure."""
    _, first, states = run_until_known(Machine(belt, law), path, 7e-5, 20.0)
    return states.share(first + 10.0, first + 20.0)


dampings, share, limits = np.linspace(0.05, 1.0, 20), {}, {}
print("# always, + often, . rarely; then the limits of steady sliding and of the cycle without scatter")
for velocity in (0.2, 0.4, 0.8, 1.6):
    belt = replace(pad, belt_velocity_m_per_s=velocity)
    limits[velocity] = hopf_damping(belt, law), existence_limit(belt, law)
    share[velocity] = np.array(
        [np.mean([stick_slip_share(replace(belt, damping_ratio=d), path) for path in paths]) for d in dampings]
    )
    letters = "".join("#" if p > 0.95 else "+" if p > 0.5 else "." if p > 0.05 else " " for p in share[velocity])
    print(f"{velocity:4} m/s |{letters}| D = 0.05 to 1; {limits[velocity][0]:.3f} {limits[velocity][1]:.3f}")
