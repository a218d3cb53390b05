"""Curve and scatter of a friction record, as a stage has stored them. It depends on no code that fits."""

from __future__ import annotations

import numpy as np

from roughslip.record.result import FrictionCurve, FrictionScatter
from roughslip.store import Result


def is_record(result: Result) -> bool:
    """Whether friction is that of a record, and not of windows."""
    return "record_mean" in result


def curve_of(result: Result) -> FrictionCurve:
    """The curve of a stored record."""
    form = str(result["curve_form"][0])
    at_rest = float(result["curve_at_rest"]), result["curve_factor_at_rest"]
    factor, misfit = result["curve_factor"], float(result["misfit"])
    return FrictionCurve(form, result["curve_speed"], result["curve"], factor, misfit, *at_rest)


def scatter_of(result: Result, kind: str) -> FrictionScatter:
    """The scatter of a stored record, additive or multiplicative."""
    parameters = result[f"{kind}_parameters"]
    return FrictionScatter(
        float(result[f"{kind}_std"]),
        float(result[f"{kind}_length"]),
        result[f"{kind}_log_covariance"],
        str(result[f"{kind}_shape"][0]),
        tuple(map(float, parameters[np.isfinite(parameters)])),
        float(result[f"{kind}_lengths"]),
        bool(result[f"{kind}_identified"]),
    )
