"""Stage page: the verdicts and the costs of a scene, and the page on it; or one page on several scenes together."""

import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from roughslip import store
from roughslip.report.page import SceneReport, page
from roughslip.scene.mistakes import with_origins
from roughslip.scene.part import Scene, without_nulls
from roughslip.study.job import Job
from roughslip.surface.plausibility import yielding
from roughslip.verdicts.statements import claims

BY_LAW = "load_std_by_law"  # of friction under the load, where the law holds
SCENES = Path("config", "scenes")
Files = Mapping[str, Path]


def merged(configurations: list[dict[str, Any]]) -> dict[str, Any]:
    """What several stages read of one scene, in one mapping."""
    whole: dict[str, Any] = {}
    for configuration in configurations:
        for name, value in configuration.items():
            if isinstance(whole.get(name), dict):
                whole[name] = merged([whole[name], value or {}])
            elif value is not None or name not in whole:  # absent for one stage, and read by another
                whole[name] = value
    return whole


def represented(files: Files, stages: list[str], targets: list[str]) -> dict[str, list[str]]:
    """How the surfaces of a scene are represented and why, by the figure that they lead to."""
    sentences = {}
    if "chaos_square" in stages:
        modes, square = store.read(files["surface/modes.nc"]), store.read(files["chaos/square.nc"])
        mean, centre, corner = (modes[f"captured_{where}"] for where in ("variance", "at_centre", "at_corner"))
        missed = float(square["fit_leave_one_out"][-1])
        sentences["figure2"] = [
            f"The {len(modes['eigenvalues'])} modes of the square carry {mean:.1%} of the variance in the mean over "
            f"the mesh, {centre:.1%} at the centre and {corner:.1%} at the corner.",
            f"Our expansion takes {square.attributes['variables']} variables and misses {missed:.1%} of the variance "
            "of left-out surfaces.",
        ]
    if "scan" in stages:
        result = store.read(files["surface/scan.nc"])
        count = int(result["outliers"])
        sentences["figure_scan"] = [
            f"Of the scan was read: {result['read']}; {count or 'no'} outlier{'' if count == 1 else 's'}.",
            f"Model of its surface: {result['model']}.",
        ]
    found = store.read(files["friction/statistics.nc"]) if "friction" in stages else {}
    if "plasticity_index" in found:
        lines = [yielding(float(found["plasticity_index"]), float(found["yielded_share"]))]
        if BY_LAW in found:
            solved, law = (float(found[name] / found["load_mean"]) for name in ("load_std", BY_LAW))
            lines.append(
                f"Friction of the pad scatters by {solved:.2%}; the law of scatter, without a solve, has {law:.2%}."
            )
        sentences["friction_against_load" if "friction_against_load" in targets else "figure5"] = lines
    return sentences


def read_scene(name: str, files: Files, captions: dict[str, str], page_folder: Path) -> SceneReport:
    """What a scene left. files : its results by name; captions : of all figures"""
    costs = store.read_json(files["costs.json"])
    stages = sorted({row["stage"] for row in costs} - {"all"})
    own = store.read_key(files["keys/page.json"]).configuration
    configuration = merged([store.read_key(files[f"keys/{stage}.json"]).configuration for stage in stages])
    configuration |= {name: own[name] for name in ("description", "targets")}
    configuration.pop("figures", None)  # of the stage that draws them
    drawn = [name for name in captions if f"{name}.svg" in files]
    folder, file = os.path.relpath(Path("results", name), page_folder), SCENES / f"{name}.yaml"
    return SceneReport(
        name=name,
        description=configuration["description"],
        figures={figure: files[f"{figure}.svg"].read_bytes() for figure in drawn},
        captions=captions,
        surfaces=represented(files, stages, configuration["targets"]),
        answer=store.read_json(files["answer.json"]) if "answer" in stages else None,
        budget=store.read_json(files["budget.json"]) if "budget" in stages else None,
        claims=store.read_json(files["claims.json"]),
        costs=costs,
        origins=own["origins"],
        folder="" if folder == "." else f"{folder}/",
        file=os.path.relpath(file, page_folder) if file.is_file() else "",
        configuration=json.dumps(without_nulls(configuration), indent=1, sort_keys=True),
    )


def total_costs(records: list[dict[str, Any]], warnings: Sequence[str] = ()) -> list[dict[str, Any]]:
    """What every stage cost, did and warned of: a row a stage, and a last row for the whole scene.

    warnings : on the scene itself, which the last row shows before those of the stages

    Seconds and counts add up over the jobs; peak memory is that of the largest job.
    """
    stages = sorted({record["stage"] for record in records})
    rows = [_sum(stage, [record for record in records if record["stage"] == stage]) for stage in stages]
    of_stages = (f"{row['stage']}: {text}" for row in rows for text in row["warnings"])
    return [*rows, _sum("all", records) | {"warnings": [*warnings, *of_stages]}]


def _sum(stage: str, records: list[dict[str, Any]]) -> dict[str, Any]:
    did: Counter[str] = Counter()
    for record in records:
        did.update(record["did"])
    seconds = {name: round(sum(record[name] for record in records), 3) for name in ("cpu_seconds", "wall_seconds")}
    return {
        "stage": stage,
        "jobs": len(records),
        **seconds,
        "peak_memory_mib": max((record["peak_memory_mib"] for record in records), default=0.0),
        "did": dict(sorted(did.items())),
        "warnings": list(dict.fromkeys(text for record in records for text in record["warnings"])),
    }


def judged(job: Job) -> list[dict[str, Any]]:
    """Return the claims of a scene, from what it has of the pressure at the centre, of friction and of cycles."""
    paths = (job.optional(name) for name in ("square", "friction", "oscillator"))
    square, friction, oscillator = (store.read(path) if path else None for path in paths)
    has_load = friction is not None and "load_mean" in friction  # the paper has none
    return claims(square, None if has_load else friction, oscillator)


def work(scene: Scene, job: Job) -> None:
    """Write claims.json and costs.json, where the page is of one scene, and the page."""
    part, files = job.key.configuration, {name: dict(of_scene) for name, of_scene in job.scenes.items()}
    if "claims" in job.outputs:
        store.write_json(job.outputs["claims"], judged(job))
        records = [store.read_json(path) for path in sorted(job.paths("records"))]
        ((name, own),) = files.items()
        for one in records:
            one["warnings"] = [with_origins(text, part["origins"], name) for text in one["warnings"]]
        store.write_json(job.outputs["costs"], total_costs(records, part["warnings"]))
        own |= {f"{name}.json": job.outputs[name] for name in ("claims", "costs")}
        own["keys/page.json"] = job.output.parent / "key.json"
    scenes = [read_scene(name, own, part["captions"], Path(part["folder"])) for name, own in files.items()]
    store.write_text(job.output, page(scenes, store.versions()))
