"""Mistakes of the user end before any job, in one line each.

What the terminal shows of a run: one line of progress; of a job that fails, and of Ctrl-C: one line; and its end.
"""

from __future__ import annotations

import io
import json
import logging
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from snakemake.logging import ColorizingTextHandler, LogEvent

from roughslip.errors import InputError
from workflow.keys import Names
from workflow.study import terminal
from workflow.study.scenes import Scenes, check_config, check_targets, not_writable
from workflow.study.terminal import MOST_WARNINGS, closing_lines

ROOT = Path(__file__).resolve().parents[2]
PROFILE = ("Using workflow specific profile ", "Config file ")  # what Snakemake prints first

# One mistake of each kind: a key, a unit, a type, a range, a combination, a float without a point.
BROKEN = """\
extends: tiny
description: Broken
material: {young_modulus_gpa: 210}
roughness: {correlation_length_m: 1e-6}
square: {nodes: ten}
strip: {window_spacing_m: 6.2e-5}
numerics: {extrapolate_mesh: perhaps}
ensemble: {damping_ratios: [0.3, 0.2]}
"""
BROKEN_KEYS = [
    "ensemble.damping_ratios",
    "material.young_modulus_gpa",
    "numerics.extrapolate_mesh",
    "roughness.correlation_length_m",
    "square.nodes",
    "strip.window_spacing_m",
]


@pytest.mark.slow
def test_each_mistake_of_a_scene_is_one_line_before_any_job(empty, tmp_path):
    project = empty.copy(tmp_path / "copy")
    project.scene("broken", BROKEN)
    run = project.snakemake("-j1", "broken")
    assert (run.returncode, run.stdout) == (1, "")
    assert not project.path("results").exists()
    lines = [line.split(": ") for line in run.stderr.splitlines() if not line.startswith(PROFILE)]
    assert {line[0] for line in lines} == {"config/scenes/broken.yaml"}
    assert sorted(line[1] for line in lines) == BROKEN_KEYS


