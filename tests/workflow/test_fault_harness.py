"""A fault of each kind of the campaign that `make faults` runs 200 of, and the harness itself."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from random import Random

import psutil
import pytest

from workflow.faults import campaign, injections
from workflow.faults.scratch import Scratch

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def scratch(shared, tmp_path_factory) -> Iterator[Scratch]:
    """A copy of the finished project; each fault starts from its undisturbed state."""
    environment = shared.options["env"]
    found = Scratch(shared.folder, tmp_path_factory.mktemp("saved") / "state", "tiny", environment)
    found.save()
    yield found
    found.reset()


@pytest.mark.parametrize("number", range(len(injections.FAULTS)))
def test_nothing_is_lost(scratch, number):
    (outcome,) = campaign.outcomes(scratch, 1, range(number, number + 1))
    assert outcome.wrong == [], outcome.told
    assert outcome.recovery == 1, outcome.told  # one new run, and no command beside it


def test_the_harness_sees_what_is_lost(scratch):
    """Each kind of loss, made by hand."""
    scratch.reset()
    assert campaign.differences(scratch) == []
    (scratch.results / "figure2.nc").write_bytes(b"other")
    (scratch.results / "claims.json").unlink()
    (scratch.results / "more.nc").write_bytes(b"")
    (scratch.results / "usage" / "surface.json").write_text("{}")
    assert campaign.differences(scratch) == [
        "claims.json: missing",
        "figure2.nc: differs",
        "more.nc: new",
        "usage/surface.json: damaged",
    ]


def test_a_seed_says_what_is_broken(scratch):
    told = []
    for seed in ("1 4", "1 4", "1 5"):
        scratch.reset()
        told.append(injections.damage(scratch, Random(seed)))
    assert told[0] == told[1] != told[2]


def test_a_process_that_outlives_its_run_is_found(scratch):
    left = subprocess.Popen(["sleep", "60"], cwd=scratch.folder)
    try:
        (line,) = campaign.still_alive(scratch, seconds=0.1)
        assert line == f"process {left.pid} is alive: sleep 60"
    finally:
        left.kill()
        left.wait()
    assert os.getpid() not in [process.pid for process in scratch.processes()]


def test_a_dead_process_that_nobody_has_waited_for_is_not_alive(scratch, monkeypatch):
    """As where a killed run left it to an init that takes its time."""
    code = "import subprocess, time; print(subprocess.Popen(['true']).pid, flush=True); time.sleep(60)"
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        dead = psutil.Process(int(parent.stdout.readline()))
        while dead.status() != psutil.STATUS_ZOMBIE:
            pass
        monkeypatch.setattr(Scratch, "processes", lambda self: [dead])
        assert campaign.still_alive(scratch, seconds=0.1) == []
    finally:
        parent.kill()
        parent.communicate()
