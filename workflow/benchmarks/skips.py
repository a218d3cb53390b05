"""Measure what skipped work saves: each problem as the code solves it, and with everything computed, in turns.

Each kind of skip that costs.json counts is a case. Its tolerance is 0 if the result must be the same to the bit. The
error of a row of `roughslip` is the difference of its result from that of `roughslip/plain`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from workflow.benchmarks.runner import OURS, is_met, make_row, race, report_rows, run_command, time_ratios
from workflow.benchmarks.skips_contact import Skip, contact_skips
from workflow.benchmarks.skips_models import expansion_skips, motion_skips
from workflow.evidence.rows import Row, case, fields, power

PLAIN = f"{OURS}/plain"


@dataclass(frozen=True)
class Sizes:
    """What is measured.

    nodes : on an edge of the squares
    strip : nodes on the length of a strip
    periods : natural periods of a motion
    path_nodes : nodes of a correlation length of its path
    surfaces : of the paper's square, solved for an expansion
    square : scene of the other square
    asked : its Kolmogorov error
    most : the most surfaces solved for it
    """

    nodes: int = 256
    strip: int = 960
    periods: float = 100.0
    path_nodes: int = 8
    surfaces: int = 1000
    square: str = "resolved"
    asked: float = 0.02
    most: int = 2048


QUICK = Sizes(128, 240, 10.0, 4, 300, "paper", 0.03, 512)


def all_skips(sizes: Sizes) -> Iterator[Skip]:
    """Yield every measured skip."""
    yield from contact_skips(sizes.nodes, sizes.strip)
    yield from expansion_skips(sizes.surfaces, sizes.square, sizes.asked, sizes.most)
    yield from motion_skips(sizes.periods, sizes.path_nodes)


def compare(skip: Skip, quick: bool) -> list[Row]:
    """Return the rows of a skip: as the code solves its problem, and with everything computed."""
    seconds, results = race({OURS: skip.skipping, PLAIN: skip.plain}, quick, least=3)
    errors = {OURS: skip.difference(results[OURS][0], results[PLAIN][0]), PLAIN: 0.0}
    tolerance = power(float(f"{skip.tolerance:.1e}"))
    name = case(skip=skip.reason.replace(" ", "-"), problem=skip.problem, tolerance=tolerance)
    rows = [make_row(name, method, errors[method], seconds[method], results[method][1]) for method in results]
    report_rows(rows)
    return rows


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary and the rows."""
    rows = [row for skip in all_skips(QUICK if quick else Sizes()) for row in compare(skip, quick)]
    ratios = time_ratios(rows).get(PLAIN, {})
    summary = {
        "times_as_fast": {fields(name)["skip"]: ratio for name, ratio in ratios.items()},
        "unchanged": all(is_met(row) for row in rows),
    }
    return {"summary": summary, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure, ("ducc0",))
