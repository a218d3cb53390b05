"""The work of a stage in this process: from a slice of a scene and files to the result that it writes."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from roughslip import store
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.usage import Usage

KEY = store.Key({}, "code")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stages")


@pytest.fixture(scope="module")
def run(folder: Path) -> Callable[..., store.Result]:
    """run(stage, configuration, **arguments) is the result. It stays in the module's folder by the stage's name.
    run.did and run.skipped are the work that the last stage counted, done and not computed, and run.warnings."""

    def run_stage(stage: ModuleType, configuration: dict, name: str = "", **arguments: object) -> store.Result:
        stem = name or stage.__name__.rpartition(".")[2]
        output = folder / f"{stem}.nc"
        defaults = {
            "scan": None,
            "friction": None,
            "output": output,
            "summary": folder / "summary.csv",
        }
        key = store.Key(configuration, "code")
        usage = Usage(folder / f"{stem}.json", stem)
        stage.work(Job(key, Namespace(**{**defaults, **arguments}), usage, stage.STAGE.keys))
        run_stage.did, run_stage.skipped, run_stage.warnings = usage.record()["did"], usage.skipped, usage.warnings
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
