"""Slices of scenes that the tests of several stages start from."""

import copy

CONTACT = {
    "seed": 7,
    "roughness": {"covariance": "gaussian", "rms_height_m": 2e-7, "correlation_length_m": 1.5e-5},
    "material": {"young_modulus_pa": 2.1e11, "poisson_ratio": 0.3},
    "square": {"edge_m": 6e-5, "nodes": 6, "modes": 36},
    "strip": {
        "width_m": 2.5e-5,
        "cell_m": 5e-6,
        "window_m": 1e-4,
        "window_spacing_m": 2e-5,
        "penetration_percentiles": [30.0, 50.0],
    },
    "expansion": {},
    "numerics": {"contact_tolerance": 1e-10},
}

OSCILLATOR = {
    "mass_kg": 1.0,
    "stiffness_n_per_m": 316.0**2,
    "damping_ratio": 0.17,
    "belt_velocity_m_per_s": 0.948,
    "normal_force_n": 2500.0,
    "excitation_force_n": 0.0,
    "excitation_frequency_rad_per_s": 316.0,
    "static_friction": 0.4,
    "stribeck_decay_s_per_m": 1.42,
    "stribeck_quadratic_s2_per_m2": 0.01,
}


def changed(scene: dict, **sections: dict) -> dict:
    """A copy of the scene with other values in some of its sections."""
    new = copy.deepcopy(scene)
    for section, values in sections.items():
        new[section] = new.get(section, {}) | values
    return new
