"""A run that is killed or a stage that fails leaves nothing that passes for a result, and the next run mends it.

The faults: each breaks a finished or a running project as a seed chooses, and returns a description.
FAULTS lists them. One of each runs, and more where `make faults` asks for them.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from random import Random

import psutil
import pytest

from roughslip.compilation.source_hash import closure_hash, compiled_folder
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime import command, usage
from tests.workflow.project import Project, as_a_user, digests

Fault = Callable[[Project, Random], str]

_LONGEST = 15.0  # seconds into a run that a signal is sent
_PATIENCE = 120.0  # seconds for a process to end after a signal
_CUT, _CHANGED = ("cut short", "emptied"), ("flipped", "replaced", "appended to")
_EDITS = (
    ("config/scenes/tiny.yaml", "duration_periods: 20", "duration_periods: 21"),
    ("src/roughslip/contact/solve.py", "\n\n\n", "\n\n_EDITED = 1\n\n\n"),
    ("src/roughslip/store.py", "\n\n\n", "\n\n_EDITED = 1\n\n\n"),
)


def start(project: Project, largest_file: int | None = None) -> subprocess.Popen:
    """Start Snakemake for the scene, as `make reproduce` does. largest_file : [B] that a process may write"""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    command = [sys.executable, "-m", "snakemake", "-j2", "tiny"]
    return subprocess.Popen(command, preexec_fn=as_a_user(largest_file), **pipes, **project.options)


def run(project: Project, largest_file: int | None = None) -> tuple[int, str]:
    """Run the same to its end and return exit status and output."""
    with start(project, largest_file) as process:
        output = process.communicate(timeout=600)[0]
    return process.returncode, output


def not_mended(project: Project, before: dict[str, str]) -> list[str]:
    """What one new run does not restore: nothing, or a line each. before : checksums of the undisturbed results"""
    wrong = _jobs_left(project)
    status, output = run(project)
    if status:
        return [*wrong, f"exit {status}: {output[-3000:]}"]
    now, records = digests(project.path("results/tiny")), project.path("results/tiny/usage").glob("*.json")
    wrong += sorted(name for name in before.keys() | now.keys() if before.get(name) != now.get(name))
    return [*wrong, *(f"{path.name}: damaged" for path in records if not usage.is_whole(path))]


def lose_some(project: Project, random: Random) -> str:
    """Remove a result, or all, so that a run has something to do."""
    if random.random() < 0.2:
        shutil.rmtree(project.path("results"))
        return "all results lost"
    victim = random.choice(_files(project.path("results")))
    victim.unlink()
    return f"{victim.relative_to(project.folder)} lost"


def kill(project: Project, random: Random, whom: str) -> str:
    """Send a signal to Snakemake, to one of its jobs, or to all of them, at a random moment of a run."""
    lost = lose_some(project, random)
    sent = random.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT))
    process, end = start(project), time.monotonic() + random.uniform(0.0, _LONGEST)
    while process.poll() is None and (time.monotonic() < end or (whom == "job" and not _jobs(process))):
        time.sleep(0.05)
    jobs = _jobs(process)
    for pid in {"snakemake": [process.pid], "job": jobs[:1], "both": [process.pid, *jobs]}[whom]:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, sent)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.communicate(timeout=_PATIENCE)
    process.kill()
    process.communicate()
    return f"{lost}; {sent.name} to {whom}, {len(jobs)} jobs running"


def damage(project: Project, random: Random) -> str:
    """Cut a file short or empty it. Flipped bits are found by the stage that reads the file, and by `make verify`."""
    return _alter(project, random, _files(project.path("results")), _CUT)


def save_over(project: Project, random: Random) -> str:
    """Change a file that people open, and that is a copy: some bits, another text, an appended line."""
    copies = [path for path in _files(project.path("results/tiny")) if path.stat().st_nlink == 1]
    return _alter(project, random, copies, _CHANGED)


def edit_during_a_run(project: Project, random: Random) -> str:
    """Edit the scene or the code while a run is at work, and take the edit back when it has ended."""
    lost, (name, old, new) = lose_some(project, random), random.choice(_EDITS)
    file, process = project.path(name), start(project)
    text = file.read_text(encoding="utf-8")
    time.sleep(random.uniform(0.0, _LONGEST))
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    process.communicate(timeout=600)
    file.write_text(text, encoding="utf-8")
    return f"{lost}; {file.name} edited, exit {process.returncode}"


def full_disk(project: Project, random: Random) -> str:
    """Run where no file can grow beyond some size, which fails as a full disk does."""
    lost, limit = lose_some(project, random), random.randrange(2_000, 400_000)
    return f"{lost}; no file above {limit} bytes, exit {run(project, largest_file=limit)[0]}"


def read_only(project: Project, random: Random) -> str:
    """Run while folders of results cannot be written to."""
    lost = lose_some(project, random)
    project.path("results/tiny").mkdir(parents=True, exist_ok=True)
    folders = [path for path in (project.path("results")).rglob("*") if path.is_dir()]
    chosen = folders if random.random() < 0.5 else [random.choice(folders)]
    for folder in chosen:
        folder.chmod(0o555)
    status, said = run(project)
    for folder in chosen:
        folder.chmod(0o755)
    if "Traceback" in said:
        raise AssertionError(f"a traceback: {said[-2000:]}")
    return f"{lost}; {len(chosen)} folders read-only, exit {status}"


def records_gone(project: Project, random: Random) -> str:
    """Delete Snakemake's own records, alone or after a result was damaged or lost or a run was killed."""
    before: Fault = random.choice([lose_some, damage, partial(kill, whom="both"), lambda *_: "nothing else"])
    done = before(project, random)
    shutil.rmtree(project.folder / ".snakemake", ignore_errors=True)
    return f"{done}; .snakemake deleted"


