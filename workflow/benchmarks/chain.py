"""The whole chain measured: the error of every number in the figures, split into its sources.

One source at a time is varied with common random numbers, the others as the scene has them (`chain_problem`). Numbers:
pressure at the centre at median penetration (Figure 2), mean and standard deviation of mu at three penetrations in
units of the mean at the median (Figure 3), cycles at three damping ratios (Figure 5). Errors are shares of the number.
Beside the budget `cost` tells what the chain takes and what the plain way would at the same error (`chain_cost`).
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roughslip.scene.loader import load
from workflow.benchmarks import chain_cost, chain_cost_stages, chain_oscillator, chain_square, chain_strips, measure
from workflow.benchmarks.chain_cost_stages import USUAL, Sample
from workflow.benchmarks.measure import Row, fields

PACKAGES = ("numpy", "scipy", "numba")
ROOT = Path(__file__).parents[2]
REFERENCES = ROOT / "results" / "reference"


@dataclass(frozen=True)
class Campaign:
    """What is measured. scenes; how many surfaces, strips and paths are solved for it; and what is run for the cost."""

    scenes: tuple[str, ...] = ("paper", "resolved")
    surfaces: int = 2000
    strips: int = 40
    paths: int = 400
    cost: Sample = USUAL


QUICK = Campaign(("paper",), 100, 4, 5, Sample(20, 3, 1, 0.4))


def measured(campaign: Campaign) -> tuple[list[Row], dict[str, list[dict[str, Any]]]]:
    """Every number of every scene by every source; and the cost of the chain, stage by stage and together."""
    rows: list[Row] = []
    cost: dict[str, list[dict[str, Any]]] = {"stages": [], "chain": []}
    for name in campaign.scenes:
        scene = load(name, ROOT / "config" / "scenes")
        kept = REFERENCES / name
        of_square = list(chain_square.budget(name, campaign.surfaces, kept / "pressure.nc"))
        rows += of_square
        rows += chain_strips.budget(name, scene, campaign.strips)
        rows += chain_strips.sampling(name, kept / "summary.csv")
        rows += chain_oscillator.budget(name, scene, campaign.paths, kept / "summary.csv")
        stages = chain_cost_stages.stages(name, scene, of_square, kept, campaign.cost)
        cost["stages"] += [stage.told(name) for stage in stages]
        cost["chain"].append(chain_cost.together(name, stages))
    return rows, cost


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
    rows, cost = measured(QUICK if (arguments := parser.parse_args()).quick else Campaign())
    found = summary(rows)
    for case, number in found.items():
        measure.say(f"{fields(case)['scene']} {fields(case)['number']}: {number['error']:.2%}, {number['largest']}")
    for one in cost["chain"]:
        measure.say(f"{one['scene']}: {one['ours_seconds']:.4g} s, the plain way {one['ratio']:.4g} times that")
    head = {"machine": measure.machine(), "versions": measure.versions(PACKAGES), "checks": {}}
    measure.write(arguments.output, {**head, "summary": found, "cost": cost, "rows": rows})


if __name__ == "__main__":
    main()
