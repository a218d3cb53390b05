"""The faults: each breaks a finished or a running project as a seed chooses, and returns a description."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
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
    """Return all files that a run left in the folder of the scene, except logs."""
    return [path for path in sorted(scratch.results.rglob("*")) if path.is_file() and path.parent.name != "logs"]


def lose_some(scratch: Scratch, random: Random) -> str:
    """Remove a result, or all, so that a run has something to do."""
    if random.random() < 0.2:
        shutil.rmtree(scratch.results)
        return "all results lost"
    victim = random.choice([path for path in files(scratch) if path.parent.name != "keys"])
    victim.unlink()
    return f"{victim.relative_to(scratch.results)} lost"


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
    """Cut a result short, empty it, or flip some of its bits; the time of the file is kept or not."""
    victim = random.choice(files(scratch))
    return f"{victim.relative_to(scratch.results)} {_damage(victim, random, keep_time=random.random() < 0.5)}"


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


def _damage(victim: Path, random: Random, *, keep_time: bool) -> str:
    content, before = bytearray(victim.read_bytes()), victim.stat()
    how = random.choice(["cut short", "emptied", "flipped", "flipped"])
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
