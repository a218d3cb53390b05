"""Give a scene the results of jobs of another one, with their records: python -m workflow.job study.share ..."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
from pathlib import Path

from roughslip.atomic_write import replacing
from roughslip.stages.runtime import record

TAKEN = "jobs: a scene with equal keys has the results"  # an entry of `skipped` in a record


def share(source: Path, scene: str) -> str:
    """Link what one job made into the folder of a scene, then write its record there, with the names of that folder.

    source : record of the job, results/<another scene>/usage/<job>.json

    Returns what is wrong, else "". A file system without hard links gets copies.
    """
    content = record.read(source) if source.is_file() else None
    if content is None:
        return f"{source}: missing or damaged; run snakemake again"
    folder = source.parents[1]
    own = folder.with_name(scene)

    def renamed(checksums: dict[str, str]) -> dict[str, str]:
        return {
            (own / Path(name).relative_to(folder)).as_posix() if Path(name).is_relative_to(folder) else name: checksum
            for name, checksum in checksums.items()
        }

    names = list(content["made"])
    made = renamed(content["made"])
    content |= {"read": renamed(content["read"]), "made": made, "skipped": {**content["skipped"], TAKEN: 1}}
    try:
        for name, target in zip(names, made, strict=True):
            with replacing(Path(target)) as temporary:
                try:
                    os.link(name, temporary)
                except OSError:
                    shutil.copyfile(name, temporary)
            if record.checksum(Path(target)) != made[target]:
                return f"{name}: damaged; run snakemake again"
        with replacing(own / "usage" / source.name) as temporary:
            temporary.write_text(json.dumps(record.sealed(content), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        return f"{source}: its results cannot be taken: {error.strerror}, {error.filename}; then run snakemake again"
    return ""


def main() -> int:
    """Share the results of some jobs; exit 1 with a line for each that failed."""
    parser = argparse.ArgumentParser(prog="python -m workflow.job study.share", description=__doc__)
    parser.add_argument("--scene", required=True, help="name of the scene that gets them")
    parser.add_argument("--records", type=Path, nargs="+", required=True, help="records of the jobs")
    arguments = parser.parse_args()
    lines = [line for source in arguments.records if (line := share(source, arguments.scene))]
    print("".join(f"{line}\n" for line in lines), end="", file=sys.stderr)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
