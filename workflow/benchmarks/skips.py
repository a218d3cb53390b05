"""What the code leaves out, measured: the same problem with every part computed, by turns in one process.

Each skip that costs.json counts is a case; its tolerance is 0 where the result is the same to the bit. What a row of
`roughslip` tells as its error is how far its result is from that of `roughslip/plain`. Stages that a scene does not
need are beside them in the summary, by what they took in the scenes that need them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roughslip.scene.loader import load
from roughslip.scene.plan import skip_reasons
from workflow.benchmarks import measure, skips_chaos, skips_contact, skips_motion
from workflow.benchmarks.measure import OURS, Contender, Row, case, fields, row
from workflow.benchmarks.skips_problem import Skip

PACKAGES = ("numpy", "scipy", "numba", "ducc0")
LONG = 4.0  # a call that takes longer [s] is the only one
PLAIN = f"{OURS}/plain"
ROOT = Path(__file__).parents[2]
REFERENCES = ROOT / "results" / "reference"
SPARING = ("given", "elastoplastic", "paper")  # scenes that do without stages that a scene whose costs are kept runs


@dataclass(frozen=True)
class Campaign:
    """What is measured.

    nodes, strip : of the squares along an edge, and of a strip along its length
    periods, path_nodes : natural periods of a motion, and nodes of a correlation length of its path
    surfaces : of the paper's square, solved for an expansion
    square, asked, most : scene of the other, its Kolmogorov error, and the most surfaces that may be solved for it
    least_turns : of every method
    """

    nodes: int = 256
    strip: int = 960
    periods: float = 100.0
    path_nodes: int = 8
    surfaces: int = 1000
    square: str = "resolved"
    asked: float = 0.02
    most: int = 2048
    least_turns: int = 3


QUICK = Campaign(128, 240, 10.0, 4, 300, "paper", 0.03, 512, 1)


def measured(campaign: Campaign) -> list[Row]:
    """Two rows a skip."""
    found: list[Row] = []
    for skip in (
        *skips_contact.skips(campaign.nodes, campaign.strip),
        *skips_chaos.skips(campaign.surfaces, campaign.square, campaign.asked, campaign.most),
        *skips_motion.skips(campaign.periods, campaign.path_nodes),
    ):
        found += _raced(skip, campaign.least_turns)
    return found


def _raced(skip: Skip, least_turns: int) -> list[Row]:
    calls = {OURS: skip.skipping, PLAIN: skip.plain}
    results, contenders = {}, {}
    for method, call in calls.items():
        seconds, results[method] = measure.timed(call)
        if seconds < LONG:  # what is compiled and planned at the first call weighs
            seconds, _ = measure.timed(call)
        turns = 1 if least_turns == 1 or seconds > LONG else max(least_turns, measure.turns(seconds))
        contenders[method] = Contender(call, seconds, turns, keep=seconds > LONG)
    errors = {OURS: skip.difference(results[OURS][0], results[PLAIN][0]), PLAIN: 0.0}
    name = case(
        skip=skip.told.replace(" ", "-"), problem=skip.problem, tolerance=measure.power(float(f"{skip.tolerance:.1e}"))
    )
    times = measure.race(contenders)
    rows = [row(name, method, errors[method], times[method], results[method][1]) for method in calls]
    measure.say(f"{skip.told}: {rows[1]['seconds'] / rows[0]['seconds']:.3g} times, {errors[OURS]:.1e} apart")
    return rows


def spared_stages(costs: dict[str, list[dict[str, Any]]]) -> dict[str, dict[str, Any]]:
    """By scene the stages that it does without and that another scene ran: their CPU seconds there, and the reason.

    costs : contents of costs.json by scene
    """
    seconds = {}
    for rows in costs.values():
        seconds |= {one["stage"]: one["cpu_seconds"] for one in rows}
    found = {}
    for name in SPARING:
        scene = load(name, ROOT / "config" / "scenes")
        stages = {stage: reason for stage, reason in skip_reasons(scene).items() if stage in seconds}
        found[name] = {
            "cpu_seconds": sum(seconds[stage] for stage in stages),
            "stages": {stage: {"cpu_seconds": seconds[stage], "why": reason} for stage, reason in stages.items()},
        }
    return found


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """How many times as fast by skip, whether the result is unchanged, and the stages not needed."""
    ratios = measure.ratios(rows).get(PLAIN, {})
    kept = {file.parent.name: json.loads(file.read_text("utf-8")) for file in sorted(REFERENCES.glob("*/costs.json"))}
    return {
        "times_as_fast": {fields(name)["skip"]: ratio for name, ratio in ratios.items()},
        "unchanged": all(measure.meets(one) for one in rows),
        "stages_not_needed": spared_stages(kept),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help="no public program takes part")
    parser.add_argument("--quick", action="store_true", help="small problems, one turn each")
    rows = measured(QUICK if (arguments := parser.parse_args()).quick else Campaign())
    head = {"machine": measure.machine(), "versions": measure.versions(PACKAGES), "checks": {}}
    measure.write(arguments.output, {**head, "summary": summary(rows), "rows": rows})


if __name__ == "__main__":
    main()
