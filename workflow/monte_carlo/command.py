"""The command of a Monte Carlo reference: solve a batch of samples, or gather batches into the reference."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store

Variables = Mapping[str, store.Variable]


def run_command(
    description: str | None,
    solve: Callable[[dict[str, Any], int, int], Variables],
    gather: Callable[[dict[str, Any], Sequence[Mapping[str, np.ndarray]]], Variables],
) -> None:
    """Run `solve` or `gather` from the command line and write its file.

    solve : (configuration, first, last) -> results of samples first ... last - 1
    gather : (configuration, batches) -> the reference
    """
    parser = argparse.ArgumentParser(description=description)
    parts = parser.add_subparsers(dest="part", required=True)
    solving = parts.add_parser("solve", help="solve a batch of samples")
    gathering = parts.add_parser("gather", help="gather batches into the reference")
    for part in (solving, gathering):
        part.add_argument("--key", type=Path, required=True, help="the key file, with the slice of the scene")
        part.add_argument("--output", type=Path, required=True)
    solving.add_argument("--first", type=int, required=True)
    solving.add_argument("--last", type=int, required=True, help="the number after the last sample")
    gathering.add_argument("--solves", type=Path, nargs="+", required=True)
    arguments = parser.parse_args()
    key = store.read_key(arguments.key)
    if arguments.part == "solve":
        found = solve(key.configuration, arguments.first, arguments.last)
        store.write(arguments.output, found, key, {"first": arguments.first})
    else:
        store.write(arguments.output, gather(key.configuration, store.read_all(arguments.solves)), key)