def test_files_with_mistakes_stop_no_other_scene(tmp_path, monkeypatch):
    """A file for each fourth kind of mistake: all other scenes are planned."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "config" / "scenes"
    shutil.copytree(ROOT / "config", tmp_path / "config")
    _, *mistakes = (ROOT / "tests" / "scene" / "mistakes.txt").read_text(encoding="utf-8").split("\n\n")
    for number, mistake in list(enumerate(mistakes))[::-4]:
        text = mistake.strip().split("\n->")[0]
        text = text if "extends:" in text else f"extends: paper\n{text}"
        (folder / f"broken{number}.yaml").write_text(text, encoding="utf-8")
    scenes = Scenes(tmp_path, ["quick"])
    shipped = {file.stem for file in (ROOT / "config" / "scenes").glob("*.yaml")}
    assert shipped <= set(scenes.valid)
    assert not [name for name in scenes.valid if name.startswith("broken")]
    for name in scenes.valid:
        assert scenes.stages(name)
    with pytest.raises(InputError, match="broken"):
        Scenes(tmp_path, [f"broken{len(mistakes) - 1}"])


@pytest.mark.parametrize(
    ("config", "lines"),
    [
        ({"scenes": ["papr", "paper", "paper"]}, ["scenes: 'papr' is no scene; did you", "scenes: 'paper' is given"]),
        ({"scene": "paper"}, ["'scene': unknown key; did you mean scenes?", "scenes: no value is not allowed"]),
        ({"scenes": []}, ["scenes: [] is not allowed; a list of scenes, of: paper, smoke"]),
        ({"scenes": "smoke", "memory_mb": "abc"}, ["memory_mb: 'abc' is not allowed; a whole number from 1000"]),
        ({"scenes": "smoke", "memory_mb": True}, ["memory_mb: true is not allowed"]),
        ({"scenes": "smoke", "memory_mb": 32}, ["memory_mb: 32 is not allowed"]),
    ],
)
def test_each_mistake_of_the_configuration_is_one_line(config, lines):
    with pytest.raises(InputError) as caught:
        check_config(config, ["paper", "smoke"])
    starts = [line[: len(f"config: {start}")] for line, start in zip(caught.value.lines, lines, strict=True)]
    assert starts == [f"config: {start}" for start in lines]


def test_a_misspelt_scene_gets_a_suggestion():
    for words in (["-n", "papr"], ["-j2", "papr", "smoke"], ["results/papr/figure2.png"], ["--dry-run", "papr"]):
        with pytest.raises(InputError, match=r"is no target: no scene 'papr'; did you mean paper\? allowed: paper, sm"):
            check_targets(words, ["paper", "smoke"], {"all", "karhunen_loeve"})
    for words in (
        ["-j2", "smoke", "all", "--config", "scenes=papr"],
        ["--profile", "smoked"],
        ["results/smoke/figure2.png", "results/report.html", "results/reference/paper/x.nc"],
        ["--forcerun", "karhunen_loeve", "nothing_like_it"],
    ):
        check_targets(words, ["paper", "smoke"], {"all", "karhunen_loeve"})


def test_default_scenes_are_one_or_a_list_and_count_as_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert check_config({"scenes": "smoke"}, ["paper", "smoke"])["scenes"] == ["smoke"]
    assert check_config({"scenes": "smoke,paper"}, ["paper", "smoke"])["scenes"] == ["smoke", "paper"]
    options = check_config({"scenes": ["paper"], "memory_mb": 4000}, ["paper", "smoke"])
    assert (options["scenes"], options["memory_mb"]) == (["paper"], 4000)
    for words, asked in ((["-j2"], "given"), (["smoke", "all"], "given smoke"), (["results/smoke/a.png"], "smoke")):
        assert Scenes(ROOT, words, default=["given"]).asked == asked.split()


def test_mistakes_of_scans_come_with_those_of_scenes(tmp_path, monkeypatch):
    """A scan that is a plane and nothing else, one whose unit the scene does not state, none, and a wrong value."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "config/scenes"
    folder.mkdir(parents=True)
    for name in ("paper", "resolved"):
        (folder / f"{name}.yaml").write_bytes((ROOT / f"config/scenes/{name}.yaml").read_bytes())
    np.savetxt(folder / "plane.txt", 1e-3 * np.add.outer(np.arange(40.0), 2 * np.arange(40.0)))
    scan = "file: plane.txt, covariance: best, marginal: gaussian, form: plane"
    stated = "spacing_m: [1.0e-6, 1.0e-6], height_unit: um"
    for name, text in {
        "flat": f"roughness: {{scan: {{{scan}, {stated}}}}}",
        "bare": f"roughness: {{scan: {{{scan}}}}}",
        "gone": f"roughness: {{scan: {{{scan.replace('plane.txt', 'gone.al3d')}}}}}",
        "wrong": "seed: -1",
    }.items():
        whole = f"extends: resolved\ntargets: [figure3]\nstrip: {{cell_m: 1.25e-6}}\n{text}\n"
        (folder / f"{name}.yaml").write_text(whole)
    words = ["flat", "bare", "gone", "wrong"]
    with pytest.raises(InputError) as caught:
        Scenes(tmp_path, words, marks=tmp_path / "marks")
    bare, flat, gone, seed = sorted(caught.value.lines)
    assert seed.startswith("config/scenes/wrong.yaml: seed: -1 is not allowed")
    assert bare.startswith("config/scenes/bare.yaml: roughness.scan.file: config/scenes/plane.txt: ")
    assert gone == (
        "config/scenes/gone.yaml: roughness.scan.file: 'gone.al3d' is not there; "
        "a path from the folder of the scenes or of the project"
    )
    assert flat == (
        "config/scenes/flat.yaml: roughness.scan.form: nothing is left of the scan once its plane is removed: "
        "remove less, or scan a surface"
    )
    (folder / "flat.yaml").write_text((folder / "flat.yaml").read_text().replace("form: plane", "form: mean"))
    assert Scenes(tmp_path, ["flat"], marks=tmp_path / "marks").asked == ["flat"]


LAW = "class BoPavelescu:\n    pass\n\n\ndef falling(speed):\n    return 0.3\n"


MODEL = """import numpy as np

from roughslip.surface import Covariance


class Mine(Covariance):
    def profile(self, u):
        return (1 + u) * np.exp(-u)
"""


