# The study: every file in config/scenes/ is a target of its own name; without a target, the scenes of config/config.yaml.
# Stages and their files: workflow/rules. Science: src/roughslip. What re-runs a stage: the key files of workflow/keys/key_files.py.
import os
import shlex
import sys
from pathlib import Path

ROOT = Path(workflow.basedir)
SOURCE = ROOT / "src"
LOCK = ROOT / "requirements.lock"
sys.path[:0] = [str(ROOT), str(SOURCE)]

from roughslip.errors import InputError
from roughslip.stages.runtime.usage import PARENT
from workflow.recovery import start
from workflow.study.options import whole_numbers
from workflow.study.scenes import Scenes

# One stage's command. `exec`, so that the stage is a child of Snakemake itself and dies with it. Paths reach it through the
# environment: in the command they would re-run everything when the tree moves or .venv is made anew.
os.environ.update(PYTHONPATH=f"{SOURCE}{os.pathsep}{ROOT}", ROUGHSLIP_PYTHON=sys.executable)
os.environ[PARENT] = str(os.getpid())
STAGE = 'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages'
EVIDENCE = 'exec "$ROUGHSLIP_PYTHON" -m workflow.job'  # references, benchmarks, stress campaigns: no part of a scene

# Of the run that a user starts, not of a job of it on another machine: what an earlier one left is settled before anything
# is planned, its lock where it was killed, and results that are not what its jobs wrote.
try:
    numbers = whole_numbers(config)
    scenes = Scenes(ROOT, words=sys.argv[1:], memory_mb=numbers["memory_mb"])
    compared = scenes.compared(config.get("compare"))
    if workflow.is_main_process:
        told = start.settle(scenes)
        print("".join(f"{line}\n" for line in told), end="", file=sys.stderr)
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(1)

# Jobs that run side by side on this machine share its memory.
if workflow.is_main_process and "memory_mb" not in config and "mem_mb" not in workflow.global_resources:
    workflow.register_resource("mem_mb", scenes.memory_mb)


wildcard_constraints:
    scene="|".join(scenes.valid),
    first=r"\d+",
    last=r"\d+",
    design="[a-z_]+",


rule all:
    default_target: True
    input:
        lambda wildcards: [product for name in scenes.default for product in scenes.all_of(name)],
        "results/report.html",


include: "workflow/rules/surface.smk"
include: "workflow/rules/square.smk"
include: "workflow/rules/strip.smk"
include: "workflow/rules/oscillator.smk"
include: "workflow/rules/map.smk"
include: "workflow/rules/references.smk"
include: "workflow/rules/evidence.smk"
include: "workflow/rules/outputs.smk"


for name in scenes.valid:

    rule:
        name:
            name
        input:
            scenes.all_of(name),
