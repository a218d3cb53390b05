# The study. Each file in config/scenes/ is a target with its own name; without a target the default scenes are made.
# Rules of the stages: workflow/rules. Science: src/roughslip. Which edits re-run a stage: workflow/keys/key_files.py.
import atexit
import os
import shlex
import sys
from pathlib import Path

from snakemake.utils import min_version

min_version("9.27")

ROOT = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))
SOURCE = ROOT / "src"
LOCK = ROOT / "requirements.lock"
sys.path[:0] = [str(ROOT), str(SOURCE)]


configfile: f"{ROOT}/config/config.yaml"


from roughslip.errors import InputError
from roughslip.scene import plan
from roughslip.scene.declarations import declarations
from roughslip.scene.sweep import all_names
from roughslip.stages.runtime.parent import PARENT
from workflow.keys import key_files
from workflow.recovery import earlier_runs, start
from workflow.recovery.snakemake_metadata import SHARED
from workflow.study.closing import print_closing
from workflow.study.commands import command, log, outputs, run
from workflow.study.options import check_config, check_targets
from workflow.study.scenes import RULES, Scenes
from workflow.study.terminal import show_own_errors

# Paths are in the environment: in a command they would re-run all jobs when the tree is moved or .venv is made again.
os.environ.update(PYTHONPATH=f"{SOURCE}{os.pathsep}{ROOT}", ROUGHSLIP_PYTHON=sys.executable)
os.environ[PARENT] = str(os.getpid())

# What only describes the workflow changes no file outside .snakemake, like a dry run.
DESCRIBES = {"--lint", "--list-rules", "--list", "-l", "--list-target-rules", "--lt", "--unlock"}
DESCRIBES |= {"--dag", "--rulegraph", "--filegraph", "--d3dag", "--summary"}

if workflow.is_main_process and not workflow.output_settings.verbose:
    show_own_errors()

# Mistakes of the user end here, a line each. A job on another machine does not recover: its run has done that.
shared = {}
try:
    names = [name for one, found in all_names(ROOT / "config" / "scenes").items() for name in (one, *found)]
    options = check_config(config, names)
    if workflow.output_settings.dryrun or DESCRIBES.intersection(sys.argv):
        key_files.write_drafts()
    if workflow.is_main_process:
        check_targets(sys.argv[1:], names, RULES | {"all"})
    marks = start.STATE / "scans"
    scenes = Scenes(ROOT, sys.argv[1:], options["memory_mb"], default=options["scenes"], checked_scans=marks)
    compared = scenes.compared(config.get("compare"))
    if workflow.is_main_process:
        lines, shared = start.recover(scenes)
        if not DESCRIBES.intersection(sys.argv):
            print("".join(f"{line}\n" for line in lines), end="", file=sys.stderr)
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(1)
except KeyboardInterrupt:
    sys.exit("Ended on user request.")

# Jobs that run at the same time on this machine share its memory.
if workflow.is_main_process and "memory_mb" not in config and "mem_mb" not in workflow.global_resources:
    workflow.register_resource("mem_mb", scenes.memory_mb)


onstart:
    if workflow.non_local_exec:
        earlier_runs.mark_slurm(start.STATE)


onsuccess:
    print_closing(workflow, workflow.dag.jobs)


# Scenes that succeeded have their answer although another one failed.
onerror:
    print_closing(workflow, workflow.dag.finished_jobs)


# Where all results are up to date Snakemake calls no hook.
if not (workflow.output_settings.dryrun or DESCRIBES.intersection(sys.argv)):
    atexit.register(print_closing, workflow, ())


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


include: "workflow/rules/stages.smk"
include: "workflow/rules/references.smk"
include: "workflow/rules/evidence.smk"
include: "workflow/rules/several_scenes.smk"


for name in scenes.valid:

    rule:
        name:
            name
        input:
            scenes.all_of(name),


# A line when a job starts, in place of a block of files and reasons.
for each in workflow.rules:
    each.message = each.message or (f"{each.name}: {{wildcards}}" if each.wildcard_names else each.name)
