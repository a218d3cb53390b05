"""A user's mistakes end before any job, one line each; a damaged result is named with the command that rebuilds it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from roughslip.errors import InputError
from workflow.study.scenes import Scenes, not_writable

PROJECT = Path(__file__).resolve().parents[2]

# One mistake of every kind: in a key, a unit, a type, a range, a combination, YAML's floats, a missing key, overlays.
BROKEN = """\
extends: tiny
description: Broken
material:
  young_modulus_gpa: 210
roughness:
  rms_height_m: -1.0e-7
  correlation_length_m: 1e-6
square:
  nodes: ten
  penetration: 50
strip:
  window_spacing_m: 6.2e-5
expansion:
  samples: 5000000
oscillator:
  stochastic_static_limit: perhaps
ensemble:
  damping_ratios: [0.3, 0.2]
  discarded_periods: 40
batches: [8]
"""
SAID = [
    "batches: [8] is not allowed; a group of the keys square_samples, strip_samples, expansion_samples, realisations",
    "ensemble.damping_ratios: [0.3, 0.2] is not allowed; strictly increasing damping ratios",
    "ensemble.discarded_periods: 40 is not allowed; less than ensemble.duration_periods = 20",
    "expansion.samples: 5000000 is not allowed; a whole number >= 10 and <= 1000000, or auto",
    "material.young_modulus_gpa: unknown key; did you mean young_modulus_pa? allowed: young_modulus_pa, poisson_ratio",
    "oscillator.stochastic_static_limit: 'perhaps' is not allowed; true or false",
    "roughness.correlation_length_m: '1e-6' is text, not a number; write 1.0e-6, a number > 0 and <= 1 [m]",
    "roughness.rms_height_m: -1e-07 is not allowed; a number > 0 and <= 0.01 [m]",
    "square.nodes: 'ten' is text, not a number; a whole number >= 2 and <= 1024",
    "square.penetration: unknown key; did you mean penetration_percentile?",
    "strip.window_spacing_m: 6.2e-05 is not allowed; a whole multiple of strip.cell_m = 5e-06 [m]",
]
PROFILE = "Using workflow specific profile "  # what Snakemake says first

CONFIGURATIONS = {
    "scenes: [tiny, tny, tiny]\nscene: tiny\n": [
        "scene: unknown key; allowed: scenes",
        "scenes[1]: 'tny' is not allowed; each once, one of: ",
        "scenes[2]: 'tiny' is not allowed; each once, one of: ",
    ],
    "scenes: tiny\n": ["scenes: 'tiny' is not allowed; a list of scenes, each once, of: "],
    "scene: [tiny]\n": ["scene: unknown key; allowed: scenes", "scenes: missing; a list of scenes, each once, of: "],
    "scenes: []\n": ["scenes: [] is not allowed; a list of scenes, each once, of: "],
    "scenes: [{tiny: 1}]\n": ["scenes[0]: a group of keys is not allowed; each once, one of: "],
    "scenes: &all [tiny]\n": ["scenes: &all is not allowed; write the value out (no anchor, alias or tag)"],
    "scenes: [tiny\n": ["line 2, column 1: not valid YAML: "],
    "": ["empty; "],
}


@pytest.fixture
def fresh(empty, tmp_path):
    """A project without results."""
    return empty.copy(tmp_path / "copy")


def refused(project, *arguments: str) -> list[str]:
    """The lines on stderr of a run that must end before it makes anything."""
    run = project.snakemake(*arguments)
    assert run.returncode == 1
    assert run.stdout == ""
    assert not project.path("results").exists()
    return [line for line in run.stderr.splitlines() if not line.startswith(PROFILE)]


def test_every_mistake_of_a_scene_is_one_line_before_any_job(fresh):
    fresh.scene("broken", BROKEN)
    lines = refused(fresh, "-j1", "broken")
    assert all(line.startswith("config/scenes/broken.yaml: ") for line in lines)
    said = sorted(line.removeprefix("config/scenes/broken.yaml: ") for line in lines)
    assert [line[: len(start)] for line, start in zip(said, SAID, strict=True)] == SAID


@pytest.mark.slow
def test_mistakes_of_the_configuration_are_lines_too(fresh):
    """The command line shows them as those of a scene; the rest asks the class that it calls."""
    (text, said), *_ = CONFIGURATIONS.items()
    fresh.path("config/config.yaml").write_text(text)
    lines = refused(fresh, "-j1", "tiny")
    assert [line[: len(f"config/config.yaml: {start}")] for line, start in zip(lines, said, strict=True)] == [
        f"config/config.yaml: {start}" for start in said
    ]


@pytest.mark.parametrize("text", CONFIGURATIONS)
def test_each_mistake_of_the_configuration_has_its_line(fresh, monkeypatch, text):
    monkeypatch.chdir(fresh.folder)
    fresh.path("config/config.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        Scenes(fresh.folder, ["tiny"])
    said = [f"config/config.yaml: {start}" for start in CONFIGURATIONS[text]]
    assert [line[: len(start)] for line, start in zip(caught.value.lines, said, strict=True)] == said


def test_default_scenes_count_as_asked_for_beside_others(fresh, monkeypatch):
    monkeypatch.chdir(fresh.folder)
    fresh.path("config/config.yaml").write_text("scenes: [broken]\n")
    fresh.scene("broken", BROKEN)
    assert "broken" not in Scenes(fresh.folder, ["-j2", "tiny"]).valid
    for words in (["-j2"], ["tiny", "all"], ["tiny", "results/report.html"], ["results/broken/figure2.png"]):
        with pytest.raises(InputError):
            Scenes(fresh.folder, words)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damaged", "damage", "said"),
    [
        (
            "chaos/square.nc",
            lambda path: path.write_bytes(path.read_bytes()[:5000]),
            "not what its job wrote; set aside as square.nc.damaged, and made again",
        ),
        ("usage/surface.json", lambda path: path.write_text("{"), "damaged; its job runs again"),
    ],
)
def test_a_damaged_result_is_named_and_made_again(project, damaged, damage, said):
    """By the next run of its scene, from the same bits to the same bits."""
    name = f"results/tiny/{damaged}"
    whole = project.path(name).read_bytes()
    damage(project.path(name))
    run = project.snakemake("-j1", "tiny")
    assert run.returncode == 0, run.stdout[-5000:] + run.stderr
    assert f"{name}: {said}" in run.stderr.splitlines()
    if name.endswith(".nc"):
        assert project.path(name).read_bytes() == whole
    else:  # seconds differ
        assert json.loads(project.path(name).read_text())["stage"] == json.loads(whole)["stage"]


@pytest.mark.slow
def test_a_result_that_got_lost_is_made_again(project):
    for name in ("figure2.svg", "figure3.nc"):
        project.path(f"results/tiny/{name}").unlink()
    assert project.plan("tiny") == {"figure2": 1, "figure3": 1, "costs": 1, "scene_report": 1, "tiny": 1}
    project.path("results/tiny/summary.csv").unlink()
    assert "friction" in project.plan("tiny")
    project.path("results/tiny/surface/modes.nc").unlink()  # the report reads it
    assert "surface" in project.plan("tiny")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["missing", "truncated"])
def test_a_stage_run_by_hand_names_what_it_cannot_read(project, kind):
    name = "results/tiny/friction/statistics.nc"
    file = project.path(name)
    file.unlink() if kind == "missing" else file.write_bytes(file.read_bytes()[:1000])
    arguments = ["--key", "results/tiny/keys/figure3.json", "--result", name, "--output", "a.nc", "--usage", "a.json"]
    run = project.python("roughslip.stages.figure3", *arguments, "--png", "a.png", "--svg", "a.svg")
    assert run.returncode == 1
    (line,) = run.stderr.splitlines()
    assert line.startswith(f"figure3: {name}: {kind}")
    assert line.endswith(f"rebuild it with: rm -f {name} && snakemake -j2 {name}")
    assert not list(project.folder.glob("*a.*"))


def test_a_file_where_results_should_go_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("results").mkdir()
    Path("results/smoke").write_text("in the way")
    with pytest.raises(InputError) as caught:
        Scenes(PROJECT, words=["smoke"])
    assert caught.value.lines == (f"{Path('results/smoke')}: cannot be written to",)
    assert Scenes(PROJECT, words=["given"]).valid


def test_a_link_that_leads_nowhere_is_named(tmp_path, monkeypatch):
    """Of results that lay on a disk that is gone, or of a folder of a scene that is a file."""
    monkeypatch.chdir(tmp_path)
    Path("results").symlink_to(tmp_path / "gone")
    assert not_writable("smoke") == [Path("results")]
    Path("results").unlink()
    Path("results/smoke").mkdir(parents=True)
    Path("results/smoke/keys").write_text("in the way")
    assert not_writable("smoke") == [Path("results/smoke/keys")]


def test_a_key_file_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("results/smoke/keys/surface.json").mkdir(parents=True)
    scenes = Scenes(PROJECT, words=["smoke"])
    with pytest.raises(InputError, match=r"^results/smoke/keys: cannot be written to \("):
        scenes.write_keys()


@pytest.mark.slow
def test_numbers_of_the_command_line_are_checked_before_any_job(fresh):
    lines = refused(fresh, "-n", "tiny", "--config", "memory_mb=abc", "reference_strips=0")
    assert lines == [
        "--config memory_mb: 'abc' is not allowed; a whole number from 1",
        "--config reference_strips: 0 is not allowed; a whole number from 1",
    ]


@pytest.mark.slow
def test_results_put_back_from_a_copy_are_not_taken_for_those_of_the_scene_of_now(project):
    """Snakemake, which compares a key with that of its own last run, would find nothing to be done."""
    target = "results/tiny/surface/modes.nc"
    shutil.copytree(project.path("results/tiny"), project.path("copy"))
    project.edit("config/scenes/tiny.yaml", "modes: 64", "modes: 63")
    project.make("-j1", target)
    shutil.rmtree(project.path("results/tiny"))
    project.path("copy").rename(project.path("results/tiny"))
    assert project.plan(target) == {"surface": 1}
    assert project.plan(target) == {"surface": 1}


@pytest.mark.slow
def test_a_flipped_bit_in_what_snakemake_recorded_ends_no_run(project):
    file = next(path for path in sorted(project.path(".snakemake/metadata").iterdir()) if path.is_file())
    content = bytearray(file.read_bytes())
    content[20] ^= 0x80
    file.write_bytes(content)
    assert project.plan("tiny") == {}
    assert not file.exists()
