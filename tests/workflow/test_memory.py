"""Memory of jobs: what is declared holds what was measured, too large scenes are refused, batches shrink."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from roughslip.errors import InputError
from roughslip.scene.declarations import declarations
from roughslip.scene.plan import stages_needed
from roughslip.scene.types import get
from tests.scene.shipped import SCENES, shipped_scene
from workflow.study import memory
from workflow.study.scenes import Scenes

ROOT = Path(__file__).resolve().parents[2]
MIB = 1.048576  # MB
DESIGNS = declarations()["contact_square"].batches.totals
DESIGN = {"contact_square": "monte_carlo"}
TOTALS = {
    "contact_square": "square.monte_carlo_samples",
    "contact_strip": "strip.samples",
    "expansion_strip": "strip.expansion_samples",
    "oscillator": "ensemble.realisations",
}


def declared(scene: dict, stage: str) -> int:
    """Of the largest job of a stage."""
    count = get(scene, TOTALS[stage]) if stage in TOTALS else 0
    return memory.needed_mb(scene, stage, math.ceil(count / get(scene, "jobs")))


FOUND = ("strip_allocation", "adaptive_training", "ensemble_pilot")  # stages that find numbers of samples


@pytest.mark.parametrize("name", ["paper", "resolved"])
def test_declared_memory_holds_what_the_reference_runs_measured(name):
    """With a tenth to spare for other machines and versions, and no more than four times as much."""
    scene = shipped_scene(name)
    rows = json.loads((ROOT / f"results/reference/{name}/costs.json").read_text())
    did = {key: value for row in rows if row["stage"] in FOUND for key, value in row["did"].items()}
    found = {  # numbers that the study found in that run, where the scene asks for accuracies
        "strip": {"samples": "strips_chosen", "expansion_samples": "expansion_strips_chosen"},
        "expansion": {"samples": "solves"},
        "ensemble": {"realisations": "runs_chosen", "nodes_per_correlation_length": "nodes_chosen"},
    }
    if scene.pop("accuracy", None) is not None:
        for section, keys in found.items():
            scene[section] = scene[section] | {key: did[name] for key, name in keys.items()}
    for row in rows:
        if row["stage"] != "all":
            peak = row["peak_memory_mib"] * MIB
            assert 1.1 * peak < declared(scene, row["stage"]) < 4 * peak + 200, row["stage"]


# Peaks [MiB] of a square of 1024 x 1024 nodes in 95 modes, measured by the stages: what grows with the mesh.
LARGE = {"karhunen_loeve": 2415.6, "design": 1637.3, "contact_square": 1728.4}


def test_declared_memory_holds_a_large_mesh():
    scene = shipped_scene("resolved")
    scene["square"].update(nodes=1024, modes=95, monte_carlo_samples=4000, latin_hypercube_samples=4000)
    for stage, peak in LARGE.items():
        needed = memory.needed_mb(scene, stage, 10 if stage == "contact_square" else 0)
        assert 1.1 * peak * MIB < needed < 2 * peak * MIB, stage


@pytest.mark.slow
def test_jobs_keep_within_what_they_declare(finished):
    records = [json.loads(path.read_text()) for path in finished.path("results/tiny/usage").glob("*.json")]
    tiny = Scenes(finished.folder, ["tiny"])["tiny"]
    assert len(records) > 15
    for record in records:
        assert record["peak_memory_mib"] * MIB < declared(tiny, record["stage"]), record["stage"]


@pytest.mark.parametrize("name", SCENES)
def test_every_shipped_scene_fits_a_small_machine_with_the_batches_that_it_asks_for(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    scenes = Scenes(ROOT, [name], memory_mb=4000)
    for stage, total in TOTALS.items():
        if stage in stages_needed(scenes[name]) and not memory.is_allotted(scenes[name], declarations()[stage].batches):
            first, last = scenes.batches(name, stage, DESIGN.get(stage, ""))[0]
            count = get(scenes[name], total)
            if count != "auto":  # else jobs take shares
                assert last - first == math.ceil(count / 2)


def test_a_scene_too_large_for_the_machine_says_so_with_the_number(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        Scenes(ROOT, ["paper"], memory_mb=300)
    (line,) = caught.value.lines
    assert "stage chaos_square would take some " in line  # that which takes the most
    assert " MB of memory, and 300 MB are there" in line
    assert Scenes(ROOT, ["given"], memory_mb=1000).valid  # only scenes that are asked for must fit
    assert 500 < memory.machine_mb() < 10_000_000


def test_batches_shrink_until_they_fit(monkeypatch, tmp_path):
    """To the largest that does; the samples are the same."""
    monkeypatch.chdir(tmp_path)
    scene = shipped_scene("paper")
    whole = memory.needed_mb(scene, "contact_square", 200_000)
    least = memory.needed_mb(scene, "contact_square", 1)
    limit = (whole + least) // 2
    size = memory.largest_batch(scene, "contact_square", 200_000, limit)
    assert memory.needed_mb(scene, "contact_square", size) <= limit + 1
    assert 90_000 < size < 110_000
    scenes = Scenes(ROOT, ["given"], memory_mb=limit + memory.NODE_MB)
    for design, total in DESIGNS.items():
        batches = scenes.batches("paper", "contact_square", design)
        numbers = [number for first, last in batches for number in (first, last)]
        section, key = total.split(".")
        assert numbers[0] == 0, design
        assert numbers[-1] == scenes["paper"][section][key]
        assert numbers[1:-1:2] == numbers[2::2]


def test_a_job_asks_for_more_at_each_attempt_and_never_for_more_than_a_node_has(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    once = memory.needed_mb(shipped_scene("paper"), "chaos_square") + memory.NODE_MB

    def asked(memory_mb: int) -> list[int]:
        scenes = Scenes(ROOT, ["given"], memory_mb=memory_mb)
        return [scenes.at_attempt(scenes.memory("paper", "chaos_square"), attempt) for attempt in (1, 2, 3)]

    assert asked(4 * once) == [once, 2 * once, 3 * once]
    assert asked(2 * once + 10) == [once, 2 * once, 2 * once + 10]
    assert asked(once + 5) == [once, once + 5, once + 5]
