"""Make the Monte Carlo references that are missing: python -m workflow.monte_carlo.references -j 2.

Batches of samples go to results/monte_carlo, and an interrupted run goes on from them. Solves take more than an hour
and depend on the physics alone: another solver finds the same pressures to 1e-6. So the folder of batches is named by
the part of the scene that they depend on, without code and packages. A test shows that the present code reproduces the
kept numbers.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from roughslip import store
from roughslip.errors import RoughslipError
from roughslip.scene.loader import load
from roughslip.stages import die_with_parent
from workflow.monte_carlo import friction, pressure

KINDS = {"pressure": pressure, "friction": friction}
SCENES = Path(__file__).resolve().parents[2] / "config" / "scenes"


def reference_file(name: str, kind: str) -> Path:
    """Where the reference of a scene is kept."""
    return Path("results", "reference", name, f"{kind}.nc")


def make(name: str, kind: str, samples: int, jobs: int) -> None:
    """Solve the batches that are not there and gather all of them into the reference of a scene."""
    key, (total, step) = _key(name, kind), KINDS[kind].SAMPLES[name]
    part = hashlib.sha256(json.dumps(key.configuration, sort_keys=True).encode()).hexdigest()[:16]
    folder = Path("results", "monte_carlo", f"{kind}-{part}")
    files = [folder / f"{first}-{first + step}.nc" for first in range(0, max(1, min(samples, total)), step)]
    with ProcessPoolExecutor(jobs, initializer=die_with_parent) as pool:
        for file in pool.map(_solve, files, [name] * len(files), [kind] * len(files)):
            print(file, flush=True)
    store.write(reference_file(name, kind), KINDS[kind].gather(key.configuration, store.read_all(files)), key)


def _key(name: str, kind: str) -> store.Key:
    return store.Key(KINDS[kind].slice_of(load(name, SCENES)), "any")


def _solve(file: Path, name: str, kind: str) -> Path:
    """Solve the batch of that name."""
    key, (first, last) = _key(name, kind), map(int, file.stem.split("-"))
    if not file.is_file():
        store.write(file, KINDS[kind].solve(key.configuration, first, last), key, {"first": first})
    return file


def main() -> None:
    """Make what is missing; exit 1 with a line where a scene is refused or a solve fails."""
    parser = argparse.ArgumentParser(prog="python -m workflow.monte_carlo.references", description=__doc__)
    parser.add_argument("-j", "--jobs", type=int, default=2, help="batches at a time (2)")
    parser.add_argument("--samples", type=int, default=sys.maxsize, help="at most so many of each, in whole batches")
    arguments = parser.parse_args()
    try:
        for kind, module in KINDS.items():
            for name in module.SAMPLES:
                if not reference_file(name, kind).is_file():
                    make(name, kind, arguments.samples, arguments.jobs)
    except RoughslipError as error:
        sys.exit(f"references: error: {error}")


if __name__ == "__main__":
    main()
