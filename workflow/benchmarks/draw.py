"""The command of the figures of benchmarks."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from roughslip.figures.style import save
from roughslip.stages.runtime.usage import Usage
from workflow.benchmarks.measure import Row


def draw(figure: Callable[[Sequence[Row]], Figure], description: str | None) -> None:
    """Read the rows of a benchmark and write their figure, as the command line says."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--benchmark", type=Path, required=True, help="the JSON file")
    parser.add_argument("--output", type=Path, nargs="+", required=True, help="pictures, PNG or SVG")
    parser.add_argument("--usage", type=Path, required=True, help="record of cost to write")
    arguments = parser.parse_args()
    with Usage(arguments.usage, "draw") as usage:
        drawn = figure(json.loads(arguments.benchmark.read_text(encoding="utf-8"))["rows"])
        for path in arguments.output:
            save(drawn, path)
        usage.files(read=[arguments.benchmark], made=arguments.output)
