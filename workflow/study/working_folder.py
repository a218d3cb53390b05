"""The working folder of a run: no two runs are at work in it, and what no scene uses can be removed.

A run holds a lock of the kernel, which ends with its process. Snakemake's own locks are files that do not say whether
their owner is alive: who holds the kernel's lock removes them. If Snakemake is killed on a login node, its jobs stay in
the queue of Slurm. A job that starts after a new run has made its result would remove it while others read it. So a run
does not start while such jobs are queued.

    python -m workflow.study.working_folder [folder of scenes of the caller]     removes results that no scene uses
"""

import contextlib
import fcntl
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType
from typing import IO

from roughslip.errors import InputError
from workflow.keys import STORE, Names
from workflow.study.publish import is_current
from workflow.study.scenes import FOLDERS, Scenes

ALIVE = "PENDING,CONFIGURING,RUNNING,SUSPENDED"  # states of jobs that will still write
SUBMITTED = "slurm_logs"  # where the plug-in has submitted jobs. Without it no answer of Slurm is awaited
_OF_A_RULE = "rule_"  # begins the comment of each job that the plug-in submits
_SECONDS = 15.0  # for Slurm to answer
_held: list[IO[str]] = []  # open as long as the process lives


def hold(state: Path) -> None:
    """Hold a folder until this process ends. state : Snakemake's folder in it

    Raises InputError where another run holds it, where its jobs are in the queue of Slurm, or where it cannot be
    written to. A file system without locks protects from none of these.
    """
    folder = state.resolve().parent
    try:
        state.mkdir(exist_ok=True)
        _held.append((state / "alive").open("a", encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{state}: cannot be written to ({error.strerror})") from None
    try:
        fcntl.flock(_held[-1], fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        text = f"{folder}: another run is at work in this folder; wait for its end, or stop it"
        raise InputError(text) from None
    except OSError:
        pass
    else:
        for lock in (state / "locks").glob("*.lock"):  # of Snakemake, which a killed run leaves behind
            lock.unlink(missing_ok=True)
    if (state / SUBMITTED).is_dir() and (queued := queued_jobs(folder)):
        raise InputError(
            f"{folder}: jobs of an interrupted run are in the queue of Slurm and would overwrite new results; start "
            f"again when they have ended, or after: scancel {' '.join(queued)}"
        )


def end_jobs_on_interrupt() -> None:
    """Let Ctrl-C, also where it reaches Snakemake alone, end its jobs on this machine. Linux only."""
    usual = signal.getsignal(signal.SIGINT)

    def end(number: int, frame: FrameType | None) -> None:
        for file in Path("/proc/self/task").glob("*/children"):
            for job in file.read_text(encoding="ascii").split():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(int(job), signal.SIGINT)
        if callable(usual):
            usual(number, frame)

    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, end)


def queued_jobs(folder: Path, states: str = ALIVE) -> list[str]:
    """Numbers of the jobs of rules that were submitted from a folder and are in one of these states.

    Empty without Slurm, or where it does not answer.
    """
    command = ["squeue", "--noheader", f"--user={os.getuid()}", f"--states={states}", "--format=%A|%k|%Z"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS)
    except (OSError, subprocess.TimeoutExpired):
        return []
    lines = [line.split("|", 2) for line in answer.stdout.splitlines() if line.count("|") > 1]
    here = folder.resolve()
    return [job for job, comment, at in lines if comment.startswith(_OF_A_RULE) and Path(at.strip()).resolve() == here]


def unused(names: Names) -> list[Path]:
    """Folders of scenes that are gone, and folders of the store that no scene names.

    Raises InputError where a scene has a mistake: what it names is not known.
    """
    scenes = names.scenes
    if bad := sorted(set(scenes.names).difference(scenes.valid)):
        raise InputError(f"clean_unused: nothing is removed while scenes have mistakes: {', '.join(bad)}")
    used = {Path(file).parts[:4] for name in scenes.valid for file in names.published(name).values()}
    used |= {Path(names.publication(name).folder).parts for name in scenes.valid}
    results = Path("results")
    gone = [path for path in sorted(results.glob("*")) if path.is_dir() and path.name not in {*scenes.names, *FOLDERS}]
    stored = [path for path in Path(STORE).glob("*/*") if path.is_dir() and path.parts not in used]
    of_several = (path for path in stored if any(is_current(results / file.name, file) for file in path.glob("*")))
    return [*gone, *sorted({*stored}.difference(of_several))]


def main() -> None:
    """Remove it, with a line for each folder; exit 1 with a line where a scene has a mistake."""
    root = Path(__file__).resolve().parents[2]
    try:
        folders = unused(Names(Scenes(root, words=[], own=next(iter(sys.argv[1:]), None)), root, writes=False))
    except InputError as error:
        sys.exit(f"clean_unused: error: {error}")
    for folder in folders:
        print(f"removed: {folder}", flush=True)
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
