"""What an edit re-runs: a dry run after a finished one announces exactly these jobs."""

from __future__ import annotations

import os
import shutil
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

pytestmark = pytest.mark.slow

# Jobs of the scene tiny by what they hang on. The report shows figures, verdicts and costs, so it closes every change.
DESIGN = {"design": 1}
SURFACE = {"surface": 1, **DESIGN}
SQUARE = {"contact_square": 3}
STRIP = {"contact_strip": 1}
CHAOS_SQUARE = {"chaos_square": 1, "figure2": 1}
FIGURES = {"figure2": 1, "figure3": 1, "figure3_law": 1, "figure5": 1}
REPORT = {"scene_report": 1, "tiny": 1}
COSTS = {"costs": 1, **REPORT}
CLAIMS = {"claims": 1, **COSTS}
CYCLES = {"cycles": 1, "figure5": 1, **CLAIMS}
OSCILLATOR = {"deterministic": 1, "oscillator": 1, **CYCLES}
FRICTION = {"friction": 1, "figure3": 1, "figure3_law": 1, **OSCILLATOR}
CHAOS_STRIP = {"chaos_strip": 1, "expansion_strip": 1, **FRICTION}
CONTACT = {**SQUARE, **STRIP, **CHAOS_SQUARE, **CHAOS_STRIP}
ALL = {**SURFACE, **CONTACT}

# Modules of src/roughslip that get a line which acts, and what that re-runs; of all stages test_closure.py tells
MODULES = {
    "figures": {**FIGURES, **COSTS},
    "surface/karhunen_loeve": {**SURFACE, **SQUARE, **CHAOS_SQUARE, **CLAIMS},
    "surface/covariance_fit": {},
    "contact/solve": CONTACT,
}

# Edits of the scene and of what else decides: file, old, new, and what that re-runs.
SCENE = "config/scenes/tiny.yaml"
EDITS = {
    "damping list": (SCENE, "[0.17, 0.34]", "[0.17, 0.30]", OSCILLATOR),
    "seed": (SCENE, "square:", "seed: 1\nsquare:", {**DESIGN, **CONTACT}),
    "draws": (SCENE, "draws: 2000", "draws: 3000", {**CHAOS_SQUARE, **CLAIMS}),
    "smaller batches": (SCENE, "realisations: 8}", "realisations: 4}", {**CYCLES, "oscillator": 2}),
    "share": (SCENE, "modes: 64", "variance_share: 0.2", {**SURFACE, **SQUARE, **CHAOS_SQUARE, **CLAIMS}),
    "law of heights": (
        SCENE,
        "square:",
        "roughness: {marginal: {family: beta, shapes: [2.1, 5]}}\nsquare:",
        {**SURFACE, **CONTACT},
    ),
    "description": (SCENE, "Every stage", "Each stage", {**FIGURES, **CLAIMS}),
    "fewer targets": (SCENE, "square:", "targets: [figure2, figure3]\nsquare:", CLAIMS),
    "locked package": ("requirements.lock", "\nnumpy==", "\nnumpy==99.", ALL),
    "shell line": ("workflow/rules/outputs.smk", '+ ".cycles ', '+ ".cycles  ', CYCLES),
}

# The square alone, its training solves found while running.
FOUND = """\
extends: tiny
description: "Training solves found while running"
targets: [figure2]
expansion: {samples: auto, cdf_error: 0.1, design: sobol}
"""
FOUND_END = {"chaos_square": 1, "figure2": 1, "claims": 1, "costs": 1, "scene_report": 1, "found": 1}
FOUND_EDITS = {
    ("cdf_error: 0.1", "cdf_error: 0.09"): {"training_square": 1, **FOUND_END},
    ("sobol", "monte_carlo"): {"design": 1, "contact_square": 2, "training_square": 1, **FOUND_END},
    ("sobol", "sobol, draws: 3000"): FOUND_END,
}