def test_a_law_and_a_covariance_of_the_user_are_part_of_the_name_of_a_result(tmp_path, monkeypatch):
    """The path is that from the folder of the scene; stages that do not read the key keep their names."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "config/scenes"
    shutil.copytree(ROOT / "config/scenes", folder)
    own = "oscillator: {law: my_laws.py:BoPavelescu}\nroughness: {covariance: my_models.py:Mine}\n"
    (folder / "mine.yaml").write_text(f"extends: quick\n{own}", encoding="utf-8")
    (folder / "my_models.py").write_text(MODEL, encoding="utf-8")

    def names():
        made = Names(Scenes(tmp_path, ["mine"]), ROOT, writes=False)
        assert made.scenes["mine"]["oscillator"]["law"] == "config/scenes/my_laws.py:BoPavelescu"
        return {stage: made.entry("mine", stage).made_of.get("own", {}).keys() for stage in ("contact", "answer")}, {
            stage: made.entry("mine", stage).key for stage in ("contact", "answer")
        }

    with pytest.raises(InputError, match=r"^config/scenes/mine.yaml: oscillator.law: 'my_laws.py' is not there"):
        Scenes(tmp_path, ["mine"])
    (folder / "my_laws.py").write_text(LAW.replace("BoPavelescu", "BoPavlescu"), encoding="utf-8")
    with pytest.raises(InputError, match=r"has no BoPavelescu; did you mean BoPavlescu\? it has BoPavlescu, falling$"):
        Scenes(tmp_path, ["mine"])
    (folder / "my_laws.py").write_text(LAW, encoding="utf-8")
    files, before = names()
    assert {stage: [*own] for stage, own in files.items()} == {
        "contact": ["config/scenes/my_models.py"],
        "answer": ["config/scenes/my_laws.py"],
    }
    (folder / "my_laws.py").write_text(f"{LAW}\n# edited\n", encoding="utf-8")
    after = names()[1]
    assert (after["contact"], after["answer"] == before["answer"]) == (before["contact"], False)


def test_a_scan_in_a_wrong_unit_is_warned_of_before_the_first_job(tmp_path, monkeypatch):
    """A wave of 0.05 µm on points 1 µm apart, 20 a period: differences have 2 sin(pi / 20) of its rms: slope 0.0111.

    A prefix more or less changes it by a thousand, to both sides of what is plausible. Read again from its mark.
    """
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "config/scenes"
    folder.mkdir(parents=True)
    (folder / "paper.yaml").write_bytes((ROOT / "config/scenes/paper.yaml").read_bytes())
    wave = 0.05 * np.cos(2 * np.pi * np.arange(41) / 20)
    np.savetxt(folder / "wave.txt", np.tile(wave, (41, 1)))
    units = ["um", "mm", "nm"]
    scan = "file: wave.txt, covariance: best, marginal: gaussian, form: mean, spacing_m: [1.0e-6, 1.0e-6]"
    for unit in units:
        text = f"extends: paper\ntargets: [figure3]\nroughness: {{scan: {{{scan}, height_unit: {unit}}}}}\n"
        (folder / f"{unit}.yaml").write_text(text)
    for _ in range(2):
        scenes = Scenes(tmp_path, units, marks=tmp_path / "marks")
        assert scenes.warnings("um") == []
        (steep,) = scenes.warnings("mm")
        (flat,) = scenes.warnings("nm")
        assert steep.startswith("rms slope 11.1 between neighbouring points of the scan is above 0.5, too steep")
        assert "scatter by 3.58e-05 m, and of their distance, 1e-06 m" in steep
        assert flat.startswith("rms slope 1.11e-05 between neighbouring points of the scan is below 0.001")


def test_a_file_in_place_of_a_folder_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("results/smoke/keys").mkdir(parents=True)
    Path("results/smoke/logs").write_text("in the way")
    with pytest.raises(InputError, match=r"^results/smoke/logs: cannot be written to$"):
        Scenes(ROOT, words=["smoke"])
    names = Names(Scenes(ROOT, words=["given"]), ROOT, writes=True)
    Path("results/store").mkdir()
    Path("results/store/cycles").write_text("in the way")
    with pytest.raises(InputError, match=r"^results/store/cycles/\w+: cannot be written to \("):
        names.entry("given", "cycles")
    Path("results").rename("elsewhere")
    Path("results").symlink_to(tmp_path / "gone")
    assert not_writable("smoke") == [Path("results")]


SNAKEFILE = """\
import sys
sys.path[:0] = [{root!r}, {root!r} + "/src"]
from workflow.study.terminal import show_own_errors

show_own_errors(lambda folder: folder)
rule broken:
    output: "results/a/made"
    log: "results/a/logs/broken.log"
    shell: "{command}"
