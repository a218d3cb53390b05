"""A run that is killed, or a stage that fails, leaves nothing that passes for a result, and the next run mends it.

Each fault breaks a finished or a running project as a seed chooses, and returns a description. Two run with the tests,
and twenty with `make faults`. A start also finds stale locks, another run at work, and jobs in the queue of Slurm.
"""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random

import psutil
import pytest

from roughslip.compilation.source_hash import closure_hash
from roughslip.errors import InputError, StoreError
from roughslip.study import checksum, is_whole, job
from roughslip.study.graph import Stage
from tests.workflow.project import ROOT, Project, as_a_user, digests
from workflow.study import working_folder

LONGEST = 15.0  # seconds into a run that a signal is sent
EDITS = (
    ("config/scenes/tiny.yaml", "duration_periods: 20", "duration_periods: 21"),
    ("src/roughslip/contact/solve.py", "\n\n\n", "\n\n_EDITED = 1\n\n\n"),
    ("src/roughslip/store.py", "\n\n\n", "\n\n_EDITED = 1\n\n\n"),
)


def start(project: Project, largest_file: int | None = None) -> subprocess.Popen:
    """Snakemake for the scene. largest_file : [B] that a process may write"""
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
    wrong = jobs_left(project)
    status, output = run(project)
    if status:
        return [*wrong, f"exit {status}: {output[-3000:]}"]
    now, records = digests(project.path("results/tiny")), project.path("results/tiny/usage").glob("*.json")
    wrong += sorted(name for name in before.keys() | now.keys() if before.get(name) != now.get(name))
    return [*wrong, *(f"{path.name}: damaged" for path in records if not is_whole(path))]


def lose_some(project: Project, random: Random) -> str:
    """Remove a result, or all, so that a run has something to do."""
    if random.random() < 0.2:
        shutil.rmtree(project.path("results"))
        return "all results lost"
    victim = random.choice(files_below(project.path("results")))
    victim.unlink()
    return f"{victim.relative_to(project.folder)} lost"


def kill(project: Project, random: Random) -> str:
    """Send a signal to Snakemake, to one of its jobs, or to all of them, at a random moment of a run."""
    lost, whom = lose_some(project, random), random.choice(("snakemake", "job", "both"))
    sent = random.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT))
    process, end = start(project), time.monotonic() + random.uniform(0.0, LONGEST)
    while process.poll() is None and (time.monotonic() < end or (whom == "job" and not jobs_of(process))):
        time.sleep(0.05)
    jobs = jobs_of(process)
    for pid in {"snakemake": [process.pid], "job": jobs[:1], "both": [process.pid, *jobs]}[whom]:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, sent)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.communicate(timeout=120)
    process.kill()
    process.communicate()
    return f"{lost}; {sent.name} to {whom}, {len(jobs)} jobs running"


def damage(project: Project, random: Random) -> str:
    """Cut a file short. Flipped bits are found by the stage that reads the file, and by `make verify`."""
    victim = random.choice(files_below(project.path("results")))
    content = victim.read_bytes()
    victim.write_bytes(content[: random.randrange(max(1, len(content)))])
    return f"{victim.relative_to(project.folder)} cut short"


def save_over(project: Project, random: Random) -> str:
    """Change a file that people open, and that is a copy; its time is kept or not."""
    copies = [path for path in files_below(project.path("results/tiny")) if path.stat().st_nlink == 1]
    victim = random.choice(copies)
    before = victim.stat()
    victim.write_bytes(random.choice((victim.read_bytes(), b"")) + b"mine\n")
    if random.random() < 0.5:
        os.utime(victim, ns=(before.st_atime_ns, before.st_mtime_ns))
    return f"{victim.relative_to(project.folder)} saved over"


def edit_during_a_run(project: Project, random: Random) -> str:
    """Edit the scene or the code while a run is at work, and take the edit back when it has ended."""
    lost, (name, old, new) = lose_some(project, random), random.choice(EDITS)
    file, process = project.path(name), start(project)
    text = file.read_text(encoding="utf-8")
    time.sleep(random.uniform(0.0, LONGEST))
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    process.communicate(timeout=600)
    file.write_text(text, encoding="utf-8")
    return f"{lost}; {file.name} edited, exit {process.returncode}"


def full_disk(project: Project, random: Random) -> str:
    """Run where no file can grow beyond some size, which fails as a full disk does."""
    lost, limit = lose_some(project, random), random.randrange(2_000, 400_000)
    return f"{lost}; no file above {limit} bytes, exit {run(project, largest_file=limit)[0]}"


def disorder(project: Project, random: Random) -> str:
    """Set random times, within years, of results and sources, and delete Snakemake's own records, after damage."""
    done = random.choice([lose_some, damage])(project, random)
    for path in files_below(project.folder):
        if ".snakemake" not in path.parts:
            os.utime(path, (time.time() + random.uniform(-1e8, 1e8),) * 2)
    shutil.rmtree(project.folder / ".snakemake", ignore_errors=True)
    return f"{done}; times in disorder, .snakemake deleted"


FAULTS: Sequence[Callable[[Project, Random], str]] = (
    *(kill, edit_during_a_run, disorder, full_disk),
    *(save_over, kill, damage),
)


