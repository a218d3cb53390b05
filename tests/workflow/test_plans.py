"""What a dry run plans: the stages of a scene, the jobs that an edit repeats, shared names."""

import os
import shutil
from pathlib import Path

import pytest

from roughslip.errors import InputError
from roughslip.study.graph import STAGES
from workflow.keys import Names
from workflow.study.scenes import Scenes
from workflow.study.working_folder import unused

# Snakemake runs in this process, and its warnings are its own.
pytestmark = pytest.mark.filterwarnings("default")

# The page shows figures, verdicts and costs, so it ends each list.
PAGE = {"page": 1, "publish": 1}
END = {"figures": 1, **PAGE}
SQUARE = {"karhunen_loeve": 1, "contact_square": 3, "chaos_square": 1}
STRIP = {"contact": 1, "expansion_strip": 1, "friction": 1}
OSCILLATOR = {"answer": 1, "cycles": 1}
MAP = {"answer": 1, "stick_slip_map": 1}
SCAN = {"scan": 1}
GIVEN = "friction: {statistics: {standard_deviation: 0.05, correlation_length_m: 2.5e-4}}"
GROUND = "roughness: {scan: {file: config/scans/ground.nc, form: plane, covariance: best, marginal: gaussian}}"
PLANNED = {
    "targets: [figure2, figure3]\njobs: 4": {
        **(SQUARE | {"contact_square": 5}),
        **(STRIP | {"contact": 4}),
    },
    "targets: [figure5]": STRIP | OSCILLATOR,
    f"targets: [figure5, figure_map]\n{GIVEN}": OSCILLATOR | MAP,
    f"targets: [figure2, figure_scan]\n{GROUND}": SQUARE | SCAN,
    f"targets: [figure5]\n{GIVEN}\n{GROUND}": OSCILLATOR,
    f"targets: [answer]\n{GIVEN}": {"answer": 1},
}


@pytest.mark.slow
def test_a_scene_runs_the_stages_that_its_targets_need(empty, tmp_path, plan):
    """All scenes in one dry run, which writes nothing. A result is a target too. The study has 45 jobs, a case 8."""
    project = empty.copy(tmp_path / "copy")
    names = [f"mine{number}" for number in range(len(PLANNED))]
    for number, (name, text) in enumerate(zip(names, PLANNED, strict=True)):  # no two alike, which share
        unlike = f"seed: {number}\nsquare: {{modes: {63 - number}}}\noscillator: {{mass_kg: 1.0{number:02}}}"
        project.scene(name, f"extends: tiny\n{unlike}\n{text}\n")
    planned = plan(project.folder, *names, "results/given/figure5.png", "results/tiny/contact/blocks-0-8.nc")
    assert planned.pop("given") == {"cycles": 1, "figures": 1, "one_file": 1}
    assert planned.pop("tiny") == {"contact": 1, "one_file": 1}
    for name, stages in zip(names, PLANNED.values(), strict=True):
        assert planned[name] == stages | (PAGE if stages == {"answer": 1} else END)
    assert not project.path("results").exists()
    for scenes, most in ((("paper", "resolved"), 45), (("disc_brake",), 8)):
        jobs = plan(project.folder, *scenes)
        assert sum(n for rules in jobs.values() for rule, n in rules.items() if rule in STAGES) <= most


# Jobs that an edit repeats.
CYCLES = {"cycles": 1, **END}
FRICTION = {"answer": 1, "stick_slip_map": 1, **CYCLES}  # a scene that names no targets has the map with figure5
CONTACT = {"contact_square": 3, "chaos_square": 1, **STRIP, **FRICTION}
SCENE = "config/scenes/tiny.yaml"
ACTS = ("\n\n\n", "\n\n_EDITED = 1\n\n\n")
EDITS = [
    (SCENE, "[0.17, 0.34]", "[0.17, 0.30]", CYCLES),
    (SCENE, "square:", "seed: 1\nsquare:", CONTACT),
    (SCENE, "Every stage", "Each stage", END),
    (SCENE, "samples: 8\n", "samples: 8  # few\n", {}),
    ("requirements.lock", "\nnumpy==", "\nnumpy==99.", {"karhunen_loeve": 1, **CONTACT}),
    ("src/roughslip/figures/style.py", *ACTS, END),
    ("src/roughslip/surface/modes.py", *ACTS, {**SQUARE, **END}),
    ("src/roughslip/contact/solve.py", *ACTS, CONTACT),
    ("src/roughslip/contact/solve.py", '"""', '"""Edited: ', {}),
    ("Snakefile", "rule all:", "# By default:\nrule all:", {}),
]


