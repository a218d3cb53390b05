"""Scenes with equal keys share results: which ones, what is planned, and no scene needs another's folder."""

from __future__ import annotations

import shutil

import pytest

from roughslip.scene import plan as scene_plan
from workflow.faults.scratch import digests
from workflow.study.scenes import Scenes
from workflow.study.sharing import chain_keys
from workflow.study.unused import unused

# Snakemake runs in this process, and its warnings are its own.
pytestmark = pytest.mark.filterwarnings("default")

OF_OSCILLATOR = {"deterministic", "oscillator", "cycles", "belt_readings"}
OF_FIGURE5 = OF_OSCILLATOR - {"belt_readings"}
OF_POINT = {"answer", "stick_slip_map"}  # which read the oscillator and not the list of damping ratios
OF_STRIP = {"contact_strip", "chaos_strip", "expansion_strip", "friction"}
OF_SQUARE = {"design", "contact_square", "chaos_square"}  # without karhunen_loeve, which draws nothing
FRICTION = OF_STRIP | OF_OSCILLATOR | OF_POINT
OWN = {"figure5": 1, "figure_chain": 1, "claims": 1, "costs": 1, "scene_report": 1}


@pytest.mark.parametrize(
    ("overlay", "own"),
    [
        ("oscillator: {damping_ratio: 0.2}", OF_OSCILLATOR | OF_POINT),
        ("ensemble: {damping_ratios: [0.17, 0.3]}", OF_OSCILLATOR),
        ("jobs: 2", FRICTION | OF_SQUARE - {"design"}),  # other jobs
        ("expansion: {draws: 3000}", {"chaos_square"}),
        ("strip: {expansion_samples: 24}", {"expansion_strip", "friction"} | OF_OSCILLATOR | OF_POINT),
        ("friction: {mean_at_median: 0.2}", {"friction"} | OF_OSCILLATOR | OF_POINT),
        ("material: {young_modulus_pa: 1.0e+9}", FRICTION | OF_SQUARE - {"design"}),
        ("seed: 7", FRICTION - {"deterministic"} | OF_SQUARE | {"deterministic"}),
        ("description: Another", set()),
    ],
)
def test_chain_keys_differ_from_the_first_change_on(empty, tmp_path, overlay, own):
    """A stage has a new key where its own part changed, or that of any stage before it; all other keys are equal."""
    project = empty.copy(tmp_path / "copy")
    project.scene("variant", f"extends: tiny\n{overlay}\n")
    scenes = Scenes(project.folder, ["tiny"])
    chain_key = chain_keys(scenes)
    stages = [one for one in scene_plan.in_order(scenes.stages("tiny")) if "figure" not in one]
    changed = {one for one in stages if chain_key("tiny", one) != chain_key("variant", one)}
    assert changed - {"claims", "costs", "report"} == own


@pytest.mark.slow
def test_a_variant_plans_no_job_of_the_stages_that_it_shares(shared, plan):
    """From disk in one job of links; in a run of several new scenes, the first computes for all."""
    shared.scene("variant", "extends: tiny\ntargets: [figure5]\noscillator: {damping_ratio: 0.2}\n")
    oscillator = dict.fromkeys(OF_FIGURE5 | {"answer"}, 1) | OWN
    assert plan(shared.folder, "variant") == {"": {"variant.shared": 1}, "variant": oscillator}
    shared.scene("new", "extends: variant\ntargets: [figure5]\nseed: 7\n")
    shared.scene("newer", "extends: new\ntargets: [figure5]\noscillator: {damping_ratio: 0.3}\n")
    assert plan(shared.folder, "newer", "new") == {
        "": {"newer.shared": 1},
        "new": dict.fromkeys(OF_STRIP, 1) | oscillator,
        "newer": oscillator,
    }