"""
STATED = "echo 'broken: 3 of 4 after 1 s' > {log}; echo 'broken: error: load.area_m2 = 1: too large' >> {log}; exit 1"


@pytest.mark.slow  # Snakemake itself starts in two seconds
def test_an_error_is_one_line(tmp_path):
    said = output(tmp_path, STATED)
    after_the_job = said[next(i for i, line in enumerate(said) if "rule broken:" in line) :]
    shown = [line for line in after_the_job if not line.startswith((" ", "local", "rule", "Complete log", "Elapsed"))]
    assert [line for line in shown if line] == ["a: broken: load.area_m2 = 1: too large [results/a/logs/broken.log]"]
    assert "Error in rule broken" in logged(tmp_path)


@pytest.mark.slow
def test_ctrl_c_shows_no_error_of_the_job_that_it_ends(tmp_path):
    """What Snakemake itself prints of an interruption is its own, and depends on where it is met."""
    said = output(tmp_path, "sleep 1; kill -INT $PPID; sleep 1; exit 1")
    assert "Terminating processes on user request, this might take some time." in said
    assert "Error in rule broken:" not in said
    assert "Error in rule broken" in logged(tmp_path)


@pytest.mark.slow
def test_a_fault_of_the_code_is_shown_with_its_log(tmp_path):
    said = output(tmp_path, "echo 'ZeroDivisionError: x' > {log}; exit 1")
    assert "Error in rule broken:" in said
    assert "ZeroDivisionError: x" in said


def logged(folder: Path) -> str:
    (log,) = (folder / ".snakemake" / "log").glob("*.log")
    return log.read_text()


def output(folder: Path, command: str) -> list[str]:
    """What Snakemake prints of a job with that command, also where the tests themselves run without Ctrl-C."""
    (folder / "Snakefile").write_text(SNAKEFILE.format(root=str(ROOT), command=command))
    options = ["-j1", "--show-failed-logs", "--quiet", "host", "reason", "--nocolor"]
    run = subprocess.run(
        [sys.executable, "-m", "snakemake", *options],
        cwd=folder,
        capture_output=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert run.returncode == 1
    return (run.stdout + run.stderr).splitlines()


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_progress_is_one_line_with_the_time_to_go(monkeypatch, stream):
    """A job of stage `slow` weighs 9 s and one of `fast` 1 s: after one of each, in 5 s, 1 of 2 halves is done. Without
    a terminal there is a line a tenth at most. An error begins a line of its own."""
    now = [100.0]
    monkeypatch.setattr(terminal.time, "monotonic", lambda: now[0])
    handler = ColorizingTextHandler(nocolor=True, stream=stream())
    own = terminal.OwnErrors()
    own.progress = terminal.Progress(handler, {"slow": 9.0, "fast": 1.0})
    handler.setFormatter(own)
    handler.addFilter(own.filter)

    def say(text, level=logging.INFO, **extra):
        record = logging.makeLogRecord(
            {"msg": text, "levelno": level, "levelname": logging.getLevelName(level)} | extra
        )
        handler.handle(record)

    def finish(rule):
        say(f"Finished jobid: 3 (Rule: {rule})", event=LogEvent.JOB_FINISHED)
        say("", event=LogEvent.PROGRESS, done=0, total=0)

    say("Building DAG of jobs...")
    say("Job stats", event=LogEvent.RUN_INFO, stats={"slow": 2, "fast": 2, "total": 4})
    now[0] += 5.0
    finish("slow")
    finish("fast")
    say("disk is full", logging.ERROR)
    now[0] += 500.0
    finish("fast")
    finish("slow")
    say("Complete log(s): here")
    shown = handler.stream.getvalue()
    lines = [line.rpartition("\r\033[K")[2] for line in shown.rstrip().split("\n")]
    assert lines[-2:] == ["4 of 4 steps done", "Complete log(s): here"]
    halfway = ["2 of 4 steps done, about 5 s to go", "disk is full"]
    if stream is Terminal:
        assert lines[:-2] == halfway
        assert shown.count("\r") == 4
    else:
        assert lines[:-2] == ["1 of 4 steps done, about 6 s to go", *halfway]


def test_answer_and_warnings_of_each_scene_that_the_run_made(tmp_path):
    """At most MOST_WARNINGS, and the number of the others; only of scenes that the run published, with their pages.
    The answer of `a` is from older targets: its costs do not hold that stage."""
    for name, count in (("b", MOST_WARNINGS), ("a", MOST_WARNINGS + 2), ("c", 0), ("d", 1)):
        (tmp_path / "results" / name).mkdir(parents=True)
        rows = [{"stage": "answer" if name == "b" else "scan"}]
        rows += [{"stage": "all", "warnings": [f"scan: {number}" for number in range(count)]}]
        (tmp_path / "results" / name / "costs.json").write_text(json.dumps(rows))
        (tmp_path / "results" / name / "answer.json").write_text(json.dumps({"summary": ["Certain.", "Below 5 %."]}))
    folder = tmp_path / "results"
    files = ("b/published.json", "a/published.json", "c/published.json", "report.html", "store/report/0/report.html")
    made = [f"{folder}/{file}" for file in files]
    assert closing_lines(made) == [
        *(f"a: warning: scan: {number}" for number in range(MOST_WARNINGS)),
        f"a: and 2 more warnings in {folder}/a/report.html",
        "b: Certain.",
        "b: Below 5 %.",
        *(f"b: warning: scan: {number}" for number in range(MOST_WARNINGS)),
        *(f"page: {folder}/{name}report.html" for name in ("a/", "b/", "c/", "")),
    ]
