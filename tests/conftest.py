"""A copy of the project in which a tiny scene is run once a session."""

from __future__ import annotations

import fcntl
import os

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
