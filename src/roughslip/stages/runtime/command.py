"""The command of a stage: its options, its key file, its record of cost, and one line for each error."""

import argparse
import gc
import os
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from roughslip.errors import RoughslipError, StoreError
from roughslip.scene.declarations import RANGE, Stage
from roughslip.scene.types import Scene, scene_of
from roughslip.stages import IS_JOB
from roughslip.stages.runtime.usage import Usage
from roughslip.store import Key, read_key


@dataclass(frozen=True)
class Job:
    """One run of a stage.

    key : the slice of the scene that the stage reads, and the hash of its code
    arguments : what the command line says
    usage : the record of cost, written next to the result
    reads : scene keys that the stage declares; None for all
    """

    key: Key
    arguments: argparse.Namespace
    usage: Usage
    reads: tuple[str, ...] | None = None

    @cached_property
    def scene(self) -> Scene:
        """The part of the scene that the stage reads."""
        return scene_of(self.key.configuration, self.reads)


def execute(stage: Stage, work: Callable[[Job], None]) -> None:
    """Run a stage as a command; exit 1 with the message, not a traceback, where the package refuses or gives up.

    Its options are those of its declaration, and the placeholders in the name of its result. A job ends at once when
    its files are written: to take the libraries apart would take a fifth of a second.
    """
    gc.freeze()
    gc.enable()
    parser = argparse.ArgumentParser(prog=f"python -m roughslip.stages.{stage.name}")
    parser.add_argument("--key", type=Path, required=True, help="key file of the stage")
    parser.add_argument("--usage", type=Path, required=True, help="record of cost to write")
    for name in stage.results:
        parser.add_argument(f"--{name}", type=Path, required=True, help="file to write")
    for name in stage.inputs:
        parser.add_argument(f"--{name}", type=Path, required=True)
    for name in (*stage.optional, *stage.collects):
        parser.add_argument(f"--{name}", type=Path, nargs="?")
    for name in stage.many:
        parser.add_argument(f"--{name}", type=Path, nargs="+", required=True)
    for name in stage.placeholders:
        parser.add_argument(f"--{name}", type=int if name in RANGE else str, required=True)
    arguments = parser.parse_args()
    try:
        with Usage(arguments.usage, stage.name) as usage:
            key = read_key(arguments.key)
            work(Job(key, arguments, usage, stage.keys))
            if read_key(arguments.key) != key:  # Snakemake would take the result for that of the new key
                raise StoreError(f"{arguments.key}: scene or code changed while the stage ran; run snakemake again")
            usage.files(
                read=[arguments.key, *_paths(arguments, stage.options)],
                made=_paths(arguments, stage.results),
            )
    except RoughslipError as error:
        print(f"{stage.name}: error: {error}", file=sys.stderr)
        sys.exit(1)
    if IS_JOB:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)


def _paths(arguments: argparse.Namespace, names: Iterable[str]) -> list[Path]:
    """The files under these options, one or more each, of those that were given."""
    given = [getattr(arguments, name) for name in names]
    return [path for one in given if one is not None for path in (one if isinstance(one, list) else [one])]
