"""What a dry run plans: the stages of a scene, the jobs that an edit repeats, and random scenes.

Memory of jobs: what a stage declares holds what was measured, and grows at each attempt.

Names of results: what changes them, what does not, what is hashed of code and packages, and which scenes share.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from importlib.metadata import version
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, Phase, given, settings

from roughslip.errors import InputError
from roughslip.scene.declarations import declarations
from tests.scene.shipped import SCENES, overlays
from workflow.keys import Names, code_hash, departures, report
from workflow.study.commands import NODE_MB, asked_mb, machine_mb
from workflow.study.scenes import Scenes, checked
from workflow.study.unused import unused

ROOT = Path(__file__).resolve().parents[2]

# Snakemake runs in this process, and its warnings are its own.
pytestmark = pytest.mark.filterwarnings("default")


# One job a batched stage, three for the designs of the square.
END = {"claims": 1, "costs": 1, "scene_report": 1, "publish": 1}
SQUARE = {"karhunen_loeve": 1, "contact_square": 3, "chaos_square": 1, "figure2": 1, "figure2_traps": 1}
STRIP = {"contact": 1, "chaos_strip": 1, "expansion_strip": 1, "friction": 1}
FIGURE3 = {"figure3": 1, "figure3_law": 1}
FIGURE5 = {"deterministic": 1, "oscillator": 1, "cycles": 1, "figure5": 1}
OSCILLATOR = {"answer": 1, **FIGURE5}
CHAIN = {"figure_chain": 1}
MAP = {"answer": 1, "stick_slip_map": 1, "figure_map": 1}
SCAN = {"scan": 1, "synthetic_surfaces": 1, "figure_scan": 1}
STATISTICS = "{mean: 0.3, standard_deviation: 0.05, correlation_length_m: 2.5e-4}"
GIVEN = f"friction: {{statistics: {STATISTICS}}}"
GROUND = "roughness: {scan: {file: config/scans/ground.nc, form: plane, covariance: best, marginal: gaussian}}"
STAGES = {
    "targets: [figure2]": SQUARE,
    "targets: [figure3]": {**STRIP, **FIGURE3},
    "targets: [figure5]": {**STRIP, **OSCILLATOR, **CHAIN},
    "targets: [figure2, figure3]": {**SQUARE, **STRIP, **FIGURE3},
    f"targets: [figure5, figure_map]\n{GIVEN}": {**OSCILLATOR, **MAP},
    "targets: [figure_map]": {**STRIP, **MAP},
    f"targets: [figure2, figure_scan]\n{GROUND}": {**SQUARE, **SCAN},
    f"targets: [figure5]\n{GIVEN}\n{GROUND}": OSCILLATOR,
    f"targets: [answer]\n{GIVEN}": {"answer": 1},
}


@pytest.mark.slow
def test_a_scene_runs_the_stages_that_its_targets_need(empty, tmp_path, plan):
    """All scenes in one dry run. A result is a target too, and a dry run writes nothing."""
    project = empty.copy(tmp_path / "copy")
    names = [f"mine{number}" for number in range(len(STAGES))]
    for number, (name, text) in enumerate(zip(names, STAGES, strict=True)):  # no two alike, which share
        unlike = f"seed: {number}\nsquare: {{modes: {63 - number}}}\noscillator: {{mass_kg: 1.0{number:02}}}"
        project.scene(name, f"extends: tiny\n{unlike}\n{text}\n")
    planned = plan(project.folder, *names, "results/given/figure5.png", "results/tiny/contact/blocks-0-8.nc")
    assert planned.pop("given") == {**FIGURE5, "oscillator": 2, "one_file": 1}
    assert planned.pop("tiny") == {"contact": 1, "one_file": 1}
    assert planned == {name: {**stages, **END} for name, stages in zip(names, STAGES.values(), strict=True)}
    assert not project.path("results").exists()


# Jobs that an edit repeats. The report shows figures, verdicts and costs, so it ends each list.
REPORT = {"scene_report": 1, "publish": 1}
COSTS = {"costs": 1, **REPORT}
CLAIMS = {"claims": 1, **COSTS}
CYCLES = {"cycles": 1, "figure5": 1, **CHAIN, **CLAIMS}
AFTER_DAMPINGS = {"deterministic": 1, "oscillator": 1, **CYCLES}
MAPPED = {"stick_slip_map": 1, "figure_map": 1}  # a scene that names no targets has the map with figure5
AFTER_FRICTION = {"answer": 1, **MAPPED, **AFTER_DAMPINGS}
AFTER_SQUARE = {"chaos_square": 1, "figure2": 1, "figure2_traps": 1}
CONTACT = {"contact_square": 3, **AFTER_SQUARE, **STRIP, **FIGURE3, **AFTER_FRICTION}
SURFACE = {"karhunen_loeve": 1, "contact_square": 3, **AFTER_SQUARE, **CLAIMS}
DRAWN = {"figure2": 1, "figure2_traps": 1, **FIGURE3, "figure5": 1, **CHAIN, "figure_map": 1}
SCENE = "config/scenes/tiny.yaml"
MARGINAL = "roughness: {beta_shapes: [2.1, 5]}\nsquare:"
ACTS = ("\n\n\n", "\n\n_EDITED = 1\n\n\n")
EDITS = [
    (SCENE, "[0.17, 0.34]", "[0.17, 0.30]", AFTER_DAMPINGS),
    (SCENE, "square:", "seed: 1\nsquare:", {**CONTACT}),
    (SCENE, "modes: 64", "modes: 63", SURFACE),
    (SCENE, "square:", MARGINAL, {"karhunen_loeve": 1, **CONTACT}),
    (SCENE, "Every stage", "Each stage", {**DRAWN, **CLAIMS}),
    (SCENE, "square:", "targets: [figure2, figure3]\nsquare:", CLAIMS),
    ("requirements.lock", "\nnumpy==", "\nnumpy==99.", {"karhunen_loeve": 1, **CONTACT}),
    ("src/roughslip/figures/style.py", *ACTS, {**DRAWN, **COSTS}),
    ("src/roughslip/figures/stick_slip.py", *ACTS, {"figure_map": 1, **COSTS}),
    ("src/roughslip/surface/modes.py", *ACTS, SURFACE),
    ("src/roughslip/contact/solve.py", *ACTS, CONTACT),
    ("src/roughslip/scan/covariance_fit.py", *ACTS, {}),
    (SCENE, "samples: 8\n", "samples: 8  # few\n", {}),
    (SCENE, "[30, 50]", "[30.0, 50]", {}),
    ("src/roughslip/scene/contact.py", "ge=2, le=1024", "ge=2, le=2048", {}),
    ("src/roughslip/contact/solve.py", '"""', '"""Edited: ', {}),
    ("src/roughslip/stages/friction.py", "memory_mb=620", "memory_mb=630", {}),
    ("requirements.lock", "\nnumpy==", "\n# arrays\nnumpy==", {}),
    ("Snakefile", "rule all:", "# By default:\nrule all:", {}),
]  # fmt: skip


def state(folder: Path) -> dict[str, tuple[int, bytes]]:
    """Time and content of all files of a project, without Snakemake's folder and Python's caches."""
    files = [path for path in folder.rglob("*") if not {".snakemake", "__pycache__"} & set(path.parts)]
    return {str(path): (path.stat().st_mtime_ns, path.read_bytes()) for path in files if path.is_file()}


@pytest.mark.slow
def test_an_edit_repeats_the_jobs_that_depend_on_it(project, plan):
    """Each edit is planned and taken back, all by dry runs, which change no file."""
    before = state(project.folder)
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
    assert state(project.folder) == before


CASES = int(os.environ.get("SCENE_CASES", "100"))
TOGETHER = 50  # scenes in one graph: starting Snakemake costs more than planning a scene


def random_scenes(folder: Path, count: int) -> list[str]:
    """Write random scenes into the folder and return the names of those that are accepted."""
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
            checked(name, folder, folder.parents[1])
            names.append(name)
        except InputError:
            file.unlink()

    write()
    return names


def refused(folder: Path, names: list[str]) -> dict[str, str]:
    """Scenes that no surface or load fits, with the line that says so."""
    try:
        Scenes(folder, names)
    except InputError as error:
        return {Path(line.partition(": ")[0]).stem: line for line in error.lines}
    return {}


@pytest.mark.slow
def test_each_random_scene_that_is_accepted_is_planned(empty, tmp_path, plan):
    """Those that no surface or load fits are named first, in one line each."""
    project = empty.copy(tmp_path / "copy")
    names = random_scenes(project.path("config/scenes"), CASES)
    misfits = refused(project.folder, names)
    assert all(re.search(r"(roughness|load)[.\w]* ?[:=]", line) for line in misfits.values())
    names = [name for name in names if name not in misfits]
    assert len(names) > CASES / 10
    for first in range(0, len(names), TOGETHER):
        some = names[first : first + TOGETHER]
        assert set(plan(project.folder, *some)) >= set(some)


MIB = 1.048576  # MB


@pytest.mark.parametrize("name", ["paper", "resolved"])
def test_stages_declare_a_tenth_more_than_the_kept_runs_took(name):
    for row in json.loads((ROOT / f"results/reference/{name}/costs.json").read_text()):
        if row["stage"] in declarations():
            assert 1.1 * MIB * row["peak_memory_mib"] < declarations()[row["stage"]].memory_mb, row["stage"]


def test_a_job_of_a_cluster_asks_for_more_at_each_attempt_and_never_for_more_than_a_node_has():
    """The second attempt holds the peak of contact_square on 1024 x 1024 nodes in 95 modes, 1812 MB."""
    once = declarations()["contact_square"].memory_mb + NODE_MB
    assert [asked_mb("contact_square", attempt, 4000) for attempt in (1, 2, 3)] == [once, 4 * once, 4000]
    assert [asked_mb("contact_square", attempt, 32_000) for attempt in (1, 2, 3)] == [once, 4 * once, 16 * once]
    assert 4 * once > 1812
    assert asked_mb("contact_square", 1, None) == once - NODE_MB
    assert 500 < machine_mb() < 10_000_000


# Snakemake runs in this process, and its warnings are its own.

OF_OSCILLATOR = {"deterministic", "oscillator", "cycles"}
OF_POINT = {"answer", "stick_slip_map"}  # which read the oscillator and not the list of damping ratios
OF_STRIP = {"contact", "chaos_strip", "expansion_strip", "friction"}
OF_SQUARE = {"contact_square", "chaos_square"}  # without karhunen_loeve, which draws nothing
FRICTION = OF_STRIP | OF_OSCILLATOR | OF_POINT
OWN = {"figure5": 1, "figure_chain": 1, "claims": 1, "costs": 1, "scene_report": 1, "publish": 1}
MADE_OF_MORE = {"claims", "costs", "report"}  # of all that a scene makes


def names_of(folder: Path, *words: str) -> Names:
    return Names(Scenes(folder, [*words]), folder, writes=False)


# Of each overlay on `tiny` the stages that have another name.
OVERLAYS = {
    "oscillator: {damping_ratio: 0.2}": OF_OSCILLATOR | OF_POINT,
    "ensemble: {damping_ratios: [0.17, 0.3]}": OF_OSCILLATOR,
    "jobs: 2": FRICTION | OF_SQUARE,  # other files
    "strip: {expansion_samples: 24}": {"expansion_strip"} | {"friction"} | OF_OSCILLATOR | OF_POINT,
    "friction: {mean: 0.2}": {"friction"} | OF_OSCILLATOR | OF_POINT,
    "material: {young_modulus_pa: 1.0e+9}": FRICTION | OF_SQUARE,
    "seed: 7": FRICTION | OF_SQUARE,
    "description: Another": set(),
}


def test_names_differ_from_the_first_change_on(empty, tmp_path):
    """A stage has a new name where its own part changed, or that of any stage before it; all others are shared. In
    another order keys of a scene are the same."""
    project = empty.copy(tmp_path / "copy")
    variants = {f"variant-of-{number}": overlay for number, overlay in enumerate(OVERLAYS)}
    for name, overlay in variants.items():
        project.scene(name, f"extends: tiny\n{overlay}\n")
    project.scene("one", "extends: tiny\noscillator: {mass_kg: 1.5, damping_ratio: 0.2}\nseed: 3\n")
    project.scene("other", "seed: 3\noscillator: {damping_ratio: 0.20, mass_kg: 1.5}\nextends: tiny\n")
    names = names_of(project.folder, "tiny", *variants, "one", "other")
    stages = [stage for stage in names.scenes.stages("tiny") if "figure" not in stage]
    for name, overlay in variants.items():
        changed = {stage for stage in stages if names.entry("tiny", stage).key != names.entry(name, stage).key}
        assert changed - MADE_OF_MORE == OVERLAYS[overlay], overlay
    assert names.entry("one", "deterministic") == names.entry("other", "deterministic")


@pytest.mark.slow
def test_scenes_share_what_has_one_name(shared, plan):
    """From disk, and in a run of several new scenes, of which the first computes for all."""
    shared.scene("variant", "extends: tiny\ntargets: [figure5]\noscillator: {damping_ratio: 0.2}\n")
    oscillator = dict.fromkeys(OF_OSCILLATOR | {"answer"}, 1) | OWN
    assert plan(shared.folder, "variant") == {"variant": oscillator}
    shared.scene("new", "extends: variant\ntargets: [figure5]\nseed: 7\n")
    shared.scene("newer", "extends: new\ntargets: [figure5]\noscillator: {damping_ratio: 0.3}\n")
    assert plan(shared.folder, "newer", "new") == {
        "new": dict.fromkeys(OF_STRIP, 1) | oscillator,
        "newer": oscillator,
    }


def test_only_results_of_no_scene_are_unused(empty, tmp_path, monkeypatch):
    """While a scene has a mistake nothing is removed, because what it names is not known."""
    project = empty.copy(tmp_path / "copy")
    for file in project.path("config/scenes").glob("*.yaml"):
        if file.stem not in ("paper", "tiny"):
            file.unlink()
    monkeypatch.chdir(project.folder)
    names = names_of(project.folder, "tiny")
    used = names.entry("tiny", "friction").folder
    for folder in (used, "results/store/friction/0123456789abcdef", "results/gone", "results/benchmarks"):
        Path(folder).mkdir(parents=True)
    assert {path.as_posix() for path in unused(names)} == {"results/gone", "results/store/friction/0123456789abcdef"}
    project.scene("wrong", "extends: nothing\n")
    with pytest.raises(InputError, match="nothing is removed while scenes have mistakes: wrong"):
        unused(names_of(project.folder))


@pytest.fixture
def source(tmp_path: Path) -> Path:
    (tmp_path / "stage.py").write_text("x = 1\n")
    (tmp_path / "lock").write_text("numpy==2.0\n")
    return tmp_path


@pytest.mark.parametrize(("name", "old", "new"), [("stage.py", "1", "2"), ("lock", "2.0", "2.1")])
def test_code_and_lock_change_the_hash_and_comments_do_not(source, name, old, new):
    before = code_hash("stage", source, source / "lock")
    (source / name).write_text((source / name).read_text() + "# comment\n")
    assert code_hash("stage", source, source / "lock") == before
    (source / name).write_text((source / name).read_text().replace(old, new))
    assert code_hash("stage", source, source / "lock") != before


NUMPY, HASH = version("numpy"), " \\\n    --hash=sha256:0\n    # via nothing==1\n"


@pytest.mark.parametrize(
    ("lock", "packages"),
    [
        (f"# made by hand==1\nnumpy=={NUMPY}{HASH}", ()),
        (f"numpy==1.0.0{HASH}", (f"numpy {NUMPY} in place of 1.0.0",)),
        (f"no-such-package==3.1{HASH}", ("no-such-package missing in place of 3.1",)),
        (f"colorama==9.9 ; sys_platform == 'win32' or python_version < '3.0'{HASH}", ()),
    ],
)
def test_packages_that_differ_from_the_lock_are_reported(lock, packages):
    assert departures(lock) == packages
    assert [line.startswith(f"requirements.lock: installed are {', '.join(packages)}; ") for line in report(lock)] == [
        True
    ] * len(packages)


def test_other_packages_change_the_hash_under_the_same_lock(source, monkeypatch):
    pinned = code_hash("stage", source, source / "lock")
    monkeypatch.setattr("workflow.keys.departures", lambda text: ("numpy 0.1 in place of 2",))
    assert code_hash("stage", source, source / "lock") != pinned


def test_a_key_file_says_what_was_hashed_and_is_written_whole(empty, tmp_path, monkeypatch):
    """In JSON, with the files that a job reads; NaN is refused."""
    project = empty.copy(tmp_path / "copy")
    monkeypatch.chdir(project.folder)
    names = Names(Scenes(project.folder, ["tiny"]), project.folder, writes=True)
    entry = names.entry("tiny", "friction")
    stored = json.loads(Path(entry.folder, "key.json").read_text())
    assert entry.made_of.items() <= stored.items()
    assert stored["before"]["contact"] in stored["inputs"]["blocks"][0]
    assert names_of(project.folder).at(entry.folder) == entry
    with pytest.raises(InputError, match="no key file"):
        names.at("results/store/friction/0123456789abcdef")
