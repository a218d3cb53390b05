"""Stage report: one page on one scene, or on several together."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from roughslip import store
from roughslip.report import SceneReport, page
from roughslip.stages.command import Job, execute


def merged(configurations: list[dict[str, Any]]) -> dict[str, Any]:
    """What several stages read of one scene, in one mapping."""
    whole: dict[str, Any] = {}
    for configuration in configurations:
        for name, value in configuration.items():
            whole[name] = merged([whole[name], value]) if isinstance(whole.get(name), dict) else value
    return whole


def read_scene(folder: Path) -> SceneReport:
    """What a scene left in its folder of results."""
    configuration = merged([store.read_key(path).configuration for path in sorted((folder / "keys").glob("*.json"))])
    return SceneReport(
        name=folder.name,
        description=str(configuration.get("description", "")),
        figures={path.stem: path.read_bytes() for path in sorted(folder.glob("figure*.png"))},
        claims=store.read_json(folder / "claims.json"),
        costs=store.read_json(folder / "costs.json"),
        configuration=json.dumps(configuration, indent=1, sort_keys=True),
    )


def work(job: Job) -> None:
    """Write the page."""
    scenes = [read_scene(folder) for folder in job.arguments.scenes]
    store.write_text(job.arguments.output, page(scenes, store.versions()))


if __name__ == "__main__":
    execute("report", work, batches=("scenes",))
