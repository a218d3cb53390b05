"""What the rows of the surface benchmark say in a few numbers. Nothing here is measured."""

from __future__ import annotations

import statistics
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from workflow.benchmarks.measure import OURS, Row, fields, meets

TARGET = 0.01  # of Sq^2, RMS error of a sample covariance


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Times beside what is promised, what missed it or its residual, and the generators beside ours.

    limits : case -> seconds and the limit
    late, missed : cases above it; modes whose residual is above the tolerance
    """
    limited = [entry for entry in rows if "limit" in entry]
    return {
        "limits": {entry["case"]: {key: entry[key] for key in ("seconds", "limit")} for entry in limited},
        "late": [entry["case"] for entry in limited if entry["seconds"] > entry["limit"]],
        "missed": [entry["case"] for entry in rows if entry["method"].partition("/")[0] == OURS and not meets(entry)],
        "generators": generators(rows),
    }


def generators(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, float | None]]]:
    """Case -> method with its setting -> what a sample costs and what its covariance is worth.

    seconds : of a sample
    times_ours : over ours, the median over turns
    over_floor : error of the covariance of the most samples over that of as many exact ones
    systematic : error that stays
    seconds_to_percent : time for as many samples as bring the error to 0.01; None where what stays is above it
    """
    by_case: dict[str, dict[tuple[str, int], list[Row]]] = defaultdict(lambda: defaultdict(list))
    for entry in rows:
        if fields(entry["case"]).get("quantity") == "covariance":
            by_case[entry["case"]][entry["method"], entry["setting"]].append(entry)
    found = {}
    for name, methods in by_case.items():
        ours = methods[OURS, 0]
        found[name] = {
            f"{method} {setting}" if setting else method: _generator(of_method, ours)
            for (method, setting), of_method in methods.items()
        }
    return found


def _generator(rows: Sequence[Row], ours: Sequence[Row]) -> dict[str, float | None]:
    first, last = rows[0], rows[-1]
    pairs = zip(_sample_seconds(first), _sample_seconds(ours[0]), strict=False)
    seconds, stays = statistics.median(_sample_seconds(first)), first["systematic"]
    scatter = max(first["error"] ** 2 - stays**2, 0.0)  # of one sample; of N it is N times less
    return {
        "seconds": seconds,
        "times_ours": statistics.median(theirs / our for theirs, our in pairs),
        "over_floor": last["error"] / last["floor"],
        "systematic": stays,
        "seconds_to_percent": seconds * scatter / (TARGET**2 - stays**2) if stays < TARGET else None,
    }


def _sample_seconds(entry: Row) -> list[float]:
    """Of a sample in every turn: the row of a single one, less its set-up."""
    return [seconds - entry["setup_seconds"] for seconds in entry["turns"]]
