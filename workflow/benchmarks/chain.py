"""Measure the whole chain: the error budget of every number in the figures, and the cost of the same error otherwise.

Figure 2: the pressure at the centre at median penetration. Figure 3: mean and standard deviation of mu at three
penetrations, in units of the mean at the median. Figure 5: cycles at three damping ratios. `cost` compares the CPU time
of the chain with that of textbook methods at the same error (`chain_cost`).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from workflow.benchmarks import chain_budget, chain_cost
from workflow.benchmarks.chaos_problem import KEPT_RESULTS, load_scene
from workflow.benchmarks.runner import report_progress, run_command
from workflow.evidence.rows import Row, fields


@dataclass(frozen=True)
class Sizes:
    """What is measured: scenes, numbers of surfaces, strips and paths for each, and samples of the cost."""

    scenes: tuple[str, ...] = ("paper", "resolved")
    surfaces: int = 2000
    strips: int = 40
    paths: int = 400
    cost: chain_cost.Sizes = chain_cost.USUAL


QUICK = Sizes(("paper",), 100, 4, 5, chain_cost.Sizes(20, 3, 1, 0.4))


def summarise(rows: Sequence[Row]) -> dict[str, dict[str, object]]:
    """Return for each number its value, its error from all sources, as if independent, and the largest source."""
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


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary, the cost and the rows."""
    sizes = QUICK if quick else Sizes()
    rows: list[Row] = []
    cost: dict[str, list[dict[str, Any]]] = {"stages": [], "chain": []}
    for name in sizes.scenes:
        scene = load_scene(name)
        kept = KEPT_RESULTS / name
        of_square = list(chain_budget.square_budget(name, sizes.surfaces, kept / "pressure.nc"))
        rows += of_square
        rows += chain_budget.strip_budget(name, scene, sizes.strips)
        rows += chain_budget.strip_sampling(name, kept / "summary.csv")
        rows += chain_budget.oscillator_budget(name, scene, sizes.paths, kept / "summary.csv")
        stages = chain_cost.measure_stages(name, scene, of_square, kept, sizes.cost)
        cost["stages"] += [stage.record(name) for stage in stages]
        cost["chain"].append(chain_cost.sum_stages(name, stages))
    found = summarise(rows)
    for case, number in found.items():
        report_progress(f"{fields(case)['scene']} {fields(case)['number']}: {number['error']:.2%}")
    for one in cost["chain"]:
        report_progress(f"{one['scene']}: {one['ours_seconds']:.4g} s, textbook methods {one['ratio']:.4g} times that")
    return {"summary": found, "cost": cost, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure)
