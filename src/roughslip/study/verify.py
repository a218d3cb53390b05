"""Stage verify: compare a run with what git keeps, and its files with their checksums.

A run of the same code gives the same numbers. With other code, packages or processors the numbers may differ: they
agree within the 95 % interval of the kept ones.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from roughslip import store
from roughslip.errors import StoreError
from roughslip.scene.part import Scene
from roughslip.study import checksum
from roughslip.study.job import Job

ROUNDING = 1e-5  # relative: a number of six digits may lie outside its own interval by that


class Compared(NamedTuple):
    """A number or verdict of this run and the kept one, as text.

    allowed : the range that agrees; agrees : whether the difference is allowed; moved : whether they differ at all
    """

    name: str
    ours: str
    kept: str
    allowed: str
    moved: bool
    agrees: bool


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
    """Every number of summary.csv, a row a penetration; one without an interval must be the same."""
    of_run, of_kept = ({row["percentile"]: row for row in store.table_rows(text)} for text in (ours, kept))
    compared = [_equal("penetrations", " ".join(of_run), " ".join(of_kept))]
    for percentile in (one for one in of_kept if one in of_run):
        row, expected = ({name: float(number) for name, number in of[percentile].items()} for of in (of_run, of_kept))
        for name in (name for name in expected if not name.removesuffix("_m").endswith(("_low", "_high"))):
            word, unit = (name[:-2], "_m") if name.endswith("_m") else (name, "")  # of `length_m` length_low_m
            ends = [expected.get(f"{word}{end}{unit}") for end in ("_low", "_high")]
            numbers = row.get(name, math.nan), expected[name]
            compared.append(_within(f"{name} at {percentile} %", *numbers, None if None in ends else ends))
    return compared


def _equal(name: str, ours: str, kept: str) -> Compared:
    return Compared(name, ours, kept, kept, ours != kept, ours == kept)


def _within(name: str, ours: float | None, kept: float | None, interval: Sequence[Any] | None) -> Compared:
    if ours is None or kept is None or interval is None or math.isnan(ours) or math.isnan(kept):
        return _equal(name, *("none" if value is None else f"{value:.6g}" for value in (ours, kept)))
    rounding = ROUNDING * max(abs(ours), abs(kept))
    inside = interval[0] - rounding <= ours <= interval[1] + rounding
    moved = abs(ours - kept) > rounding
    allowed = f"{interval[0]:.6g} to {interval[1]:.6g}"
    return Compared(name, f"{ours:.6g}", f"{kept:.6g}", allowed, moved, inside or not moved)


def recorded(folder: Path) -> dict[Path, str]:
    """Checksums of all files of a scene by their names, from the records of cost."""
    records = [store.read_json(path) for path in sorted((folder / "usage").glob("*.json"))]
    return {folder / name: file["sha256"] for record in records for name, file in record["made"].items()}


def work(scene: Scene, job: Job) -> None:
    """Write what moved; raise StoreError with a line for all that disagrees."""
    lines: list[str] = []
    moved: list[str] = []
    count = numbers = 0
    for folder in job.paths("scenes"):
        files, kept = recorded(folder), job.path("reference") / folder.name
        lines += [
            f"{file}: its contents differ from the checksum of its record; {store.rebuild(file)}"
            for file, sha256 in files.items()
            if not file.is_file() or checksum(file) != sha256
        ]
        rows = compared_claims(*(store.read_json(where / "claims.json") for where in (folder, kept)))
        rows += compared_summaries(*((where / "summary.csv").read_text(encoding="utf-8") for where in (folder, kept)))
        lines += [
            f"{folder}: {row.name}: {row.ours} for {row.kept}; allowed: {row.allowed}" for row in rows if not row.agrees
        ]
        moved += [f"  {folder.name}: {row.name}: {row.ours}, kept {row.kept}" for row in rows if row.moved]
        count, numbers = count + len(files), numbers + len(rows)
    head = f"{numbers} numbers and verdicts agree with the kept ones, {count} files agree with their checksums"
    store.write_text(job.output, "\n".join((f"{head}; {len(moved)} moved within what is allowed", *moved, "")))
    if lines:
        raise StoreError("\n".join((f"{len(lines)} of what was compared disagree:", *lines)))
