"""Names of results: what changes them, what does not, what is hashed of code and packages, and which scenes share."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path

import pytest

from roughslip.errors import InputError
from workflow.keys import Names, code_hash, departures, report
from workflow.study.scenes import Scenes
from workflow.study.unused import unused

# Snakemake runs in this process, and its warnings are its own.
pytestmark = pytest.mark.filterwarnings("default")

OF_OSCILLATOR = {"deterministic", "oscillator", "cycles", "belt_readings"}
OF_FIGURE5 = OF_OSCILLATOR - {"belt_readings"}
OF_POINT = {"answer", "stick_slip_map"}  # which read the oscillator and not the list of damping ratios
OF_STRIP = {"contact_strip", "chaos_strip", "expansion_strip", "friction"}
OF_WINDOWS = {"friction", "wide_field"}
OF_SQUARE = {"design", "contact_square", "chaos_square"}  # without karhunen_loeve, which draws nothing
FRICTION = OF_STRIP | OF_WINDOWS | OF_OSCILLATOR | OF_POINT
OWN = {"figure5": 1, "figure_chain": 1, "claims": 1, "costs": 1, "scene_report": 1, "publish": 1}
MADE_OF_MORE = {"claims", "costs", "report"}  # of all that a scene makes


def names_of(folder: Path, *words: str) -> Names:
    return Names(Scenes(folder, [*words]), folder, writes=False)


# Of each overlay on `tiny` the stages that have another name.
OVERLAYS = {
    "oscillator: {damping_ratio: 0.2}": OF_OSCILLATOR | OF_POINT,
    "ensemble: {damping_ratios: [0.17, 0.3]}": OF_OSCILLATOR,
    "jobs: 2": FRICTION | OF_SQUARE - {"design"},  # other files
    "expansion: {draws: 3000}": {"chaos_square"},
    "strip: {expansion_samples: 24}": {"expansion_strip"} | OF_WINDOWS | OF_OSCILLATOR | OF_POINT,
    "friction: {mean_at_median: 0.2}": OF_WINDOWS | OF_OSCILLATOR | OF_POINT,
    "material: {young_modulus_pa: 1.0e+9}": FRICTION | OF_SQUARE - {"design"},
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
    oscillator = dict.fromkeys(OF_FIGURE5 | {"answer"}, 1) | OWN
    assert plan(shared.folder, "variant") == {"variant": oscillator}
    shared.scene("new", "extends: variant\ntargets: [figure5]\nseed: 7\n")
    shared.scene("newer", "extends: new\ntargets: [figure5]\noscillator: {damping_ratio: 0.3}\n")
    assert plan(shared.folder, "newer", "new") == {
        "new": dict.fromkeys(OF_STRIP, 1) | oscillator,
        "newer": oscillator,
    }


@pytest.mark.slow
def test_a_sweep_solves_a_contact_problem_once(shared, plan):
    """Four variants of two materials, each solved once. The scene itself shares all up to its answer with `tiny`."""
    sweep = "sweep: {oscillator.damping_ratio: [0.1, 0.2], material.hardness_pa: [2.0e+9, 3.0e+9]}"
    shared.scene("mine", f"extends: tiny\ntargets: [figure5]\n{sweep}\n")
    planned = plan(shared.folder, "mine")
    own = dict.fromkeys(OF_FIGURE5 | {"answer"}, 1) | OWN
    assert planned.pop("mine") == {"sweep": 1, **{stage: 1 for stage in OWN if stage != "figure_chain"}}
    solved = [name for name, jobs in planned.items() if "contact_strip" in jobs]
    assert len(solved) == 2
    assert planned == {
        f"mine-{number}": (dict.fromkeys(OF_STRIP, 1) if f"mine-{number}" in solved else {}) | own
        for number in range(1, 5)
    }


def test_only_results_of_no_scene_are_unused(empty, tmp_path, monkeypatch):
    """While a scene has a mistake nothing is removed, because what it names is not known."""
    project = empty.copy(tmp_path / "copy")
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
    ("lock", "found"),
    [
        (f"# made by hand==1\nnumpy=={NUMPY}{HASH}", ()),
        (f"numpy==1.0.0{HASH}", (f"numpy {NUMPY} in place of 1.0.0",)),
        (f"no-such-package==3.1{HASH}", ("no-such-package missing in place of 3.1",)),
        (f"colorama==9.9 ; sys_platform == 'win32' or python_version < '3.0'{HASH}", ()),
    ],
)
def test_packages_that_differ_from_the_lock_are_reported(lock, found):
    assert departures(lock) == found
    assert [line.startswith(f"requirements.lock: installed are {', '.join(found)}; ") for line in report(lock)] == [
        True
    ] * len(found)


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
    assert stored["before"]["contact_strip"] in stored["inputs"]["contact"][0]
    assert names_of(project.folder).at(entry.folder) == entry
    with pytest.raises(InputError, match="no key file"):
        names.at("results/store/friction/0123456789abcdef")