# Edits that act on nothing.
COMMENTS = (
    (SCENE, "samples: 8\n", "samples: 8  # few\n"),
    (SCENE, "[30, 50]", "[30.0, 50]"),
    ("src/roughslip/scene/square.py", "at_most=1024", "at_most=2048"),
    ("requirements.lock", "\nnumpy==", "\n# arrays\nnumpy=="),
    ("Snakefile", "rule all:", "# By default:\nrule all:"),
    ("workflow/keys/key_files.py", "def write_key", "# Written for each stage.\ndef write_key"),
)


def act(project, edit: str) -> None:
    """Apply an edit by its name."""
    if edit in MODULES:
        with project.path(f"src/roughslip/{edit}.py").open("a") as file:
            file.write("\n_EDITED = 1\n")
    else:
        project.edit(*EDITS[edit][:3])


@pytest.fixture(scope="module")
def plans(finished, tmp_path_factory):
    """Dry runs after each edit, two at a time because each is a second of Snakemake's start."""

    def plan(edit: str) -> dict[str, int]:
        folder = tmp_path_factory.mktemp("edit") / "copy"
        project = finished.copy(folder, "tiny")
        act(project, edit)
        jobs = project.plan("tiny")
        shutil.rmtree(folder)
        return jobs

    with ThreadPoolExecutor(2) as pool:
        yield {edit: pool.submit(plan, edit) for edit in (*MODULES, *EDITS)}


@pytest.mark.parametrize("edit", [*MODULES, *EDITS])
def test_an_edit_reruns_what_it_acts_on(plans: dict[str, Future], edit):
    assert plans[edit].result() == (MODULES[edit] if edit in MODULES else EDITS[edit][3])


def test_solves_found_while_running_rerun_by_what_they_read(finished, tmp_path):
    project = finished.copy(tmp_path / "copy", "tiny")
    project.scene("found", FOUND)
    project.make("-j2", "found")
    assert project.plan("found") == {}
    for (old, new), jobs in FOUND_EDITS.items():
        project.edit("config/scenes/found.yaml", old, new)
        assert project.plan("found") == jobs
        project.edit("config/scenes/found.yaml", new, old)
    assert project.plan("found") == {}


@pytest.mark.parametrize(("record", "jobs"), [("costs", COSTS), ("report", REPORT), ("claims", CLAIMS)])
def test_a_damaged_record_of_cost_runs_its_job_again(project, record, jobs):
    """Also those of the last jobs, which no other job reads; the time of the file does not tell."""
    file = project.path(f"results/tiny/usage/{record}.json")
    before = file.stat()
    file.write_text("")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert project.plan("tiny") == jobs


def test_a_second_run_has_nothing_to_do(project):
    run = project.snakemake("-j2", "tiny")
    assert run.returncode == 0
    assert "Nothing to be done" in run.stdout + run.stderr


def test_comments_and_docstrings_rerun_nothing(project):
    for edit in COMMENTS:
        project.edit(*edit)
    modules = list(project.path("src").rglob("*.py"))
    for module in modules:
        text = module.read_text()
        assert text.startswith('"""')
        module.write_text(text.replace('"""', '"""Edited: ', 1) + "\n\n# the end\n")
    assert len(modules) > 40
    assert project.plan("tiny") == {}


def test_touching_everything_reruns_nothing(project):
    """Inputs are made newer than what was made from them: time stamps run against the order of making."""
    files = sorted(
        (path for path in project.folder.rglob("*") if path.is_file()), key=lambda path: path.stat().st_mtime
    )
    for age, file in enumerate(files):
        if ".snakemake" not in file.parts:
            os.utime(file, (1.7e9 - age, 1.7e9 - age))
    assert project.plan("tiny") == {}


def test_a_tree_that_moved_without_its_records_reruns_by_its_key_files(project):
    shutil.rmtree(project.path(".snakemake"))
    assert project.plan("tiny") == {}
    act(project, "damping list")
    act(project, "surface/karhunen_loeve")
    assert project.plan("tiny") == {**MODULES["surface/karhunen_loeve"], **OSCILLATOR}


def test_an_edit_taken_back_reruns_nothing(project):
    """Dry runs write key files too; the one of the edit must not outlive it."""
    act(project, "damping list")
    assert project.plan("tiny") == OSCILLATOR
    project.edit(SCENE, "[0.17, 0.30]", "[0.17, 0.34]")
    assert project.plan("tiny") == {}
