"""From a stage's slice of the scene and the friction statistics to the oscillator and its mean friction law."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import InputError
from roughslip.friction.penetration_law import between
from roughslip.oscillator.law import CoulombLaw, FrictionLaw, StribeckLaw, TableLaw
from roughslip.oscillator.system import Oscillator
from roughslip.scene.types import Scene

DRAWN_PERIODS = 10  # natural periods of a trajectory that are kept for drawing


@dataclass(frozen=True)
class FrictionNumbers:
    """What the oscillator takes from the friction statistics at one penetration.

    mean, standard_deviation : of the friction coefficient
    correlation_length_m : [m] of its exponential autocorrelation
    beta_a, beta_b : shapes of its marginal
    """

    mean: float
    standard_deviation: float
    correlation_length_m: float
    beta_a: float
    beta_b: float


def friction_numbers(scene: Scene, statistics: Path | None) -> FrictionNumbers:
    """The numbers that the scene gives, or else those of the statistics file at its penetration, by default the median.

    The mean is mu_fit(d); it and the scatter come from the solved windows with the expansion as control, the shape from
    the solved windows. Between two penetrations that were solved each number lies on its own curve through them
    (`friction.penetration_law`); shapes that the windows do not determine (`beta_at_bound`) lie there by chance, where
    `ensemble.marginal: paper` is the safer choice.
    """
    given = scene.friction.statistics
    if given is not None:
        return FrictionNumbers(**{field.name: getattr(given, field.name) for field in fields(FrictionNumbers)})
    if statistics is None:
        raise InputError("the oscillator needs --friction where the scene gives no friction statistics")
    result = store.read(statistics)
    percentile = float(scene.oscillator.penetration_percentile)
    columns = {
        "mean": result["combined_mean"],
        "standard_deviation": result["combined_std"],
        "correlation_length_m": result["length_least_squares"][0],
        "beta_a": result["beta_a"][0],
        "beta_b": result["beta_b"][0],
    }
    levels = result["percentile"]
    return FrictionNumbers(**{name: between(levels, values, percentile) for name, values in columns.items()})


def oscillator(scene: Scene) -> Oscillator:
    """The mass on the belt."""
    section = scene.oscillator
    return Oscillator(
        mass_kg=section.mass_kg,
        natural_frequency_rad_per_s=section.natural_frequency_rad_per_s,
        damping_ratio=section.damping_ratio,
        belt_velocity_m_per_s=section.belt_velocity_m_per_s,
        normal_force_n=section.normal_force_n,
        excitation_force_n=section.excitation_force_n,
        excitation_frequency_rad_per_s=section.excitation_frequency_rad_per_s,
    )


def law(scene: Scene, mean: float) -> FrictionLaw:
    """The scene's law: eq. (13) with the mean friction coefficient as mu_fit, Coulomb's with it as kinetic value, or a
    table, which takes its place. Raises InputError where the mean exceeds the static coefficient."""
    section = scene.oscillator
    kind, static = section.law, section.static_friction
    if kind == "table":
        table = section.friction_table
        return TableLaw(
            speeds_m_per_s=tuple(table.speeds_m_per_s),
            values=tuple(table.values),
            static=static,
            interpolation=table.interpolation,
        )
    if mean > static:
        reason = "stick holds less than slip" if kind == "coulomb" else "eq. (13) turns negative at high speed"
        raise InputError(
            f"oscillator.static_friction: {static:g} is less than the mean friction coefficient {mean:.3g} at the "
            f"penetration of the oscillator, so that {reason}: raise it"
        )
    if kind == "coulomb":
        return CoulombLaw(kinetic=mean, static=static)
    return StribeckLaw(
        fit=mean,
        static=static,
        decay_s_per_m=section.stribeck_decay_s_per_m,
        quadratic_s2_per_m2=section.stribeck_quadratic_s2_per_m2,
    )


def run_options(scene: Scene) -> dict[str, Any]:
    """How every run of the scene treats friction, and how it is integrated, as `simulate` takes it."""
    section = scene.oscillator
    return {
        "tolerance": scene.numerics.oscillator_tolerance,
        "stochastic_static_limit": section.stochastic_static_limit,
        "interpolation": scene.ensemble.interpolation,
        "friction_follows": section.friction_follows,
        "negative_friction": section.negative_friction,
        "integrator": section.integrator,
    }


def path_length(belt: Oscillator, duration_periods: float, follows: str = "slip") -> float:
    """Length of a path that no run exceeds by far: its time [s], or the belt's travel [m] and ten spans of the friction
    force for slip that crosses to the other sign. A run that needs more ends with an error that says so."""
    if follows == "time":
        return 2 * np.pi * (1 + duration_periods) / belt.natural_frequency_rad_per_s
    return belt.V * 2 * np.pi * duration_periods + 10 * belt.F
