"""What git keeps of the results of benchmarks and stress campaigns: results/reference/evidence, which the joint page
shows.

Kept files whose results have not been made again stay as they are.

    python -m workflow.evidence stress      that one alone
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from roughslip import store
from workflow.study.scenes import BENCHMARKS

RESULTS = Path("results")
KEPT = RESULTS / "reference" / "evidence"


def main(names: Sequence[str] = ()) -> None:
    """Keep the results of these names, of all if there are none."""
    names = names or (*BENCHMARKS, "stress")
    for stage in BENCHMARKS:
        made = RESULTS / "benchmarks" / f"{stage}.json"
        if stage in names and made.is_file():
            benchmark = json.loads(made.read_text(encoding="utf-8"))
            store.write_text(KEPT / f"{stage}.json", json.dumps(benchmark, separators=(",", ":")) + "\n")
            print(f"kept {made}")
    made = RESULTS / "stress.json"
    if "stress" in names and made.is_file():
        stress = json.loads(made.read_text(encoding="utf-8"))
        store.write_json(KEPT / "stress.json", {"seeds": stress["seeds"], "stages": stress["summary"]})
        print(f"kept {made}")


if __name__ == "__main__":
    main(sys.argv[1:])
