"""Copy results of benchmarks and stress campaigns to results/reference/evidence, which git keeps.

The joint page shows them. Kept files whose results have not been made again stay as they are.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from roughslip import store
from workflow.study.scenes import BENCHMARKS

RESULTS = Path("results")
KEPT = RESULTS / "reference" / "evidence"


def stress_by_stage(stress: dict[str, Any]) -> list[dict[str, Any]]:
    """Return problems, outcomes and the largest residual of each stage, from the summary of a stress file."""
    rows: dict[str, dict[str, Any]] = {}
    for part in stress["summary"]:
        row = rows.setdefault(
            part["stage"],
            {
                "stage": part["stage"],
                "problems": 0,
                "outcomes": {},
                "worst_residual_over_tolerance": None,
                "failures": 0,
            },
        )
        row["problems"] += part["problems"]
        row["failures"] += part["failures"]
        for outcome, count in part["outcomes"].items():
            row["outcomes"][outcome] = row["outcomes"].get(outcome, 0) + count
        worst = [one["worst_residual_over_tolerance"] for one in (row, part)]
        row["worst_residual_over_tolerance"] = max((one for one in worst if one is not None), default=None)
    return list(rows.values())


def main() -> None:
    for stage in BENCHMARKS:
        made = RESULTS / "benchmarks" / f"{stage}.json"
        if made.is_file():
            benchmark = json.loads(made.read_text(encoding="utf-8"))
            store.write_text(KEPT / f"{stage}.json", json.dumps(benchmark, separators=(",", ":")) + "\n")
            print(f"kept {made}")
    made = RESULTS / "stress.json"
    if made.is_file():
        stress = json.loads(made.read_text(encoding="utf-8"))
        store.write_json(KEPT / "stress.json", {"seeds": stress["seeds"], "stages": stress_by_stage(stress)})
        print(f"kept {made}")


if __name__ == "__main__":
    main()
