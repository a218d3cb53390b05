"""The models of a scan as stage `scan` leaves them on disk, and back."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from roughslip import store
from roughslip.probability import EmpiricalDistribution, FamilyDistribution
from roughslip.surface.covariance import Covariance
from roughslip.surface.model import GaussianModel, gaussian_model, measured_model
from roughslip.surface.models import covariance_of


def stored(
    covariance: Covariance | None,
    marginal: FamilyDistribution | EmpiricalDistribution | None,
    correct_correlation: bool,
    rms_height_m: float,
) -> tuple[dict[str, store.Variable], dict[str, str]]:
    """Variables and the attribute `model` that `restored` reads; those of `scan_table` stand in the same file.

    covariance : None for the measured autocorrelation
    """
    variables = {}
    law: dict[str, Any] | None = None
    if isinstance(marginal, EmpiricalDistribution):
        law = {"tail_share": marginal.tail_share}
        one = ("score",)
        variables["marginal_score"] = store.Variable(one, marginal.normal, "1", "standard normal score")
        variables["marginal_height"] = store.Variable(one, marginal.values, "m", "height at that score")
    elif marginal is not None:
        law = asdict(marginal)
    model = {
        "covariance": None if covariance is None else {"kind": covariance.kind, **asdict(covariance)},
        "rms_height_m": rms_height_m,
        "marginal": law,
        "correct_correlation": correct_correlation,
    }
    return variables, {"model": json.dumps(model, sort_keys=True)}


def restored(result: store.Result) -> GaussianModel:
    """The model of a scan."""
    model = json.loads(result.attributes["model"])
    law = model["marginal"]
    marginal: FamilyDistribution | EmpiricalDistribution | None = None
    if law is not None and "tail_share" in law:
        marginal = EmpiricalDistribution(result["marginal_score"], result["marginal_height"], law["tail_share"])
    elif law is not None:
        marginal = FamilyDistribution(**{**law, "shapes": tuple(law["shapes"])})
    correct = model["correct_correlation"]
    if model["covariance"] is not None:
        field = covariance_of(**model["covariance"])
        return gaussian_model(field, field.axis_lengths_m, marginal, correct_correlation=correct)
    steps = (float(np.diff(result["lag_x"][:2])[0]), float(np.diff(result["lag_y"][:2])[0]))
    lengths = float(result["length_x"]), float(result["length_y"])
    table, rms = result["correlation"], model["rms_height_m"]
    return measured_model(table, steps, rms, lengths, marginal, correct_correlation=correct)
