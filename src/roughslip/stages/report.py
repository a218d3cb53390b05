"""Stage report: one page on one scene, or on several together."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from roughslip import store
from roughslip.errors import StoreError
from roughslip.report import SceneReport, page
from roughslip.stages.command import Job, execute


def merged(configurations: list[dict[str, Any]]) -> dict[str, Any]:
    """What several stages read of one scene, in one mapping."""
    whole: dict[str, Any] = {}
    for configuration in configurations:
        for name, value in configuration.items():
            whole[name] = merged([whole[name], value]) if isinstance(whole.get(name), dict) else value
    return whole


def picture(path: Path) -> bytes:
    """A PNG file. Raises StoreError where it is missing."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise StoreError(f"{path}: missing ({error}); rebuild it with: snakemake -j2 {path}") from error


def read_scene(folder: Path) -> SceneReport:
    """What a scene left in its folder of results."""
    costs = store.read_json(folder / "costs.json")
    stages = sorted({row["stage"] for row in costs} - {"all"})  # of this run: the folder may hold keys of older targets
    configuration = merged([store.read_key(folder / "keys" / f"{stage}.json").configuration for stage in stages])
    scan = ["figure_scan"] if "figure_scan" in stages else []
    return SceneReport(
        name=folder.name,
        description=configuration["description"],
        figures={name: picture(folder / f"{name}.png") for name in dict.fromkeys((*scan, *configuration["targets"]))},
        claims=store.read_json(folder / "claims.json"),
        costs=costs,
        configuration=json.dumps(configuration, indent=1, sort_keys=True),
    )


def work(job: Job) -> None:
    """Write the page."""
    scenes = [read_scene(folder) for folder in job.arguments.scenes]
    store.write_text(job.arguments.output, page(scenes, store.versions()))


if __name__ == "__main__":
    execute("report", work, batches=("scenes",))
