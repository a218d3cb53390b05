"""What the rows of the contact benchmark say in a few numbers. Nothing here is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from workflow.benchmarks.measure import OURS, Row, fields, growth_exponent, meets, ratios, speed_summary


def summary(rows: Sequence[Row], memory: Mapping[str, Mapping[str, float | None]]) -> dict[str, Any]:
    """Speed beside the peers, growth, memory, sweeps; 10 x 10 nodes apart from the meshes that need transforms."""
    tiny = [row for row in rows if fields(row["case"]).get("n") == "10"]
    meshes = [row for row in rows if fields(row["case"]).get("n") != "10"]
    return {
        "times_faster_than": speed_summary(meshes),
        "times_faster_than_on_10_x_10": speed_summary(tiny),
        "growth": growth(rows),
        "memory_in_padded_arrays": memory,
        "missed": [row["case"] for row in rows if row["method"].partition("/")[0] == OURS and not meets(row)],
        "sweep_over_cold": ratios(rows, ours="roughslip/cold").get("roughslip/sweep", {}),
    }


def growth(rows: Sequence[Row]) -> dict[str, Any]:
    """Time of ours at the median of the smooth surface, 1e-10, by n, and its power of the number of nodes."""
    seconds = {}
    for row in rows:
        n, _, rest = row["case"].removeprefix("n=").partition(" ")
        if row["method"] == OURS and rest == "surface=gauss level=50 tolerance=1e-10":
            seconds[int(n)] = row["seconds"]
    sizes = sorted(seconds)
    return {
        "seconds": {str(n): seconds[n] for n in sizes},
        "exponent": growth_exponent([n**2 for n in sizes], [seconds[n] for n in sizes]),
    }
