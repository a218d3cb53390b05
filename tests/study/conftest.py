"""The work of a stage in this process: from a slice of a scene and files to the result that it writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from roughslip import store
from roughslip.scene.types import scene_of
from roughslip.study.graph import STAGES
from roughslip.study.job import Job

KEY = store.Key({}, "code")


def job_of(name: str, configuration: dict, output: Path, **given: Any) -> Job:
    """A job of a stage. given : first, last, design, paths of files by name, and in `also` further outputs"""
    key, row = store.Key(configuration, "code"), STAGES[name]
    numbers, design = range(given.pop("first", 0), given.pop("last", 0)), given.pop("design", "")
    outputs = {"output": output, **given.pop("also", {})}
    inputs = {name: paths if isinstance(paths, list) else [paths] for name, paths in given.items() if paths is not None}
    return Job(name, scene_of(configuration, row.keys), key, inputs, outputs, numbers, design)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stages")


@pytest.fixture(scope="module")
def run(folder: Path) -> Callable[..., store.Result]:
    """run(stage, configuration, **arguments) is the result. It stays in the module's folder by the stage's name.
    run.did is the work that the last stage counted, and run.warnings what it warned of."""

    def run_stage(stage: ModuleType, configuration: dict, name: str = "", **arguments: object) -> store.Result:
        row = stage.__name__.rpartition(".")[2]
        further = {"text": "text.json", "deterministic": "plain.nc", "ensemble": "runs.nc"}
        also = {kind: folder / file for kind, file in further.items()} | {
            "summary": folder / f"{name or 'summary'}.csv"
        }
        output = folder / f"{name or row}.nc"
        job = job_of(row, configuration, output, also=also, **arguments)
        stage.work(job.scene, job)
        run_stage.did, run_stage.warnings = dict(job.did), job.warnings
        return store.read(output)

    return run_stage


@pytest.fixture(scope="module")
def stored(folder: Path) -> Callable[..., Path]:
    """stored(name, attributes, array=(dimensions, values), ...) is the path of a result of these arrays."""

    def write(name: str, attributes: dict | None = None, **arrays: tuple) -> Path:
        variables = {key: store.Variable(dimensions, values, "1", key) for key, (dimensions, values) in arrays.items()}
        store.write(folder / name, variables, KEY, attributes)
        return folder / name

    return write
