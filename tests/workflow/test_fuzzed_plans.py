"""Random scenes that are taken get a plan: Snakemake builds the graph of each in this process."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, Phase, given, settings
from snakemake.api import SnakemakeApi
from snakemake.settings.types import DAGSettings, OutputSettings, Quietness, ResourceSettings

from roughslip.errors import InputError
from tests.scene.fuzzed import overlays
from tests.scene.shipped import SCENES
from workflow.recovery import run_lock
from workflow.study.scenes import Scenes, checked

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
CASES = int(os.environ.get("SCENE_CASES", "150"))
TOO_LARGE = re.compile(r"(fuzz\d+)\.yaml: stage \w+ would take some \d+ MB of memory, and \d+ MB are there; take ")
TOGETHER = 50  # scenes in one graph: starting Snakemake costs more than planning a scene


def taken(folder: Path, count: int) -> list[str]:
    """Names of as many random scenes that were taken, written into the folder."""
    names: list[str] = []

    @settings(
        max_examples=count,
        deadline=None,
        derandomize="SCENE_SEED" not in os.environ,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(overlay=overlays(SCENES, valid=True))
    def write(overlay: dict) -> None:
        name = f"fuzz{len(names)}"
        file = folder / f"{name}.yaml"
        file.write_text(yaml.safe_dump(overlay), encoding="utf-8")
        try:
            checked(name, folder)  # as a start of Snakemake does: a scan, too, has to be there
            names.append(name)
        except InputError:
            file.unlink()

    write()
    return names


def with_room(folder: Path, names: list[str]) -> list[str]:
    """Those of the scenes that this machine has the memory for; a start tells of every other in a line."""
    told: list[str] = []
    try:
        Scenes(folder, names)
    except InputError as error:
        told = error.lines
    too_large = {found[1] for found in map(TOO_LARGE.search, told) if found}
    assert len(too_large) == len(told), told
    return [name for name in names if name not in too_large]


def plan(folder: Path, names: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The graph of these scenes, as a dry run builds it."""
    monkeypatch.setattr(sys, "argv", ["snakemake", "-n", *names])
    with SnakemakeApi(OutputSettings(quiet={Quietness.ALL})) as api:
        workflow = api.workflow(
            resource_settings=ResourceSettings(cores=1), snakefile=folder / "Snakefile", workdir=folder
        )
        workflow.dag(DAGSettings(targets=set(names))).execute_workflow(executor="dryrun")


@pytest.mark.filterwarnings("default")  # Snakemake runs in this process, and what it warns of is its own
def test_every_scene_that_is_taken_is_planned(empty, tmp_path, monkeypatch):
    """Those that this machine has no memory for are told before, in a line each, and so are the rest."""
    project = empty.copy(tmp_path / "copy").folder
    held: list = []
    monkeypatch.setattr(run_lock, "_held", held)
    monkeypatch.setenv("PYTHONPATH", str(project / "src"))
    names = with_room(project, taken(project / "config" / "scenes", CASES))
    assert len(names) > CASES / 10
    for first in range(0, len(names), TOGETHER):
        plan(project, names[first : first + TOGETHER], monkeypatch)
        for name in names[first : first + TOGETHER]:
            assert (project / "results" / name / "keys" / "claims.json").is_file(), name
    for file in held:
        file.close()
