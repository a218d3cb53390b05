"""What the terminal shows of a job that fails, and of Ctrl-C: one line."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

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