@pytest.mark.slow
def test_an_edit_repeats_the_jobs_that_depend_on_it(project, plan):
    """Each edit is planned and taken back, all by dry runs. Scenes share what has one name: from disk, and in a run of
    several new scenes, of which the first computes for all."""
    for name, old, new, jobs in EDITS:
        file = project.path(name)
        text, changed = file.read_text(), file.stat().st_mtime_ns
        project.edit(name, old, new)
        planned = plan(project.folder, "tiny")
        file.write_text(text)
        os.utime(file, ns=(changed, changed))
        assert planned == ({"tiny": jobs} if jobs else {}), (name, new)
    shutil.rmtree(project.path(".snakemake"))
    assert plan(project.folder, "tiny") == {}
    project.scene("variant", "extends: tiny\ntargets: [figure5]\noscillator: {damping_ratio: 0.2}\n")
    assert plan(project.folder, "variant") == {"variant": OSCILLATOR | END}
    project.scene("new", "extends: variant\ntargets: [figure5]\nseed: 7\n")
    project.scene("newer", "extends: new\ntargets: [figure5]\noscillator: {damping_ratio: 0.3}\n")
    planned = plan(project.folder, "newer", "new")
    assert planned == {"new": STRIP | OSCILLATOR | END, "newer": OSCILLATOR | END}


OF_POINT = {"answer", "stick_slip_map"}  # which read the oscillator and not the list of damping ratios
OF_SQUARE = {"contact_square", "chaos_square"}
ALL_FRICTION = {*STRIP, "cycles"} | OF_POINT
# Of each overlay on `tiny` the stages that have another name.
OVERLAYS = {
    "oscillator: {damping_ratio: 0.2}": {"cycles"} | OF_POINT,
    "ensemble: {damping_ratios: [0.17, 0.3]}": {"cycles"},
    "jobs: 4": ALL_FRICTION | OF_SQUARE,  # other batches
    "strip: {expansion_samples: 24}": {"expansion_strip", "friction", "cycles"} | OF_POINT,
    "seed: 7": ALL_FRICTION | OF_SQUARE,
    "description: Another": set(),
}


def names_of(folder: Path, *words: str) -> Names:
    return Names(Scenes(folder, [*words]), folder, writes=False)


def test_names_differ_from_the_first_change_on_and_only_results_of_no_scene_are_unused(empty, tmp_path, monkeypatch):
    """A stage has a new name where its own part changed, or that of any stage before it. The order of keys is free.
    While a scene has a mistake nothing is unused, because what it names is not known."""
    project = empty.copy(tmp_path / "copy")
    for file in project.path("config/scenes").glob("*.yaml"):
        if file.stem not in ("paper", "tiny"):
            file.unlink()
    variants = {f"variant-of-{number}": overlay for number, overlay in enumerate(OVERLAYS)}
    for name, overlay in variants.items():
        project.scene(name, f"extends: tiny\n{overlay}\n")
    project.scene("one", "extends: tiny\noscillator: {mass_kg: 1.5, damping_ratio: 0.2}\nseed: 3\n")
    project.scene("other", "seed: 3\noscillator: {damping_ratio: 0.20, mass_kg: 1.5}\nextends: tiny\n")
    names = names_of(project.folder, "tiny", *variants, "one", "other")
    stages = names.scenes.stages("tiny") - {"figures", "page"}
    for name, overlay in variants.items():
        changed = {stage for stage in stages if names.entry("tiny", stage).key != names.entry(name, stage).key}
        assert changed == OVERLAYS[overlay], overlay
    assert names.entry("one", "cycles") == names.entry("other", "cycles")
    monkeypatch.chdir(project.folder)
    gone, used = "results/store/friction/0123456789abcdef", names.entry("tiny", "friction").folder
    for folder in (used, gone, "results/gone", "results/benchmarks"):
        Path(folder).mkdir(parents=True)
    assert {path.as_posix() for path in unused(names_of(project.folder, "tiny"))} == {"results/gone", gone}
    project.scene("wrong", "extends: nothing\n")
    with pytest.raises(InputError, match="nothing is removed while scenes have mistakes: wrong"):
        unused(names_of(project.folder))
