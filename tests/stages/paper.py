"""The mass on the belt of the paper, as a slice of a scene."""

OSCILLATOR = {
    "mass_kg": 1.0,
    "natural_frequency_rad_per_s": 316.0,
    "damping_ratio": 0.17,
    "belt_velocity_m_per_s": 0.948,
    "normal_force_n": 2500.0,
    "excitation_force_n": 0.0,
    "excitation_frequency_rad_per_s": 316.0,
    "static_friction": 0.4,
    "stribeck_decay_s_per_m": 1.42,
    "stribeck_quadratic_s2_per_m2": 0.01,
    "stochastic_static_limit": True,
}
