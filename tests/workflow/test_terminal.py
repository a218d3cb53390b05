"""What the terminal shows of a run: one line of progress; of a job that fails, and of Ctrl-C: one line; and its end."""

import io
import json
import logging
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from snakemake.logging import ColorizingTextHandler, LogEvent

from workflow.study import terminal
from workflow.study.terminal import MOST_WARNINGS, closing_lines

ROOT = Path(__file__).resolve().parents[2]
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