def disorder(project: Project, random: Random) -> str:
    """Set random times, within years, of results and sources, after a result was damaged or lost."""
    done = random.choice([lose_some, damage])(project, random)
    for path in _files(project.folder):
        if ".snakemake" not in path.parts:
            os.utime(path, (time.time() + random.uniform(-1e8, 1e8),) * 2)
    return f"{done}; times in disorder"


def damaged_cache(project: Project, random: Random) -> str:
    """Damage what numba compiled, and lose a result whose stage needs it."""
    lost, compiled = lose_some(project, random), _files(compiled_folder(), ending=".nb?")
    return f"{lost}; {_alter(project, random, compiled, (*_CUT, *_CHANGED))}"


def damaged_records(project: Project, random: Random) -> str:
    """Damage what Snakemake recorded, and lose a result."""
    lost, records = lose_some(project, random), _files(project.folder / ".snakemake" / "metadata")
    return f"{lost}; {_alter(project, random, records, (*_CUT, *_CHANGED))}"


FAULTS: dict[str, Fault] = {
    **{f"kill {whom}": partial(kill, whom=whom) for whom in ("snakemake", "job", "both")},
    "damage": damage,
    "save over": save_over,
    "edit during a run": edit_during_a_run,
    "full disk": full_disk,
    "read-only": read_only,
    "records gone": records_gone,
    "disorder": disorder,
    "damaged cache": damaged_cache,
    "damaged records": damaged_records,
}


def _files(*folders: Path, ending: str = "") -> list[Path]:
    """All files below some folders, except logs."""
    paths = (path for folder in folders for path in sorted(folder.rglob(f"*{ending}")))
    return [path for path in paths if path.is_file() and path.parent.name != "logs"]


def _alter(project: Project, random: Random, files: Sequence[Path], hows: Sequence[str]) -> str:
    """Alter one of these files in one of these ways; its time is kept or not."""
    victim, how = random.choice(files), random.choice(hows)
    content, before = bytearray(victim.read_bytes()), victim.stat()
    if how in _CUT:
        del content[random.randrange(max(1, len(content))) if how == "cut short" else 0 :]
    elif how == "flipped":
        for _ in range(20 if content else 0):
            content[random.randrange(len(content))] ^= 1 << random.randrange(8)
    else:
        content = (content if how == "appended to" else b"") + b"mine\n"
    victim.write_bytes(content)
    if random.random() < 0.5:
        os.utime(victim, ns=(before.st_atime_ns, before.st_mtime_ns))
    return f"{victim.name} in {victim.parent} {how}".replace(f"{project.folder}/", "")


