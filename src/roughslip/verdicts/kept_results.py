"""The results of a full run that git keeps, for readers, and the comparison of another run with them.

A run of the same code gives the same numbers. With other code, packages or processors the numbers may differ: they
agree within the 95 % interval of the kept ones. The friction of a scene that has a Monte Carlo reference, strips solved
directly with random numbers of their own, is compared with that too.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from roughslip.atomic_write import replacing
from roughslip.errors import StoreError
from roughslip.probability.estimate import NORMAL_95
from roughslip.store import table_rows
from roughslip.verdicts.found import Arrays, number

KEPT = (*("figure_chain.png", "figure2.png", "figure3.png", "figure5.png"), "claims.json", "costs.json", "summary.csv")
FAR = 4.0  # standard errors: of 22 numbers one lies beyond by chance once in 700 runs
ROUNDING = 1e-5  # relative: a number of six digits may lie outside its own interval by that


@dataclass(frozen=True)
class Compared:
    """A number or verdict of this run and the kept one, as text.

    allowed : the range that agrees; agrees : whether the difference is allowed
    moved : whether they differ at all; False for a Monte Carlo reference, which differs in every run
    """

    name: str
    ours: str
    kept: str
    allowed: str
    moved: bool
    agrees: bool


def keep(results: Path, reference: Path) -> None:
    """Copy the kept files of a scene's results. Raises StoreError where one is missing: the scene is not complete."""
    missing = [name for name in KEPT if not (results / name).is_file()]
    if missing:
        raise StoreError(f"{results}: lacks {', '.join(missing)}; only scenes with every target can be kept")
    for name in KEPT:
        with replacing(reference / name) as temporary:
            shutil.copyfile(results / name, temporary)


def compared_claims(ours: Sequence[Mapping[str, Any]], kept: Sequence[Mapping[str, Any]]) -> list[Compared]:
    """Every verdict and every number of claims.json. A claim that only one of them has does not agree."""
    of_run, of_kept = ({str(claim["id"]): claim for claim in claims} for claims in (ours, kept))
    rows = []
    for name in dict.fromkeys((*of_kept, *of_run)):
        pair = of_run.get(name), of_kept.get(name)
        rows.append(_equal(f"{name}, verdict", *(str(claim["verdict"]) if claim else "missing" for claim in pair)))
        if pair[0] and pair[1]:
            rows.append(_within(name, pair[0]["ours"], pair[1]["ours"], pair[1]["interval"]))
    return rows


def compared_summaries(ours: str, kept: str) -> list[Compared]:
    """Every number of summary.csv, a row a penetration; one without an interval must be the same.

    Raises StoreError where a text is no such table.
    """
    tables = []
    for text in (ours, kept):
        rows = table_rows(text)
        if not rows or "percentile" not in rows[0] or any(None in row.values() or None in row for row in rows):
            raise StoreError("summary.csv is not a table of penetrations: make the scene again")
        tables.append({row.pop("percentile"): row for row in rows})
    of_run, of_kept = tables
    compared = [_equal("penetrations", " ".join(of_run), " ".join(of_kept))]
    for percentile, row in ((percentile, of_run[percentile]) for percentile in of_kept if percentile in of_run):
        other = of_kept[percentile]
        ends = {name: [_end(name, end) for end in ("_low", "_high")] for name in other}  # of `length_m` length_low_m
        for name in (name for name in other if not name.removesuffix("_m").endswith(("_low", "_high"))):
            interval = [float(other[end]) for end in ends[name]] if set(ends[name]) <= set(other) else None
            value, expected = float(row.get(name, "nan")), float(other[name])
            compared.append(_within(f"{name} at {percentile} %", value, expected, interval))
    return compared


def compared_friction(friction: Arrays, reference: Arrays) -> list[Compared]:
    """Mean and standard deviation of mu at every penetration, compared with strips solved directly.

    friction : what stage friction stores; reference : area over force [1/Pa] with standard errors, on the same cells

    Both are in units of the mean at the median. Differences are in standard errors of both; half a 95 % interval is
    NORMAL_95 of them.
    """
    ours, direct = (int(np.flatnonzero(np.isclose(of["percentile"], 50.0))[0]) for of in (friction, reference))
    scale, rows = float(friction["combined_mean"][ours] / reference["mean"][direct]), []
    for level, percentile in enumerate(reference["percentile"]):
        at = int(np.flatnonzero(np.isclose(friction["percentile"], percentile))[0])
        for name in ("mean", "std"):
            value, (low, high) = number(friction, f"combined_{name}", at)
            of_reference = scale * float(reference[f"{name}_standard_error"][level])
            error = math.hypot((high - low) / (2 * NORMAL_95), of_reference)
            expected = scale * float(reference[name][level])
            off = (value - expected) / error
            allowed = f"{FAR:g} standard errors, {off:+.2f} of them off"
            texts = (f"{value:.6g}", f"{expected:.6g}", allowed)
            rows.append(Compared(f"{name} at {percentile:g} %, direct", *texts, False, abs(off) <= FAR))
    return rows


def _end(name: str, end: str) -> str:
    return f"{name.removesuffix('_m')}{end}_m" if name.endswith("_m") else name + end


def _equal(name: str, ours: str, kept: str) -> Compared:
    return Compared(name, ours, kept, kept, ours != kept, ours == kept)


def _within(name: str, ours: float | None, kept: float | None, interval: Sequence[float] | None) -> Compared:
    if ours is None or kept is None or interval is None or math.isnan(ours) or math.isnan(kept):
        return _equal(name, *("none" if value is None else f"{value:.6g}" for value in (ours, kept)))
    rounding = ROUNDING * max(abs(ours), abs(kept))
    inside = interval[0] - rounding <= ours <= interval[1] + rounding
    moved = abs(ours - kept) > rounding
    allowed = f"{interval[0]:.6g} to {interval[1]:.6g}"
    return Compared(name, f"{ours:.6g}", f"{kept:.6g}", allowed, moved, inside or not moved)
