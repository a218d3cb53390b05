"""A copy of the project that may be broken, the scene that it runs, and what an undisturbed run left in it."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from roughslip.stages.runtime.parent import die_with_parent
from roughslip.stages.runtime.record import checksum

SOURCES = ("Snakefile", "workflow", "src", "config", "profiles", "requirements.lock", "pyproject.toml")

# Each stage, about as small as the schema allows; one job a batched stage, three for the designs of the square.
TINY = """\
extends: paper
description: "Every stage, as small as the rules allow"
square: {nodes: 8, modes: 64, monte_carlo_samples: 4000, latin_hypercube_samples: 4000}
expansion: {variables: 3, degree: 2, samples: 200, draws: 2000}
strip:
  cell_m: 5.0e-6
  window_spacing_m: 6.0e-5
  penetration_percentiles: [30, 50]
  samples: 8
  training_samples: 3
  expansion_samples: 16
ensemble:
  realisations: 8
  duration_periods: 20
  damping_ratios: [0.17, 0.34]
  drawn_realisations: 2
answer: {realisations: 72, duration_periods: 20}
jobs: 1
"""

# They hold seconds and megabytes, which differ from run to run; only their existence is compared.
TIMED = ("costs.json", "report.html")
_DAC_OVERRIDE, _PR_CAPBSET_DROP = 1, 24  # of <linux/capability.h>, <linux/prctl.h>
_STATE = ("results", ".snakemake")


def copy_project(root: Path, folder: Path) -> None:
    """Copy the project's sources without what was generated in them."""
    folder.mkdir(parents=True)
    for name in SOURCES:
        if (root / name).is_dir():
            shutil.copytree(root / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            shutil.copy2(root / name, folder / name)


@dataclass(frozen=True)
class Scratch:
    """A project in which a scene has run, and a copy of what it left.

    folder : the project
    saved : results and Snakemake's records after the undisturbed run
    scene : name of the scene
    environment : for processes in it
    """

    folder: Path
    saved: Path
    scene: str
    environment: dict[str, str]

    @property
    def results(self) -> Path:
        return self.folder / "results" / self.scene

    @property
    def stored(self) -> Path:
        return self.folder / "results" / "store"

    @property
    def options(self) -> dict:
        """What subprocess takes to run a command in the project."""
        return {"cwd": self.folder, "env": self.environment, "text": True}

    def save(self) -> None:
        """Keep the present state as the undisturbed one."""
        shutil.rmtree(self.saved, ignore_errors=True)
        for name in _STATE:
            shutil.copytree(self.folder / name, self.saved / name)

    def reset(self) -> None:
        """Restore the undisturbed state, with all times."""
        for name in _STATE:
            shutil.rmtree(self.folder / name, ignore_errors=True)
            shutil.copytree(self.saved / name, self.folder / name)

    def start(self, largest_file: int | None = None) -> subprocess.Popen:
        """Start Snakemake for the scene, as `make reproduce` does. largest_file : [B] that a process may write"""
        return subprocess.Popen(
            [sys.executable, "-m", "snakemake", "-j2", self.scene],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            preexec_fn=as_a_user(largest_file),
            **self.options,
        )

    def run(self, largest_file: int | None = None) -> tuple[int, str]:
        """Run the same to its end and return exit status and output."""
        with self.start(largest_file) as process:
            output = process.communicate(timeout=600)[0]
        return process.returncode, output


def digests(folder: Path) -> dict[str, str]:
    """Checksums of all results in a folder by name; "there" of what holds times."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        is_result = not name.startswith("logs/") and not path.name.startswith(".")
        if path.is_file() and is_result:
            found[name] = "there" if name in TIMED or name.startswith("usage/") else checksum(path)
    return found


def as_a_user(largest_file: int | None = None) -> Callable[[], None]:
    """Return what runs in a new process first: root gives up overruling permissions, and file size is limited."""

    def prepare() -> None:
        if sys.platform == "linux" and os.geteuid() == 0:
            import ctypes

            ctypes.CDLL(None).prctl(_PR_CAPBSET_DROP, _DAC_OVERRIDE, 0, 0, 0)
        die_with_parent()
        if largest_file is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))

    return prepare
