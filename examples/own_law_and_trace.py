"""A friction law given as a function, friction along the belt given as an array, and two sweeps."""

import itertools
import math

import numpy as np

from roughslip.oscillator import Machine, Oscillator, ensemble, existence_limit, friction_law, hopf_damping, simulate

belt = Oscillator(
    mass_kg=2.0,
    natural_frequency_rad_per_s=60.0,
    damping_ratio=0.05,
    belt_velocity_m_per_s=0.05,
    normal_force_n=40.0,
)


def falling(speed: float) -> float:
    """Any smooth function of speed."""
    return 0.25 + 0.1 * math.exp(-speed / 0.04)


law = friction_law(falling, static=0.38)
by_hand = 0.1 / 0.04 * math.exp(-0.05 / 0.04) * 40.0 / (2 * 2.0 * 60.0)  # -mu'(v0) N / (2 m omega)
print(f"sliding is unstable below D = {hopf_damping(belt, law):.5f}, by hand {by_hand:.5f}")
print(f"the cycle exists up to D = {existence_limit(belt, law):.3f}")

# Friction as measured along eight tracks of 20 mm, a value each 50 µm: what is left after the mean curve.
tracks = 0.01 * np.random.default_rng(1).standard_normal((8, 400)).cumsum(axis=1) / 20
tracks -= tracks.mean(axis=1, keepdims=True)
ended = simulate(belt, law, tracks[0], spacing_m=5e-5, duration_periods=3.0)
print(f"{ended.cycles} cycles on a track once, in 100 natural periods round and round:")
runs = [itertools.repeat(track) for track in tracks]
counts = {}
for name, values in {"damping": np.linspace(0.05, 0.45, 9), "belt_velocity": np.linspace(0.02, 0.18, 9)}.items():
    counts[name] = ensemble(Machine(belt, law), runs, spacing_m=5e-5, over={name: values}).cycles
    (without,) = ensemble(Machine(belt, law), [None], over={name: values}).cycles
    for value, some, one in zip(values, counts[name].T, without, strict=True):
        print(f"  {name} {value:.2f}: {some.mean():.1f} ({some.min()} to {some.max()}), without the tracks {one}")
