"""Compile functions of the study before the first run: stages of the tiny scenes of config/compile that are named.

What is compiled stays in the folder of compiled code; results go with their folder.
"""

import os
import sys
import tempfile
from pathlib import Path

from roughslip.compilation import source_hash
from roughslip.study.graph import STAGES
from roughslip.study.job import run
from workflow.keys import Names
from workflow.study.scenes import Scenes

COMPILES_NOTHING_MORE = {"chaos_square", "answer", "figures", "page"}
SAMPLES = 8  # of a design of the square


def main(wanted: list[str]) -> None:
    """Run the stages of these scenes, in this process."""
    root = Path(__file__).resolve().parents[2]
    scenes = Scenes(root, wanted, own=str(root / "config/compile"))
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        names = Names(scenes, root, writes=True)
        for scene in wanted:
            for stage in (stage for stage in STAGES if stage in scenes.stages(scene) - COMPILES_NOTHING_MORE):
                for values in scenes.jobs(scene, stage):
                    few = {"last": min(values["last"], SAMPLES)} if values.get("design") else {}
                    run(Path(names.entry(scene, stage).folder, "key.json"), values | few)
    source_hash.keep()  # for the first run, which names results by all files that are parsed here


if __name__ == "__main__":
    main(sys.argv[1:])
