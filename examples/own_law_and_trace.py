"""A friction law given as a function, and friction along the belt given as an array."""

import itertools
import math

import numpy as np

from roughslip.oscillator import Oscillator, existence_limit, friction_law, hopf_damping, simulate

belt = Oscillator(
    mass_kg=2.0,
    natural_frequency_rad_per_s=60.0,
    damping_ratio=0.05,
    belt_velocity_m_per_s=0.05,
    normal_force_n=40.0,
)


def falling(speed: float) -> float:
    """Any function of speed in terms that numba compiles; derivatives follow by differences."""
    return 0.25 + 0.1 * math.exp(-speed / 0.04)


law = friction_law(falling, static=0.38)
by_hand = 0.1 / 0.04 * math.exp(-0.05 / 0.04) * 40.0 / (2 * 2.0 * 60.0)  # -mu'(v0) N / (2 m omega)
print(f"sliding is unstable below D = {hopf_damping(belt, law):.5f}, by hand {by_hand:.5f}")
print(f"the cycle exists up to D = {existence_limit(belt, law):.3f}")

# Friction as measured along a track of 20 mm, a value each 50 µm: what is left of it after the mean curve.
track = 0.01 * np.random.default_rng(1).standard_normal(400).cumsum() / 20
track -= track.mean()
ended = simulate(belt, law, track, spacing_m=5e-5, duration_periods=3.0)
repeated = simulate(belt, law, itertools.repeat(track), spacing_m=5e-5, duration_periods=100.0)
print(f"{ended.cycles} cycles on the track once, {repeated.cycles} in 100 natural periods round and round")
