"""The whole chain measured: the error of every number in the figures, split into its sources.

One source at a time is varied with common random numbers, the others as the scene has them (`chain_problem`). Numbers:
pressure at the centre at median penetration (Figure 2), mean and standard deviation of mu at three penetrations in
units of the mean at the median (Figure 3), cycles at three damping ratios (Figure 5). Errors are shares of the number.
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from roughslip.scene import load
from workflow.benchmarks import chain_oscillator, chain_square, chain_strips, measure
from workflow.benchmarks.measure import Row, fields

PACKAGES = ("numpy", "scipy", "numba")
ROOT = Path(__file__).parents[2]
REFERENCES = ROOT / "results" / "reference"


@dataclass(frozen=True)
class Campaign:
    """What is measured. scenes; and how many surfaces, strips and paths are solved for it."""

    scenes: tuple[str, ...] = ("paper", "resolved")
    surfaces: int = 2000
    strips: int = 40
    paths: int = 400


QUICK = Campaign(("paper",), 100, 4, 8)


def measured(campaign: Campaign) -> list[Row]:
    """Every number of every scene by every source."""
    rows: list[Row] = []
    for name in campaign.scenes:
        scene = load(name, ROOT / "config" / "scenes", ROOT / "config" / "scene.schema.yaml")
        kept = REFERENCES / name
        rows += chain_square.budget(name, campaign.surfaces, kept / "pressure.nc")
        rows += chain_strips.budget(name, scene, campaign.strips)
        rows += chain_strips.sampling(name, kept / "summary.csv")
        rows += chain_oscillator.budget(name, scene, campaign.paths, kept / "summary.csv")
    return rows


def summary(rows: Sequence[Row]) -> dict[str, dict[str, object]]:
    """For every number: its error from all sources together, as if they were independent, and the largest of them."""
    by_number: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_number[row["case"]].append(row)
    return {
        case: {
            "value": of_number[-1]["value"],
            "error": math.sqrt(sum(row["error"] ** 2 for row in of_number)),
            "largest": max(of_number, key=lambda row: row["error"])["method"],
        }
        for case, of_number in by_number.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help="no public program runs the chain")
    parser.add_argument("--quick", action="store_true", help="a few samples, to show that everything works")
    rows = measured(QUICK if (arguments := parser.parse_args()).quick else Campaign())
    found = summary(rows)
    for case, number in found.items():
        measure.say(f"{fields(case)['scene']} {fields(case)['number']}: {number['error']:.2%}, {number['largest']}")
    head = {"machine": measure.machine(), "versions": measure.versions(PACKAGES), "checks": {}}
    measure.write(arguments.output, {**head, "summary": found, "rows": rows})


if __name__ == "__main__":
    main()
