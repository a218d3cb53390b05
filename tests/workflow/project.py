"""A copy of the project in which a tiny scene runs, and which tests may edit and break."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from roughslip.compilation.source_hash import compiled_folder
from roughslip.study import checksum, die_with_parent

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("Snakefile", "workflow", "src", "config", "profiles", "requirements.lock", "pyproject.toml")

# Each stage, about as small as the schema allows; one job a batched stage, three for the designs of the square.
TINY = """\
extends: paper
description: "Every stage, as small as the rules allow"
square: {nodes: 8, modes: 64, monte_carlo_samples: 4000, latin_hypercube_samples: 8000}
expansion: {degree: 2, samples: 200}
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
answer: {realisations: 72, duration_periods: 20}
jobs: 1
"""

# They hold seconds and megabytes, which differ from run to run; only their existence is compared.
TIMED = ("costs.json", "report.html")
_DAC_OVERRIDE, _PR_CAPBSET_DROP = 1, 24  # of <linux/capability.h>, <linux/prctl.h>


@dataclass(frozen=True)
class Project:
    """A copy of the project, and Snakemake in it. folder : its root"""

    folder: Path

    def path(self, name: str) -> Path:
        return self.folder / name

    def scene(self, name: str, text: str) -> None:
        self.path(f"config/scenes/{name}.yaml").write_text(text)

    def edit(self, name: str, old: str, new: str) -> None:
        text = self.path(name).read_text()
        assert old in text
        self.path(name).write_text(text.replace(old, new, 1))

    def copy(self, folder: Path) -> Project:
        """The project with all time stamps and results."""
        return Project(shutil.copytree(self.folder, folder))

    @property
    def options(self) -> dict:
        """What subprocess takes to run a command in the project."""
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(compiled_folder()), "PYTHONPATH": str(self.path("src"))}
        return {"cwd": self.folder, "env": environment, "text": True}

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess:
        return subprocess.run([sys.executable, "-m", "snakemake", *arguments], capture_output=True, **self.options)

    def make(self, *arguments: str) -> str:
        run = self.snakemake(*arguments)
        assert run.returncode == 0, run.stdout[-5000:] + run.stderr
        return run.stdout + run.stderr


def copy_project(folder: Path) -> Project:
    """Copy the project's sources without what was generated in them, and add the scene `tiny`."""
    folder.mkdir(parents=True)
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            shutil.copy2(ROOT / name, folder / name)
    project = Project(folder)
    project.scene("tiny", TINY)
    return project


def digests(folder: Path) -> dict[str, str]:
    """Checksums of all results in a folder by name; "there" of what holds times."""
    sums = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and not name.startswith("logs/") and not path.name.startswith("."):
            sums[name] = "there" if name in TIMED or name.startswith("usage/") else checksum(path)
    return sums


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
