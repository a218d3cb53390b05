"""Arrays of the three branches from which every statement follows that can, and what is said of them."""

import json

import numpy as np

from roughslip.verdicts.statements import STATEMENTS, claims

READINGS = [(statement.id, reading) for statement in STATEMENTS for reading in statement.readings]
METHODS = ("monte_carlo", "latin_hypercube", "equation_8", "equation_9", "roughslip")
LENGTHS = ("least_squares", "one_over_e", "log_line")
LEVELS = 3  # 10, 50, 90


def with_interval(name, value, low, high):
    return {name: np.array(value), f"{name}_low": np.array(low), f"{name}_high": np.array(high)}


def square():
    """A scene in which every statement on Figure 2 holds."""
    return {
        "method": np.array(METHODS),
        "fit": np.array(METHODS[2:]),
        "fit_samples": np.array([634, 634, 1000]),
        "captured_variance": np.array(0.95),
        "fit_positive_share": np.array([0.4, 1.0, 0.16]),
        **with_interval("distance_in_contact", [0.02] * 5, [0.01] * 5, [0.03] * 5),
        **with_interval("tail_error", [0.1] * 5, [0.05] * 5, [0.2] * 5),
        **with_interval("distance_between_variants", 0.02, 0.01, 0.03),
        "distance": np.array([0.0, 0.002, 0.03, 0.8, 0.003]),
        **with_interval("contact_probability", [0.16] * 5, [0.158] * 5, [0.162] * 5),
        "variant": np.array(METHODS[2:4]),
        "given_surfaces": np.array(900),
        "given_tail_from": np.array(0.01),
        "given_positive_share": np.array([0.98, 1.0]),
        **with_interval("given_distance", [0.03, 0.04], [0.02, 0.03], [0.04, 0.05]),
        **with_interval("given_tail_error_of_design", [0.1, 0.1], [0.05, 0.05], [0.2, 0.2]),
        **with_interval("given_between", 0.05, 0.04, 0.06),
    }


def friction():
    """A scene in which every statement on the friction coefficient holds, but for the one that cannot."""
    lag = 15e-6 * np.arange(121)
    table = {"percentile": np.array([10.0, 50.0, 90.0]), "lag": lag, "triangle": np.maximum(1 - lag / 600e-6, 0)}
    for name, value, half in (
        ("combined_misfit_difference", -0.01, 0.005),
        ("combined_skewness", 0.56, 0.1),
        ("combined_kurtosis", 0.3, 0.1),
        ("beta_distance_standardised", 0.02, 0.02),
        ("misfit_exponential", 0.03, 0.01),
        ("set_beta_a", 2.1, 0.5),
        ("set_beta_b", 5.0, 1.0),
        *((f"combined_length_{name}", 250e-6, 20e-6) for name in LENGTHS),
    ):
        ones = np.ones(LEVELS)
        table |= with_interval(name, value * ones, (value - half) * ones, (value + half) * ones)
    table["misfit_triangle"] = np.full(LEVELS, 3e-4)
    table |= {"length_name": np.array(LENGTHS), "triangle_length": np.full(3, 3e-4)}
    for name in ("beta_a", "beta_b"):
        table[name] = np.full(LEVELS, 2.0)
    table["beta_at_bound"] = np.zeros(LEVELS, dtype=np.int8)
    for name in ("mean", "std", "variation"):
        table |= with_interval(f"combined_{name}", [0.3, 0.2, 0.1], [0.29, 0.19, 0.09], [0.31, 0.21, 0.11])
        table |= with_interval(f"trend_combined_{name}_change", -0.2, -0.3, -0.1)
        table |= with_interval(f"trend_combined_{name}_line", -0.2, -0.3, -0.1)
    table |= with_interval("ratio_of_sums", [0.3, 0.2, 0.1], [0.29, 0.19, 0.09], [0.31, 0.21, 0.11])
    table |= with_interval("load_windows", [4.0, 2.0, 1.0], [4.0, 2.0, 1.0], [4.0, 2.0, 1.0])
    table |= with_interval("load_std", [0.06, 0.04, 0.02], [0.055, 0.035, 0.015], [0.065, 0.045, 0.025])
    return table | with_interval("trend_combined_length_least_squares_line", 0.0, -1e-5, 1e-5)


def oscillator():
    """A scene in which every statement on Figure 5 holds."""
    return {
        "nominal_damping": np.array(0.17),
        "deterministic_existence_limit": np.array(0.3244),
        "damping_ratio": np.array([0.05, 0.17, 0.32, 0.33, 0.4]),
        "deterministic_cycles": np.array([83, 91, 94, 0, 0]),
        "mean_cycles": np.array([83.0, 91.0, 60.0, 5.0, 0.5]),
        "difference": np.array([0.0, 0.0, 34.0, -5.0, -0.5]),
        "difference_low": np.array([-1.0, -1.0, 30.0, -6.0, -0.7]),
        "difference_high": np.array([1.0, 1.0, 38.0, -4.0, -0.3]),
        **with_interval("still_cycling", [1, 1, 0.6, 0.3, 0], [0.98, 0.98, 0.5, 0.2, 0], [1, 1, 0.7, 0.4, 0.01]),
        **with_interval("cycling_share", 1.0, 0.98, 1.0),
        **with_interval("stick_slip_share", [1, 1, 0.6, 0.06, 0], [1, 0.98, 0.5, 0.04, 0], [1, 1, 0.7, 0.08, 0.01]),
        **with_interval("returns", [83, 91, 60, 5, 0.5], [83, 90, 50, 4, 0.3], [84, 92, 70, 6, 0.7]),
        **with_interval("reattachment_distance_to_normal", 0.15, 0.12, 0.18),
        **with_interval("reattachment_skewness", 0.3, 0.2, 0.4),
        **with_interval("reattachment_kurtosis", 0.0, -0.1, 0.1),
        "friction_scatter": np.array(0.05),
        "load_response_additive": np.array(1.0),
        "load_response_multiplicative": np.array(1.2),
        "friction_percentile": np.array(50.0),
    }


def judge(*, square_=None, friction_=None, oscillator_=None):
    claim_list = claims(square_, friction_, oscillator_)
    json.dumps(claim_list, allow_nan=False)
    readings = {f"{claim['id']}/{one['id']}": one for claim in claim_list for one in claim["readings"]}
    return {claim["id"]: claim for claim in claim_list} | readings


def judge_one(name, arrays):
    """One statement, or one of its readings, from the arrays of its branch."""
    identity, _, reading = name.partition("/")
    (claim,) = (statement.claim(arrays) for statement in STATEMENTS if statement.id == identity)
    return next((one for one in claim["readings"] if one["id"] == reading), claim)


def everything():
    return judge(square_=square(), friction_=friction(), oscillator_=oscillator())
