"""The campaigns of all stages in one file, results/stress.json."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from workflow.stress.outcomes import write


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=Path, nargs="+", required=True, help="files of the stages")
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    arguments = parser.parse_args()
    campaigns = [json.loads(path.read_text(encoding="utf-8")) for path in arguments.campaigns]
    rows, classes = ([entry for one in campaigns for entry in one[name]] for name in ("rows", "summary"))
    write(arguments.output, rows, classes, {stage: seed for one in campaigns for stage, seed in one["seeds"].items()})


if __name__ == "__main__":
    main()