def _jobs_left(project: Project, seconds: float = 10.0) -> list[str]:
    """Kill jobs that outlived the run that started them, and return a line for each."""
    working, lines = [], []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if Path(process.cwd()).is_relative_to(project.folder) and process.pid != os.getpid():
                working.append(process)
    for process in psutil.wait_procs(working, timeout=seconds)[1]:
        with contextlib.suppress(psutil.NoSuchProcess):  # ended meanwhile, or a zombie
            lines.append(f"process {process.pid} is alive: {' '.join(process.cmdline())}")
            process.kill()
    return lines


def _jobs(process: subprocess.Popen) -> list[int]:
    """Process numbers of the stages that a run has started."""
    with contextlib.suppress(psutil.Error):
        children = psutil.Process(process.pid).children(recursive=True)
        return [child.pid for child in children if any("roughslip.stages" in word for word in child.cmdline())]
    return []


pytestmark = pytest.mark.slow


COUNT, SEED = int(os.environ.get("FAULTS", len(FAULTS))), os.environ.get("FAULT_SEED", "1")


@pytest.mark.parametrize("number", range(COUNT))
def test_one_new_run_mends_each_kind_of_fault(project, tmp_path, monkeypatch, number):
    """`make faults` asks for more of them. Fault n of a seed is the same each time."""
    kind, before = list(FAULTS)[number % len(FAULTS)], digests(project.path("results/tiny"))
    shutil.copytree(compiled_folder(), tmp_path / "numba")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    description = FAULTS[kind](project, Random(f"{SEED} {number}"))
    print(f"{kind}: {description}")
    assert not_mended(project, before) == []


def test_a_stage_whose_code_or_scan_changes_while_it_runs_fails(tmp_path, monkeypatch, capsys):
    """Its name says what it is made of. An edit that changes no syntax, of a comment, is none."""
    source, scan = tmp_path / "roughslip" / "stages" / "scan.py", tmp_path / "scan.txt"
    source.parent.mkdir(parents=True)
    for package in ("roughslip", "roughslip/stages"):
        (tmp_path / package / "__init__.py").write_text("")
    source.write_text("old = 1\n")
    scan.write_text("1 2\n")
    files = {"roughslip/stages/scan.py": usage.checksum(source)}
    sources = {"files": files, "closure": closure_hash("roughslip.stages.scan", tmp_path)}
    key = {"configuration": {}, "code": "", "sources": sources, "scans": [usage.checksum(scan)]}
    key["inputs"] = {"scan": [str(scan)]}
    (tmp_path / "key.json").write_text(json.dumps(key))
    monkeypatch.setattr(command, "SOURCE", tmp_path)
    monkeypatch.setattr("sys.argv", ["stage", f"--key={tmp_path / 'key.json'}"])
    stage, made = Stage(name="scan", result="scan.nc"), tmp_path / "usage" / "scan.json"
    command.execute(stage, lambda job: source.write_text("old = 1  # as before\n"))
    assert made.is_file()
    made.unlink()
    for file, text in ((scan, "1 3\n"), (source, "new = 1\n")):
        with pytest.raises(SystemExit):
            command.execute(stage, lambda job, file=file, text=text: file.write_text(text))
        assert f"{file.name} was" in (said := capsys.readouterr().err)
        assert "during the run: nothing is written; run snakemake again" in said
        assert not made.exists()
        scan.write_text("1 2\n")


def test_a_stage_that_fails_late_leaves_no_result(project):
    """Nor a temporary file; its message is shown once, without a traceback. What was made before is there to open."""
    project.edit(
        "src/roughslip/stages/chaos_square.py",
        "    store.write(",
        '    if results:\n        raise store.StoreError("no luck")\n    store.write(',
    )
    run = project.snakemake("-j1", "results/tiny/chaos/square.nc")
    said = run.stdout + run.stderr
    assert run.returncode == 1
    (folder,) = re.findall(r"\[(results/store/chaos_square/\w+)/logs", said)
    assert [line for line in said.splitlines() if "no luck" in line] == [
        f"tiny: chaos_square: no luck [{folder}/logs/chaos_square.log]"
    ]
    assert "Traceback" not in said
    assert sorted(path.name for path in project.path(folder).iterdir()) == ["key.json", "logs"]
    assert project.path("results/tiny/surface/modes.nc").is_file()
