# The study: every file in config/scenes/ is a target of its own name; without a target, the scenes of config/config.yaml.
# Stages and their files: workflow/rules. Science: src/roughslip. What re-runs a stage: the key files of workflow/lib/keys.py.
import os
import shlex
import sys
from pathlib import Path

ROOT = Path(workflow.basedir)
SOURCE = ROOT / "src"
LOCK = ROOT / "requirements.lock"
sys.path[:0] = [str(ROOT), str(SOURCE)]

from roughslip.errors import InputError
from workflow.lib.scenes import Scenes

# One stage's command. `exec`, so that the stage is a child of Snakemake itself and dies with it. Paths reach it through the
# environment: in the command they would re-run everything when the tree moves or .venv is made anew.
os.environ.update(PYTHONPATH=f"{SOURCE}{os.pathsep}{ROOT}", ROUGHSLIP_PYTHON=sys.executable)
STAGE = 'exec "$ROUGHSLIP_PYTHON" -m roughslip.stages'
EVIDENCE = 'exec "$ROUGHSLIP_PYTHON" -m workflow'  # references, benchmarks, stress campaigns: no part of a scene

try:
    scenes = Scenes(ROOT, words=sys.argv[1:])
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(1)


wildcard_constraints:
    scene="|".join(scenes.valid),
    first=r"\d+",
    last=r"\d+",
    design="[a-z_]+",


rule all:
    default_target: True
    input:
        lambda wildcards: [product for name in scenes.default for product in scenes.products(name)],
        "results/report.html",


include: "workflow/rules/surface.smk"
include: "workflow/rules/square.smk"
include: "workflow/rules/strip.smk"
include: "workflow/rules/oscillator.smk"
include: "workflow/rules/map.smk"
include: "workflow/rules/references.smk"
include: "workflow/rules/outputs.smk"
include: "workflow/rules/evidence.smk"


for name in scenes.valid:

    rule:
        name:
            name
        input:
            scenes.products(name),
