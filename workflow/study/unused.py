"""Remove results that no scene uses: python -m workflow.job study.unused, which `snakemake clean_unused` runs."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from workflow.recovery.integrity import jobs_of
from workflow.study.options import FOLDERS
from workflow.study.scenes import Scenes


def unused(scenes: Scenes) -> list[Path]:
    """Folders of scenes that are gone, and files and records of jobs that a scene has no more; all below results.

    A scene with a mistake keeps all that it has. What another scene shares stays there.
    """
    found: list[Path] = []
    for folder in sorted(path for path in Path("results").glob("*") if (path / "usage").is_dir()):
        name = folder.name
        if name in scenes.valid:
            files = {file for stage in scenes.stages(name) for file in scenes.files(name, stage)}
            others = sorted({path.as_posix() for path in (folder / "usage").glob("*.json")} - files)
            found += [Path(file) for job in jobs_of(others) for file in job.made if file not in files]
            found += map(Path, others)
        elif name not in (*scenes.names, *FOLDERS):
            found.append(folder)
    return found


def main() -> int:
    """Remove it, with a line for each file or folder."""
    for path in unused(Scenes(Path(__file__).resolve().parents[2], words=[])):
        print(f"removed: {path}", flush=True)
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
