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
    parser.add_argument("part", choices=("solve", "gather"), help="a batch of samples, or batches into the reference")
    parser.add_argument("--key", type=Path, required=True, help="the key file, with the slice of the scene")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--first", type=int, help="number of the first sample of a batch")
    parser.add_argument("--last", type=int, help="the number after its last sample")
    parser.add_argument("--solves", type=Path, nargs="+", help="the batches")
    arguments = parser.parse_args()
    key = store.read_key(arguments.key)
    if arguments.part == "solve":
        found = solve(key.configuration, arguments.first, arguments.last)
        store.write(arguments.output, found, key, {"first": arguments.first})
    else:
        store.write(arguments.output, gather(key.configuration, store.read_all(arguments.solves)), key)
