"""What the rows of the chaos benchmark say beside the limits that the project promises. Nothing here is measured."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Any

from workflow.benchmarks.measure import OURS, Row, fields

DECISIVE = {"paper": 1000, "resolved": 2000}  # solves

# Of the median over designs, distance and relative errors; nine designs of ten stay within twice as much.
LIMITS = {
    "distance": 0.01,
    "contact_probability": 0.02,
    "mean_pressure": 0.015,
    "quantile_50": 0.03,
    "quantile_90": 0.03,
    "quantile_99": 0.05,
}
WITHIN_TWICE = 0.9


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Ours at the decisive numbers of solves beside the limits, the distances of all methods there, multilevel gains.

    limits : case -> quantity -> median, limit, designs, how many of them within twice the limit, met
    missed : cases and quantities above a limit
    distances : case -> method -> median
    multilevel : case -> how many times less a given standard error costs than by plain Monte Carlo
    """
    decisive = [row for row in rows if row["work"] == DECISIVE.get(fields(row["case"]).get("scene", ""))]
    decisive = [row for row in decisive if "distance" in row.get("errors", {})]
    limits = {row["case"]: beside_limits(row["errors"]) for row in decisive if row["method"] == OURS}
    distances: dict[str, dict[str, float]] = {}
    for row in decisive:
        distances.setdefault(row["case"], {})[row["method"]] = row["error"]
    return {
        "limits": limits,
        "missed": [f"{name} {what}" for name, found in limits.items() for what, one in found.items() if not one["met"]],
        "distances": distances,
        "multilevel": {row["case"]: row["gain"] for row in rows if row["method"] == "multilevel"},
    }


def beside_limits(errors: dict[str, list[float | None]]) -> dict[str, dict[str, Any]]:
    """Quantity -> what its errors over designs are beside its limit; an error that is missing is beyond any."""
    found = {}
    for name, limit in LIMITS.items():
        off = [abs(error) if error is not None else float("inf") for error in errors[name]]
        within = sum(error <= 2 * limit for error in off)
        median = statistics.median(off)
        met = median <= limit and within >= WITHIN_TWICE * len(off)
        told = median if median < float("inf") else None
        found[name] = {"median": told, "limit": limit, "designs": len(off), "within_twice": within, "met": met}
    return found
