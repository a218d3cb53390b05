"""Copy results of benchmarks and stress campaigns to results/reference/evidence, which git keeps.

The joint page shows them. Kept files whose results have not been made again stay as they are.
"""

from __future__ import annotations

import json
from pathlib import Path

from roughslip import store
from workflow.study.scenes import BENCHMARKS

RESULTS = Path("results")
KEPT = RESULTS / "reference" / "evidence"


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
        store.write_json(KEPT / "stress.json", {"seeds": stress["seeds"], "stages": stress["summary"]})
        print(f"kept {made}")


if __name__ == "__main__":
    main()
