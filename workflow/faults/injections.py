"""The faults: each breaks a finished or a running project as a seed chooses, and returns a description."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from random import Random

import psutil

from workflow.faults.scratch import Scratch

Fault = Callable[[Scratch, Random], str]

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
_LONGEST = 15.0  # seconds into a run that a signal is sent
_PATIENCE = 120.0  # seconds for a process to end after a signal


def files(scratch: Scratch) -> list[Path]:
    """Return all files that a run left in the store and in the folder of the scene, except logs."""
    found = (path for folder in (scratch.stored, scratch.results) for path in sorted(folder.rglob("*")))
    return [path for path in found if path.is_file() and path.parent.name != "logs"]


def copies(scratch: Scratch) -> list[Path]:
    """Return the files of the scene that are copies of those of the store."""
    return [path for path in files(scratch) if path.is_relative_to(scratch.results) and path.stat().st_nlink == 1]


def lose_some(scratch: Scratch, random: Random) -> str:
    """Remove a result, or all, so that a run has something to do."""
    results = scratch.folder / "results"
    if random.random() < 0.2:
        shutil.rmtree(results)
        return "all results lost"
    victim = random.choice(files(scratch))
    victim.unlink()
    return f"{victim.relative_to(results)} lost"


def kill(scratch: Scratch, random: Random, whom: str) -> str:
    """Send a signal to Snakemake, to one of its jobs, or to all of them, at a random moment of a run."""
    lost = lose_some(scratch, random)
    sent, moment = random.choice(SIGNALS), random.uniform(0.0, _LONGEST)
    process = scratch.start()
    end = time.monotonic() + moment
    while process.poll() is None and (time.monotonic() < end or (whom == "job" and not _jobs(process))):
        time.sleep(0.05)
    jobs = _jobs(process)
    targets = {"snakemake": [process.pid], "job": [job.pid for job in jobs[:1]]}
    for pid in targets.get(whom, [process.pid, *(job.pid for job in jobs)]):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, sent)
    try:
        process.communicate(timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
    return f"{lost}; {sent.name} to {whom} after {moment:.1f} s, {len(jobs)} jobs running"


def full_disk(scratch: Scratch, random: Random) -> str:
    """Run on a file system with little room, where one can be mounted; else limit the size of each file."""
    lost = lose_some(scratch, random)
    folder, aside = scratch.folder / "results", scratch.folder / "results-aside"
    shutil.copytree(folder, aside)
    room = random.randrange(0, 4_000_000)
    if not _mount(folder, sum(path.stat().st_size + 4096 for path in aside.rglob("*")) + room):
        shutil.rmtree(aside)
        limit = random.randrange(2_000, 400_000)
        status, _ = scratch.run(largest_file=limit)
        return f"{lost}; no file above {limit} bytes, exit {status}"
    try:
        shutil.copytree(aside, folder, dirs_exist_ok=True)
        status, _ = scratch.run()
        shutil.rmtree(aside)
        shutil.copytree(folder, aside)
    finally:
        subprocess.run(["umount", folder], check=True)
    shutil.rmtree(folder)
    os.rename(aside, folder)
    return f"{lost}; {room} bytes of room, exit {status}"


def read_only(scratch: Scratch, random: Random) -> str:
    """Run while folders of results cannot be written to."""
    lost = lose_some(scratch, random)
    scratch.results.mkdir(exist_ok=True)
    folders = [scratch.folder / "results", *(path for path in (scratch.folder / "results").rglob("*") if path.is_dir())]
    chosen = folders if random.random() < 0.5 else [random.choice(folders)]
    for folder in chosen:
        folder.chmod(0o555)
    status, said = scratch.run()
    for folder in chosen:
        folder.chmod(0o755)
    if "Traceback" in said:
        raise AssertionError(f"a traceback: {said[-2000:]}")
    return f"{lost}; {len(chosen)} folders read-only, exit {status}"


def damage(scratch: Scratch, random: Random) -> str:
    """Cut a file short or empty it, or flip some bits of one that people open; its time is kept or not.

    Flipped bits in the store are found by the next stage that reads the file, and by `make verify`.
    """
    is_flipped = random.random() < 0.5
    victim = random.choice(copies(scratch) if is_flipped else files(scratch))
    hows = ["flipped"] if is_flipped else ["cut short", "emptied"]
    how = _damage(victim, random, keep_time=random.random() < 0.5, hows=hows)
    return f"{victim.relative_to(scratch.folder)} {how}"


def save_over(scratch: Scratch, random: Random) -> str:
    """Save over a file that people open: another text, an appended line, or another file in its place."""
    victim = random.choice(copies(scratch))
    how = random.choice(["edited", "appended to", "replaced"])
    if how == "replaced":
        victim.unlink()
    with victim.open("ab" if how == "appended to" else "wb") as file:
        file.write(b"mine\n")
    return f"{victim.relative_to(scratch.folder)} {how}"


def edit_during_a_run(scratch: Scratch, random: Random) -> str:
    """Edit the scene or the code while a run is at work, and take the edit back when it has ended."""
    lost = lose_some(scratch, random)
    name, old, new = random.choice(
        [
            (f"config/scenes/{scratch.scene}.yaml", "duration_periods: 20", "duration_periods: 21"),
            ("src/roughslip/contact/solve.py", "\n\n\n", "\n\n_EDITED = 1\n\n\n"),
            ("src/roughslip/store.py", "\n\n\n", "\n\n_EDITED = 1\n\n\n"),
        ]
    )
    file, moment = scratch.folder / name, random.uniform(0.0, _LONGEST)
    text = file.read_text(encoding="utf-8")
    process = scratch.start()
    time.sleep(moment)
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    process.communicate(timeout=600)
    file.write_text(text, encoding="utf-8")
    return f"{lost}; {name} edited after {moment:.1f} s, exit {process.returncode}"


def damaged_cache(scratch: Scratch, random: Random) -> str:
    """Damage what numba compiled, and lose a result whose stage needs it."""
    scratch.run()
    lost = lose_some(scratch, random)
    compiled = sorted(Path(scratch.environment["NUMBA_CACHE_DIR"]).rglob("*.nb?"))
    return f"{lost}; compiled code {_damage(random.choice(compiled), random, keep_time=True)}"


def damaged_records(scratch: Scratch, random: Random) -> str:
    """Damage what Snakemake recorded, alone or with a result lost."""
    records = [path for path in sorted((scratch.folder / ".snakemake" / "metadata").rglob("*")) if path.is_file()]
    lost = lose_some(scratch, random) if random.random() < 0.5 else "nothing lost"
    return f"{lost}; a record of Snakemake {_damage(random.choice(records), random, keep_time=False)}"


def _damage(
    victim: Path, random: Random, *, keep_time: bool, hows: Sequence[str] = ("cut short", "emptied", "flipped")
) -> str:
    content, before = bytearray(victim.read_bytes()), victim.stat()
    how = random.choice(hows)
    if not content:
        return "left alone, as it is empty"
    if how == "flipped":
        for _ in range(random.choice([1, 1, 20])):
            content[random.randrange(len(content))] ^= 1 << random.randrange(8)
    else:
        del content[random.randrange(len(content)) if how == "cut short" else 0 :]
    victim.write_bytes(content)
    if keep_time:
        os.utime(victim, ns=(before.st_atime_ns, before.st_mtime_ns))
    return f"{how}{', its time kept' if keep_time else ''}"


def records_gone(scratch: Scratch, random: Random) -> str:
    """Delete Snakemake's own records, alone or after a result was damaged or lost or a run was killed."""
    before = random.choice([lose_some, damage, partial(kill, whom="both"), lambda *_: "nothing else"])
    done = before(scratch, random)
    shutil.rmtree(scratch.folder / ".snakemake", ignore_errors=True)
    return f"{done}; .snakemake deleted"


def disorder(scratch: Scratch, random: Random) -> str:
    """Set random times, within years, of results and sources, after a result was damaged or lost."""
    done = random.choice([lose_some, damage])(scratch, random)
    if random.random() < 0.3:
        shutil.rmtree(scratch.folder / ".snakemake")
        done += "; .snakemake deleted"
    for path in scratch.folder.rglob("*"):
        if path.is_file() and ".snakemake" not in path.parts:
            moment = time.time() + random.uniform(-1e8, 1e8)
            os.utime(path, (moment, moment))
    return f"{done}; times in disorder"


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


def _jobs(process: subprocess.Popen) -> list[psutil.Process]:
    """Return the stages that a run has started."""
    found = []
    with contextlib.suppress(psutil.Error):
        for child in psutil.Process(process.pid).children(recursive=True):
            if any("roughslip.stages" in word for word in child.cmdline()):
                found.append(child)
    return found


def _mount(folder: Path, size: int) -> bool:
    """Mount a file system of so many bytes in memory over a folder; return whether this user may."""
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", folder]
    return hasattr(os, "geteuid") and os.geteuid() == 0 and subprocess.run(command, capture_output=True).returncode == 0