def files_below(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*")) if path.is_file() and path.parent.name != "logs"]


def jobs_left(project: Project) -> list[str]:
    """Kill jobs that outlived the run that started them by ten seconds, and return a line for each."""
    working, lines = [], []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if Path(process.cwd()).is_relative_to(project.folder) and process.pid != os.getpid():
                working.append(process)
    for process in psutil.wait_procs(working, timeout=10.0)[1]:
        with contextlib.suppress(psutil.NoSuchProcess):  # ended meanwhile, or a zombie
            lines.append(f"process {process.pid} is alive: {' '.join(process.cmdline())}")
            process.kill()
    return lines


def jobs_of(process: subprocess.Popen) -> list[int]:
    """Process numbers of the stages that a run has started."""
    with contextlib.suppress(psutil.Error):
        children = psutil.Process(process.pid).children(recursive=True)
        return [child.pid for child in children if any("roughslip.study" in word for word in child.cmdline())]
    return []


@pytest.mark.slow
@pytest.mark.parametrize("number", range(int(os.environ.get("FAULTS", "2"))))
def test_one_new_run_mends_a_fault(project, number):
    """`make faults` asks for more of them. Fault n of a seed is the same each time."""
    before = digests(project.path("results/tiny"))
    description = FAULTS[number % len(FAULTS)](project, Random(f"{os.environ.get('FAULT_SEED', 1)} {number}"))
    print(description)
    assert not_mended(project, before) == []


def test_a_stage_whose_code_or_scan_changes_while_it_runs_fails(tmp_path, monkeypatch):
    """Its name says what it is made of. An edit that changes no syntax, of a comment, is none."""
    source, scan = tmp_path / "roughslip" / "study" / "design.py", tmp_path / "scan.txt"
    source.parent.mkdir(parents=True)
    for file in (source.parent / "__init__.py", tmp_path / "roughslip/__init__.py", source, scan):
        file.write_text("")
    stage, sums = Stage(name="design"), {"roughslip/study/design.py": checksum(source)}
    entry = {"sources": {"files": sums, "closure": closure_hash(stage.modules, tmp_path)}}
    entry["user_files"] = {str(scan): checksum(scan)}
    monkeypatch.setattr(job, "SOURCE", tmp_path)
    source.write_text("# a comment\n")
    job.check_sources(stage, entry)
    for file, text in ((scan, "1 3\n"), (source, "new = 1\n")):
        file.write_text(text)
        with pytest.raises(StoreError, match=f"{file.name} was .* during the run: nothing is written; run snakemake"):
            job.check_sources(stage, entry)
        scan.write_text("")


@pytest.mark.slow
def test_a_stage_that_fails_late_leaves_no_result(project):
    """Nor a temporary file; its message is shown once, without a traceback. What was made before is there to open."""
    last = "store.write(job.output, variables"
    project.edit("src/roughslip/study/expansion_strip.py", last, f'raise store.StoreError("no luck")\n    {last}')
    run = project.snakemake("-j1", "results/tiny/friction/expansion.nc")
    said = run.stdout + run.stderr
    assert run.returncode == 1
    (folder,) = re.findall(r"\[(results/store/expansion_strip/\w+)/logs", said)
    lines = [line for line in said.splitlines() if "no luck" in line]
    assert lines == [f"tiny: expansion_strip: no luck [{folder}/logs/expansion_strip.log]"]
    assert "Traceback" not in said
    assert sorted(path.name for path in project.path(folder).iterdir()) == ["key.json", "logs"]


def test_a_lock_lasts_until_the_process_of_its_run_ends_and_is_then_cleared(tmp_path, monkeypatch):
    """However many others start meanwhile. Snakemake's own lock is a file, which stays after a kill."""
    held: list = []
    monkeypatch.setattr(working_folder, "_held", held)
    state, lock = tmp_path / ".snakemake", tmp_path / ".snakemake/locks/0.input.lock"
    lock.parent.mkdir(parents=True)
    imports = "import sys; from pathlib import Path; from workflow.study.working_folder import hold"
    code = f"{imports}; hold(Path({str(state)!r})); print('held', flush=True); sys.stdin.read()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    environment = {"PYTHONPATH": f"{ROOT / 'src'}:{ROOT}"}
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, env=environment, **pipes) as other:
        assert other.stdout.readline() == "held\n"
        lock.write_text("results/a.nc\n")
        for _ in range(2):
            with pytest.raises(InputError, match=f"^{tmp_path}: another run is at work in this folder; wait"):
                working_folder.hold(state)
        other.kill()
    while held:
        held.pop().close()
    assert lock.exists()
    working_folder.hold(state)
    assert not lock.exists()
    held.pop().close()


def test_queued_jobs_of_an_earlier_run_are_refused(tmp_path, monkeypatch):
    """Not a job that Snakemake runs in, nor of another folder; nor where none was submitted, or without an answer."""
    here, squeue = tmp_path / "a | b", tmp_path / "squeue"
    (here / ".snakemake").mkdir(parents=True)
    answer = f"12|rule_surface|{here}\n13|rule_page|{here}/../a | b\n14|(null)|{here}\n15|rule_page|/elsewhere"
    monkeypatch.setenv("PATH", str(tmp_path))
    held: list = []
    monkeypatch.setattr(working_folder, "_held", held)
    monkeypatch.setattr(working_folder, "_SECONDS", 0.2)
    assert working_folder.queued_jobs(here) == []
    for script in ("exit 1", "exec /bin/sleep 5", f"/bin/cat <<'END'\n{answer}\nEND"):
        squeue.write_text(f"#!/bin/sh\n{script}\n")
        squeue.chmod(0o755)
        if "cat" not in script:
            assert working_folder.queued_jobs(here) == []
    working_folder.hold(here / ".snakemake")
    held.pop().close()
    (here / ".snakemake" / "slurm_logs").mkdir()
    with pytest.raises(InputError, match=re.escape(f"{here}: jobs of an interrupted run") + ".*: scancel 12 13$"):
        working_folder.hold(here / ".snakemake")
    held.pop().close()
