"""Mistakes of the user end before any job, in one line each."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roughslip.errors import InputError
from tests.workflow.project import ROOT
from workflow.keys import Names
from workflow.study import plausibility
from workflow.study.scenes import Scenes, check_config, check_targets


def test_each_mistake_of_the_configuration_or_a_target_is_one_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wrong = {"scenes": ["papr", "paper", "paper"], "scene": "paper", "memory_mb": "abc"}
    starts = ("'scene': unknown key; did you mean scenes?", "memory_mb: 'abc' is not allowed; a whole number from 1000")
    starts = (*starts, "scenes: 'papr' is no scene; did you")
    with pytest.raises(InputError) as caught:
        check_config(wrong, ["paper", "smoke"])
    for line, start in zip(sorted(caught.value.lines), starts, strict=True):
        assert line.startswith(f"config: {start}")
    assert check_config({"scenes": "smoke,paper"}, ["paper", "smoke"])["scenes"] == ["smoke", "paper"]
    for words, asked in ((["-j2"], "given"), (["smoke", "all"], "given smoke"), (["results/smoke/a.png"], "smoke")):
        assert Scenes(ROOT, words, default=["given"]).asked == asked.split()
    for words in (["-j2", "papr", "smoke"], ["results/papr/figure2.png"]):
        with pytest.raises(InputError, match=r"is no target: no scene 'papr'; did you mean paper\? allowed: paper, sm"):
            check_targets(words, ["paper", "smoke"], {"all", "karhunen_loeve"})
    check_targets(["-j2", "smoke", "all", "--config", "scenes=papr"], ["paper", "smoke"], {"all"})


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """The folder of scenes, with the shipped ones, of the working folder."""
    monkeypatch.chdir(tmp_path)
    return shutil.copytree(ROOT / "config/scenes", Path("config/scenes"))


def scenes_with(folder: Path, scan: str, **scenes: str) -> None:
    """Scenes after a scan. scan : what all of them say of it"""
    for name, more in scenes.items():
        text = f"extends: resolved\ntargets: [figure3]\nroughness: {{scan: {{{scan}, {more}}}}}\n"
        (folder / f"{name}.yaml").write_text(text)


def test_mistakes_of_scans_come_with_those_of_scenes(folder, tmp_path):
    """A scan that is a plane and nothing else, none, and a wrong value."""
    stated, words = "spacing_m: [1.0e-6, 1.0e-6], height_unit: um", "covariance: best, marginal: gaussian, form: plane"
    scenes_with(folder, words, flat=f"file: plane.txt, {stated}", gone=f"file: gone.al3d, {stated}")
    np.savetxt(folder / "plane.txt", 1e-3 * np.add.outer(np.arange(40.0), 2 * np.arange(40.0)))
    (folder / "wrong.yaml").write_text("extends: resolved\nseed: -1\n")
    with pytest.raises(InputError) as caught:
        Scenes(tmp_path, ["flat", "gone", "wrong"], marks=tmp_path / "marks")
    of_flat, of_gone, seed = sorted(caught.value.lines)
    assert seed.startswith("config/scenes/wrong.yaml: seed: -1 is not allowed")
    assert of_gone.startswith("config/scenes/gone.yaml: roughness.scan.file: 'gone.al3d' is not there; a path from")
    assert of_flat.startswith("config/scenes/flat.yaml: roughness.scan.file: nothing is left of the scan once its")
    (folder / "flat.yaml").write_text((folder / "flat.yaml").read_text().replace("form: plane", "form: mean"))
    with pytest.raises(
        InputError, match=r"flat.yaml: roughness.scan.file: the autocorrelation .* does not fall to 1/e"
    ):
        Scenes(tmp_path, ["flat"], marks=tmp_path / "marks")


def test_files_of_the_user_and_the_surface_come_in_the_wave_of_the_other_mistakes(folder, tmp_path):
    """The head of a record is read, and a load is judged, next to a mass that is refused. A radius that is refused
    hides no unit, and what a load would need is not missed."""
    (folder / "unit.csv").write_text("time [s];speed [rpm];friction [1]\n")

    def said(text):
        (folder / "mine.yaml").write_text(text)
        with pytest.raises(InputError) as caught:
            Scenes(tmp_path, ["mine"])
        return [line.removeprefix("config/scenes/mine.yaml: ") for line in caught.value.lines]

    record = "friction: {record: {file: [gone.csv, unit.csv]%s}}\n"
    given = "extends: given\ntargets: [answer]\noscillator: {mass_kg: -1}\n"
    mass, gone, unit = (line.partition(": ")[2] for line in said(given + record % ""))
    assert mass.startswith("-1 is not allowed")
    assert gone.startswith("'gone.csv' is not there")
    assert unit.startswith("config/scenes/unit.csv: column speed: rpm needs the radius of the track, radius_m")
    assert not any("rpm" in line for line in said(given + record % ", radius_m: -1"))
    light = "extends: disc_brake\nload: {force_n: 20, nominal_pressure_pa: 1.0e+3}\noscillator: {mass_kg: -1}\n"
    flat = "extends: disc_brake\nroughness: {rms_height_m: 1.0e-15}\n"  # under the load of its base
    half = "extends: paper\nload: {force_n: 20}\nmaterial: {young_modulus_pa: 0}\n"  # no pressure to judge
    for text, keys in (
        (light, ["oscillator.mass_kg:", "load:"]),
        (flat, ["load:"]),
        (half, ["material.young_modulus_pa:", "load.nominal_pressure_pa:"]),
    ):
        assert [line.partition(" ")[0] for line in said(text)] == keys


def test_a_record_is_read_before_the_run_unless_that_takes_long(tmp_path, monkeypatch):
    """A row far behind the head that is no number; a saw of stick and slip; half of what a fit takes."""
    own, noise = tmp_path, 0.3 + 0.01 * np.random.default_rng(0).standard_normal(2000)
    (own / "mine.yaml").write_text("extends: given\ndescription: d\ntargets: [answer]\nfriction: {record: my.csv}\n")

    def look(*friction):
        rows = [f"{0.01 * row:.2f},0.1,{value}" for row, value in enumerate(friction)]
        (own / "my.csv").write_text("\n".join(["time [s],speed [m/s],friction [1]", *rows]))
        return Scenes(ROOT, ["mine"], marks=own / "marks", own=str(own)).warnings("mine")

    for record, said in (
        ((*noise, "x"), "line 2002, column friction: 'x' is no finite number"),
        (0.3 + 0.01 * (np.arange(2000) % 40), "no sample of the record is in steady sliding: stick-slip up to"),
        (noise[:100], "100 samples of sliding cannot tell curve and scatter"),
    ):
        with pytest.raises(InputError, match=rf"mine.yaml: friction.record.file: (.*my.csv: )?{said}"):
            look(*record)
    monkeypatch.setattr(plausibility, "MOST_READ", 1000)
    assert [line for line in look(*noise[:100]) if "MB and is read in the run alone, which ends early" in line]


LAW = "def bo_pavelescu(speed):\n    return 0.3\n"
MODEL = "from numpy import exp\nfrom roughslip.surface import Covariance\n\nclass Mine(Covariance):\n"
MODEL += "    def profile(self, u):\n        return (1 + u) * exp(-u)\n"


def test_a_law_and_a_covariance_of_the_user_are_part_of_the_name_of_a_result(folder, tmp_path):
    """The path is that from the folder of the scene; stages that do not read the key keep their names."""
    own = "oscillator: {law: my_laws.py:bo_pavelescu}\nroughness: {covariance: my_models.py:Mine}\n"
    (folder / "mine.yaml").write_text(f"extends: quick\n{own}", encoding="utf-8")
    (folder / "my_models.py").write_text(MODEL, encoding="utf-8")

    def names():
        made = Names(Scenes(tmp_path, ["mine"]), ROOT, writes=False)
        assert made.scenes["mine"]["oscillator"]["law"] == "config/scenes/my_laws.py:bo_pavelescu"
        entries = {stage: made.entry("mine", stage) for stage in ("contact", "answer")}
        files = {stage: [*entry.made_of.get("user_files", {})] for stage, entry in entries.items()}
        return files, {stage: entry.key for stage, entry in entries.items()}

    for law, line in (
        (None, "'my_laws.py' is not there"),
        (LAW.replace("pavelescu", "pavlescu"), r"has no bo_pavelescu; did you mean bo_pavlescu\?"),
        (LAW.replace("return 0.3", "return 0.3 / speed"), "the friction law fails at 0 m/s: float division by zero$"),
    ):
        if law:
            (folder / "my_laws.py").write_text(law, encoding="utf-8")
        with pytest.raises(InputError, match=f"^config/scenes/mine.yaml: oscillator.law: .*{line}"):
            Scenes(tmp_path, ["mine"])
    (folder / "my_laws.py").write_text(LAW, encoding="utf-8")
    files, before = names()
    assert files == {"contact": ["config/scenes/my_models.py"], "answer": ["config/scenes/my_laws.py"]}
    (folder / "my_laws.py").write_text(f"{LAW}\n# edited\n", encoding="utf-8")
    after = names()[1]
    assert (after["contact"], after["answer"] == before["answer"]) == (before["contact"], False)


def test_a_scan_in_a_wrong_unit_is_warned_of_before_the_first_job(folder, tmp_path):
    """A wave of 0.05 µm on points 1 µm apart, 20 a period: differences have 2 sin(pi / 20) of its rms: slope 0.0111.

    A prefix more or less changes it by a thousand, to both sides of what is plausible. Read again from its mark.
    """
    words = "covariance: best, marginal: gaussian, form: mean, file: wave.txt"
    units = {unit: f"spacing_m: [1.0e-6, 1.0e-6], height_unit: {unit}" for unit in ("um", "mm", "nm")}
    scenes_with(folder, f"{words}, endless_lay: y", **units)
    np.savetxt(folder / "wave.txt", np.tile(0.05 * np.cos(2 * np.pi * np.arange(41) / 20), (41, 1)))
    said = {"um": "", "mm": "rms slope 11.1 between", "nm": "rms slope 1.11e-05 between"}
    for _ in range(2):
        scenes = Scenes(tmp_path, [*units], marks=tmp_path / "marks")
        for unit, text in said.items():
            lines = [line for line in scenes.warnings(unit) if "points of the scan" in line]
            assert [line[: len(text)] for line in lines] == [text] * bool(text)


def test_with_keep_going_a_scene_with_mistakes_is_left_out_and_others_run(tmp_path):
    """Only those that are named. Without it, and where none is without mistakes, all mistakes end the run."""
    own = tmp_path
    for name, seed in (("good", 3), ("bad", -3)):
        (own / f"{name}.yaml").write_text(f"extends: given\ndescription: d\nseed: {seed}\n")
    scenes = Scenes(ROOT, ["good", "bad", "--keep-going"], default=["bad"], own=str(own))
    assert (scenes.asked, list(scenes.refused)) == (["good"], ["bad"])
    assert "seed: -3 is not allowed" in scenes.refused["bad"][0]
    for words in (["good", "bad"], ["bad", "-k"]):
        with pytest.raises(InputError, match="seed: -3"):
            Scenes(ROOT, words, own=str(own))
    (own / "smoke.yaml").write_text("a: [")  # as a shipped scene
    assert not Scenes(ROOT, ["good", "-q", "all"], default=["bad"], own=str(own)).refused
    (own / "smoke.yaml").write_text("extends: given\ndescription: d\n")
    (own / "good.yaml").write_text("extends: smoke\nseed: 4\n")
    with pytest.raises(InputError, match=r"/smoke.yaml: a shipped scene has this name; rename the file"):
        Scenes(ROOT, ["good"], own=str(own))


def test_an_interrupt_of_the_run_alone_ends_its_jobs():
    code = (
        "import signal, subprocess; from workflow.study.working_folder import end_jobs_on_interrupt;"
        "signal.signal(signal.SIGINT, signal.default_int_handler); end_jobs_on_interrupt();"  # a shell's job ignores it
        "job = subprocess.Popen(['sleep', '100']); print(job.pid, flush=True); job.wait()"
    )
    options = {"cwd": ROOT, "env": {"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}, "text": True}
    options |= {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], **options) as run:
        job = int(run.stdout.readline())
        run.send_signal(signal.SIGINT)
        run.communicate(timeout=20)
    assert run.returncode != 0
    with pytest.raises(ProcessLookupError):
        os.kill(job, 0)
