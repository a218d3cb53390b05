"""Compile the functions of the study and of the cases before the first run: stages of tiny scenes, in two processes.

    python -m workflow.study.compile

What is compiled stays in the folder of compiled code, so all this takes a few seconds where nothing is to compile.
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

OF_SQUARE, OF_FRICTION = "karhunen_loeve contact_square", "contact chaos_strip expansion_strip friction"
STRIP = """
  penetration_percentiles: [30, 50]
  samples: 8
  training_samples: 4
  expansion_samples: 16
"""
# By process its scenes, each with the stages that run and the text of its file.
TINY = {
    "contact": {
        "coarse_square": (OF_SQUARE, "extends: paper\ntargets: [figure2]\njobs: 1"),
        "fine_square": (OF_SQUARE, "extends: resolved\ntargets: [figure2]\njobs: 1"),
        "strips": (OF_FRICTION, f"extends: resolved\ntargets: [figure3]\nstrip: {STRIP}\njobs: 1"),
        "cells": ("contact friction", f"extends: disc_brake\ntargets: [figure5]\nstrip: {STRIP}"),
    },
    "motion": {
        "motion_alone": (
            "cycles stick_slip_map",
            "extends: given\ntargets: [figure5, figure_map]\nmap: {points: 8}\njobs: 1\n"
            "ensemble: {realisations: 8, duration_periods: 20, damping_ratios: [0.17, 0.34]}",
        )
    },
}
SAMPLES = 8  # of a design


def compile_for(process: str, folder: Path) -> None:
    """Run the stages of the scenes of a process, whose results go below the folder."""
    root = Path(__file__).resolve().parents[2]
    for name, (_, text) in TINY[process].items():
        Path(folder, f"{name}.yaml").write_text(f'description: "tiny"\n{text.strip()}\n', encoding="utf-8")
    os.chdir(folder)
    names = Names(Scenes(root, [*TINY[process]], own="."), root, writes=True)
    for scene, (words, _) in TINY[process].items():
        for stage in words.split():
            for values in names.scenes.jobs(scene, stage):
                if values.get("design"):
                    values["last"] = min(values["last"], SAMPLES)
                run(Path(names.entry(scene, stage).folder, "key.json").resolve(), values)


def main() -> None:
    """Start both processes and wait for them; exit 1 where one fails, and show what it says."""
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) > 1:
            compile_for(sys.argv[1], Path(folder))
            return
        print("Compiling, half a minute", flush=True)
        command = [sys.executable, "-m", "workflow.study.compile"]
        started = [subprocess.Popen([*command, process], stderr=subprocess.PIPE, text=True) for process in TINY]
        ended = [(process.communicate()[1], process.returncode) for process in started]
    sys.exit("".join(said for said, code in ended if code) or None)


if __name__ == "__main__":
    main()
