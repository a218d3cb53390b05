"""What the rows of the chaos benchmark say beside the limits that the project promises. Nothing here is measured."""

from __future__ import annotations

import math
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

    limits : case -> quantity -> median net of the reference and as seen, limit, designs, how many within twice it, met
    missed : cases and quantities above a limit
    distances : case -> method -> median
    multilevel : case -> how many times less a given standard error costs than by plain Monte Carlo
    """
    decisive = [row for row in rows if row["work"] == DECISIVE.get(fields(row["case"]).get("scene", ""))]
    decisive = [row for row in decisive if "distance" in row.get("errors", {})]
    limits = {row["case"]: beside_limits(row) for row in decisive if row["method"] == OURS}
    distances: dict[str, dict[str, float]] = {}
    for row in decisive:
        distances.setdefault(row["case"], {})[row["method"]] = row["error"]
    return {
        "limits": limits,
        "missed": [f"{name} {what}" for name, found in limits.items() for what, one in found.items() if not one["met"]],
        "distances": distances,
        "multilevel": {row["case"]: row["gain"] for row in rows if row["method"] == "multilevel"},
    }


def beside_limits(row: Row) -> dict[str, dict[str, Any]]:
    """Quantity -> what its errors over designs are beside its limit; an error that is missing is beyond any."""
    found = {}
    for name, limit in LIMITS.items():
        off, seen = ([abs(e) if e is not None else math.inf for e in row[kind][name]] for kind in ("errors", "seen"))
        within = sum(error <= 2 * limit for error in off)
        median = statistics.median(off)
        met = median <= limit and within >= WITHIN_TWICE * len(off)
        found[name] = {
            "median": median if median < math.inf else None,
            "median_seen": statistics.median(seen) if statistics.median(seen) < math.inf else None,
            "reference_error": row["reference_errors"][name],
            "limit": limit,
            "designs": len(off),
            "within_twice": within,
            "met": met,
        }
    return found
