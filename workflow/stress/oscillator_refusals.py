"""Bad input to the oscillator, each kind once: a ParameterError and nothing else is the answer to all of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roughslip.oscillator.law import CoulombLaw, StribeckLaw, TableLaw
from roughslip.oscillator.motion import simulate, trajectory
from roughslip.oscillator.periodic import counts_by_period
from roughslip.oscillator.system import Oscillator

STUDY: dict[str, Any] = {
    "mass_kg": 1.0,
    "natural_frequency_rad_per_s": 316.0,
    "damping_ratio": 0.17,
    "belt_velocity_m_per_s": 0.948,
    "normal_force_n": 2500.0,
}
LAW = StribeckLaw(0.3)
NAN, INFINITY = math.nan, math.inf
NOT_POSITIVE = {"zero": 0.0, "negative": -1.0, "nan": NAN, "infinite": INFINITY}
NOT_A_PATH: dict[str, Any] = {
    "nan": np.array([0.0, NAN, 0.0]),
    "infinite": np.array([0.0, INFINITY, 0.0]),
    "one node": np.zeros(1),
    "empty": np.zeros(0),
    "two-dimensional": np.zeros((3, 3)),
    "too short": np.zeros(8),
}


def _run(**changed: Any) -> object:
    valid = {"path": None, "spacing_m": 1e-4, "duration_periods": 3.0}
    return simulate(Oscillator(**STUDY), LAW, **(valid | changed))


def _refused() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    for name, value in NOT_POSITIVE.items():
        for key in ("mass_kg", "natural_frequency_rad_per_s", "normal_force_n"):
            calls[f"{key} {name}"] = partial(Oscillator, **(STUDY | {key: value}))
        calls[f"duration {name}"] = partial(_run, duration_periods=value)
        calls[f"tolerance {name}"] = partial(_run, tolerance=value)
        calls[f"spacing {name}"] = partial(_run, path=np.zeros(9), spacing_m=value)
    for name in ("negative", "nan", "infinite"):
        for key in ("damping_ratio", "belt_velocity_m_per_s", "excitation_force_n", "excitation_frequency_rad_per_s"):
            calls[f"{key} {name}"] = partial(Oscillator, **(STUDY | {key: NOT_POSITIVE[name]}))
        for key in ("fit", "static", "decay_s_per_m", "quadratic_s2_per_m2"):
            calls[f"stribeck {key} {name}"] = partial(StribeckLaw, **({"fit": 0.3} | {key: NOT_POSITIVE[name]}))
        calls[f"coulomb {name}"] = partial(CoulombLaw, NOT_POSITIVE[name], 0.4)
        calls[f"table value {name}"] = partial(TableLaw, (0.0, 1.0), (0.4, NOT_POSITIVE[name]))
        calls[f"table speed {name}"] = partial(TableLaw, (0.0, NOT_POSITIVE[name]), (0.4, 0.3))
    for name, path in NOT_A_PATH.items():
        calls[f"path {name}"] = partial(_run, path=path)
    words: dict[str, Any] = {"interpolation": "quintic", "friction_follows": "load", "negative_friction": "allow"}
    for key, word in {**words, "integrator": "euler"}.items():
        calls[f"{key} {word}"] = partial(_run, **{key: word})
    driven = Oscillator(**STUDY, excitation_force_n=1.0, excitation_frequency_rad_per_s=316.0)
    return calls | {
        "start nan": partial(_run, start_position_m=NAN),
        "start infinite": partial(_run, start_position_m=-INFINITY),
        "tolerance above": partial(_run, tolerance=1e-2),
        "a belt at rest that friction follows": partial(
            simulate,
            Oscillator(**(STUDY | {"belt_velocity_m_per_s": 0.0})),
            LAW,
            None,
            0.0,
            1.0,
            friction_follows="belt",
        ),
        "kinetic above static": partial(CoulombLaw, 0.4, 0.3),
        "table descending": partial(TableLaw, (0.0, 1.0, 0.5), (0.4, 0.3, 0.2)),
        "table of other lengths": partial(TableLaw, (0.0, 1.0), (0.4, 0.3, 0.2)),
        "table interpolation": partial(TableLaw, (0.0, 1.0), (0.4, 0.3), interpolation="quintic"),
        "no samples": partial(trajectory, Oscillator(**STUDY), LAW, None, 0.0, 1.0, samples_per_period=0),
        "counts by period with excitation": partial(counts_by_period, driven, LAW, 10.0, [0.1]),
        "a mass in text": partial(Oscillator, **(STUDY | {"mass_kg": "heavy"})),
        "a law in text": partial(StribeckLaw, "0.3"),  # type: ignore[arg-type]
    }


REFUSED = _refused()
