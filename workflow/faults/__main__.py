"""The campaign as a command: exit 1 where anything was lost."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

from roughslip import store
from workflow.faults.campaign import line, outcomes
from workflow.faults.scratch import TINY, Scratch, copy_project

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    """Run the faults and write results/faults.json, a row each."""
    parser = argparse.ArgumentParser(prog="python -m workflow.faults", description=__doc__)
    parser.add_argument("--count", type=int, default=200, help="faults (200)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (0)")
    parser.add_argument("--seed", type=int, default=1, help="of what is broken, and when (1)")
    parser.add_argument("--output", type=Path, default=Path("results/faults.json"), help="where the outcomes go")
    arguments = parser.parse_args()
    started, rows = time.monotonic(), []
    with tempfile.TemporaryDirectory(prefix="roughslip-faults-") as base:
        folder = Path(base) / "project"
        copy_project(ROOT, folder)
        (folder / "config/scenes/tiny.yaml").write_text(TINY, encoding="utf-8")
        environment = {**os.environ, "PYTHONPATH": str(folder / "src"), "NUMBA_CACHE_DIR": str(Path(base) / "numba")}
        scratch = Scratch(folder, Path(base) / "saved", "tiny", environment)
        status, said = scratch.run()
        if status:
            print(f"the undisturbed run failed:\n{said}", file=sys.stderr)
            return 1
        scratch.save()
        for outcome in outcomes(scratch, arguments.seed, range(arguments.first, arguments.first + arguments.count)):
            print(line(outcome, started), flush=True)
            rows.append(outcome._asdict())
            store.write_json(arguments.output, rows)
    lost = sum(bool(row["wrong"]) for row in rows)
    print(f"{len(rows)} faults, {lost} lost something", file=sys.stderr)
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
