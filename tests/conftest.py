"""A copy of the project in which a tiny scene is run once a session; tests plan, edit and break copies of it."""

import fcntl
import os
import shutil
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.workflow.project import Project, copy_project


@pytest.fixture(scope="session")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """The project with the scene `tiny` and no results."""
    return copy_project(tmp_path_factory.mktemp("empty") / "project")


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """The project after `snakemake -j2 tiny`: made once for all workers of a session. Tests only read it."""
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    project = Project(base / "finished")
    with (base / "finished.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not project.folder.exists():
            made = copy_project(base / "in progress")
            made.make("-j2", "tiny")
            made.folder.rename(project.folder)
    return project


@pytest.fixture
def project(finished: Project, tmp_path: Path):
    """A copy of the finished project that a test may change."""
    copy = finished.copy(tmp_path / "copy")
    yield copy
    shutil.rmtree(copy.folder)


@pytest.fixture
def plan(monkeypatch):
    """Jobs of each scene by rule that a dry run in a project announces: {scene: {rule: jobs}}."""
    # Its import takes nearly a second, which no test without plans should wait for.
    from snakemake.api import SnakemakeApi
    from snakemake.settings.types import DAGSettings, OutputSettings, Quietness, RerunTrigger, ResourceSettings

    def planned(folder: Path, *targets: str) -> dict[str, dict[str, int]]:
        monkeypatch.setattr(sys, "argv", ["snakemake", "-n", *targets])
        monkeypatch.setenv("PYTHONPATH", str(folder / "src"))
        with SnakemakeApi(OutputSettings(quiet={Quietness.ALL}, dryrun=True)) as api:
            workflow = api.workflow(
                resource_settings=ResourceSettings(cores=1), snakefile=folder / "Snakefile", workdir=folder
            )
            triggers = frozenset({RerunTrigger.MTIME})  # as in the profile
            workflow.dag(DAGSettings(targets=set(targets), rerun_triggers=triggers)).execute_workflow(executor="dryrun")
            jobs = list(workflow._workflow_store.dag.needrun_jobs(exclude_finished=False))
        counts: dict[str, Counter] = {}
        for job in jobs:
            if job.output:
                scene = job.params.get("scene") or job.wildcards_dict.get("scene", "")
                counts.setdefault(scene, Counter()).update([job.rule.name])
        return {scene: dict(rules) for scene, rules in counts.items()}

    return planned