@pytest.mark.slow
def test_a_sweep_solves_a_contact_problem_once(shared, plan):
    """Four variants of two materials: the material of the scene itself is on disk, each other one is solved once."""
    sweep = "sweep: {oscillator.damping_ratio: [0.1, 0.2], material.hardness_pa: [2.0e+9, 3.0e+9]}"
    shared.scene("mine", f"extends: tiny\ntargets: [figure5]\n{sweep}\n")
    planned = plan(shared.folder, "mine")
    own = dict.fromkeys(OF_FIGURE5 | {"answer"}, 1) | OWN
    assert planned.pop("") == {"mine.shared": 1, "mine-3.shared": 1, "mine-4.shared": 1}
    assert planned.pop("mine") == {"answer": 1, "sweep": 1} | OWN
    assert planned == {
        **dict.fromkeys(("mine-1", "mine-2"), dict.fromkeys(OF_STRIP, 1) | own),
        **dict.fromkeys(("mine-3", "mine-4"), own),
    }


@pytest.mark.slow
def test_results_of_other_keys_or_damaged_ones_are_not_shared(project, plan):
    """Those of a scene edited after its run, and those that differ from their checksum: both are computed."""
    contact = "results/variant/contact/strip-0-8.nc"
    project.scene("variant", "extends: tiny\n")
    assert plan(project.folder, contact) == {"": {"variant.shared": 1}}
    project.edit("config/scenes/tiny.yaml", "training_samples: 3", "training_samples: 4")
    assert plan(project.folder, contact) == {"variant": {"contact_strip": 1}}
    project.edit("config/scenes/tiny.yaml", "training_samples: 4", "training_samples: 3")
    project.path("results/tiny/contact/strip-0-8.nc").write_bytes(b"flipped")
    assert plan(project.folder, contact) == {"variant": {"contact_strip": 1}}


@pytest.mark.slow
def test_a_scene_outlives_the_one_that_it_shares_with(project, plan):
    """Results are those of a run of its own; they survive the other scene, its edits, and damage of shared files."""
    project.scene("variant", "extends: tiny\ntargets: [figure3]\n")
    project.make("-j2", "variant")
    results, other = project.path("results/variant"), project.path("results/tiny")
    made, of_tiny = digests(results), digests(other)
    assert {
        name: of_tiny[name] for name in made if name.startswith(("contact", "chaos", "friction"))
    }.items() <= made.items()
    assert results.joinpath("friction/statistics.nc").samefile(other / "friction/statistics.nc")
    with results.joinpath("friction/statistics.nc").open("r+b") as file:  # the one file of both scenes
        file.write(b"damaged")
    said = project.make("-j2", "variant", "tiny")
    assert "friction/statistics.nc; moved to statistics.nc.damaged and rebuilt" in said
    assert (digests(results), digests(other)) == (made, of_tiny)
    shutil.rmtree(project.path(".snakemake"))
    assert plan_after_run(project, plan, "variant", "tiny") == {}
    shutil.rmtree(other)
    project.edit("config/scenes/tiny.yaml", "training_samples: 3", "training_samples: 4")
    project.edit("config/scenes/variant.yaml", "targets", "strip: {training_samples: 3}\ntargets")
    assert plan(project.folder, "variant") == {}
    assert digests(results) == made


def plan_after_run(project, plan, *targets: str) -> dict:
    """What is planned after a run that should have nothing to do but the page, which keeps no record of its inputs."""
    project.make("-j2", *targets)
    return plan(project.folder, *targets)


@pytest.mark.slow
def test_only_results_of_no_scene_are_unused(project, monkeypatch):
    monkeypatch.chdir(project.folder)
    project.scene("wrong", "extends: nothing\n")
    for name in ("wrong", "gone", "benchmarks"):
        project.path(f"results/{name}/usage").mkdir(parents=True)
    project.edit("config/scenes/tiny.yaml", "strip_samples: 8", "strip_samples: 4")
    found = {path.as_posix() for path in unused(Scenes(project.folder, []))}
    old = {"results/tiny/contact/strip-0-8.nc", "results/tiny/usage/contact_strip-0-8.json"}
    assert found == {"results/gone"} | old
