"""Compile the functions of the study and of the cases before the first run: stages of tiny scenes, in two processes.

What is compiled stays in the folder of compiled code; without anything to compile `python -m workflow.study.compile`
takes a few seconds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from roughslip.study.job import run
from workflow.keys import Names
from workflow.study.scenes import Scenes

SQUARE, FRICTION = "karhunen_loeve contact_square", "contact chaos_strip expansion_strip friction"
STRIP = "strip: {penetration_percentiles: [30, 50], samples: 8, training_samples: 4, expansion_samples: 16}"
RUNS = "ensemble: {realisations: 8, duration_periods: 20, damping_ratios: [0.17, 0.34]}\nmap: {points: 8}"
# By process its scenes, each with the stages that run and the text of its file.
TINY = {
    "contact": {
        "coarse_square": (SQUARE, "extends: paper\ntargets: [figure2]"),
        "fine_square": (SQUARE, "extends: resolved\ntargets: [figure2]"),
        "strips": (FRICTION, f"extends: resolved\ntargets: [figure3]\n{STRIP}"),
        "cells": ("contact friction", f"extends: disc_brake\ntargets: [figure5]\n{STRIP}"),
    },
    "motion": {"alone": ("cycles stick_slip_map", f"extends: given\ntargets: [figure5, figure_map]\n{RUNS}")},
}
SAMPLES = 8  # of a design of the square


def compile_for(process: str) -> None:
    """Run the stages of the scenes of a process. Files and results go into the working folder."""
    root = Path(__file__).resolve().parents[2]
    for name, (_, text) in TINY[process].items():
        Path(f"{name}.yaml").write_text(f"description: tiny\njobs: 1\n{text}\n", encoding="utf-8")
    names = Names(Scenes(root, [*TINY[process]], own="."), root, writes=True)
    for scene, (stages, _) in TINY[process].items():
        for stage in stages.split():
            for values in names.scenes.jobs(scene, stage):
                few = {"last": min(values["last"], SAMPLES)} if values.get("design") else {}
                run(Path(names.entry(scene, stage).folder, "key.json"), values | few)


def main() -> None:
    """Start both processes and wait for them; exit 1 where one fails, with what it says."""
    if len(sys.argv) > 1:
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            compile_for(sys.argv[1])
        return
    print("Compiling, half a minute", flush=True)
    command = [sys.executable, "-m", "workflow.study.compile"]
    started = [subprocess.Popen([*command, process], stderr=subprocess.PIPE, text=True) for process in TINY]
    sys.exit("".join(said for each in started for said in [each.communicate()[1]] if each.returncode) or None)


if __name__ == "__main__":
    main()
