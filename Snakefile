# The study. Each file in config/scenes/ is a target with its own name; without a target the default scenes are made.
# Rules of the stages: workflow/rules. Science: src/roughslip. What names a result: workflow/keys.py.
import atexit
import os
import re
import sys
import tempfile
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from snakemake.utils import min_version

min_version("9.27")

ROOT = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))
SOURCE = ROOT / "src"
sys.path[:0] = [str(ROOT), str(SOURCE)]

# Of an address Snakemake fetches the files of rules alone. Jobs run in the Python of Snakemake.
if not SOURCE.is_dir():
    sys.exit(
        f"{ROOT}: the study runs from a clone: clone the project, `make setup`, and name the Snakefile of the clone"
    )
if lacking := [name for name in ("numpy", "scipy", "numba", "netCDF4", "matplotlib", "seaborn") if not find_spec(name)]:
    sys.exit(
        f"{sys.executable} has no {', '.join(lacking)}: `make setup` in {ROOT}, then run {ROOT}/.venv/bin/snakemake"
    )


configfile: f"{ROOT}/config/config.yaml"


from roughslip.compilation import source_hash
from roughslip.errors import InputError
from roughslip.scene.files import scene_names
from roughslip.study import PARENT
from roughslip.study.graph import STAGES
from roughslip.study.plan import stages_after
from workflow.keys import KEY, STORE, Names
from workflow.study import working_folder
from workflow.study.commands import Inputs, asked_mb, command, log, machine_mb, outputs
from workflow.study.publish import LISTED, publish_existing
from workflow.study.scenes import RULES, Scenes, check_config, check_targets, scene_folders
from workflow.study.terminal import print_closing, show_own_errors

# Paths are in the environment: in a command they would differ when the tree is moved or .venv is made again.
os.environ.update(PYTHONPATH=f"{SOURCE}{os.pathsep}{ROOT}", ROUGHSLIP_PYTHON=sys.executable)
os.environ[PARENT] = str(os.getpid())

# What only describes the workflow writes nothing outside .snakemake, like a dry run. Graphs and reports show all inputs.
GRAPHS = {"--dag", "--rulegraph", "--filegraph", "--d3dag", "--summary", "--report"}.intersection(sys.argv)
LISTS = {"--lint", "--list-rules", "--list", "-l", "--list-target-rules", "--lt", "--unlock"}.intersection(sys.argv)
RUNS = workflow.is_main_process and not (workflow.output_settings.dryrun or GRAPHS or LISTS)
STATE = Path(".snakemake")
NEWEST = tempfile.NamedTemporaryFile(prefix="roughslip-")  # newer than any result

if workflow.is_main_process and not workflow.output_settings.verbose:
    show_own_errors(lambda folder: names.at(folder).scene, shows_progress=RUNS)

# Mistakes of the user end here, a line each. A job on another machine has a key file and looks at no scene.
try:
    own = config.get("scenes_folder")
    known = [name for folder in scene_folders(ROOT, own) for name in scene_names(folder)]
    options = check_config(config, known)
    words, default = (sys.argv[1:], options["scenes"]) if workflow.is_main_process else ([], [])
    if workflow.modifier.is_main_snakefile():  # of a module, targets may be rules of the caller
        check_targets(words, known, RULES | {"all"})
    scenes = Scenes(ROOT, words, default=default, marks=STATE / "checked", own=own, writes=RUNS)
    names = Names(scenes, ROOT, writes=RUNS)
    inputs = Inputs(names, NEWEST.name, shows_all=bool(GRAPHS), clears=RUNS)
    if workflow.is_main_process and not LISTS:
        lines = [line for refused in scenes.refused.values() for line in refused]
        lines += [f"{name}: warning: {text}" for name in scenes.asked for text in scenes.warnings(name)]
        print("".join(f"{line}\n" for line in lines), end="", file=sys.stderr)
    if RUNS:
        working_folder.hold(STATE)
        working_folder.end_jobs_on_interrupt()
    for name in () if LISTS else scenes.asked:  # in this order: a job of several scenes bears the name of the first
        names.published(name)
    if RUNS:
        source_hash.keep()
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(1)
except KeyboardInterrupt:
    sys.exit("Ended on user request.")

# Jobs that run at the same time on this machine share its memory.
if workflow.is_main_process and "memory_mb" not in config and "mem_mb" not in workflow.global_resources:
    workflow.register_resource("mem_mb", machine_mb())


onsuccess:
    print_closing(workflow, workflow.dag.jobs)


# What succeeded although something failed: its files stand where people open them, and scenes that ended have answers.
onerror:
    with suppress(OSError):  # a full disk, which the error of the run names
        for each in scenes.asked:
            publish_existing(Path("results", each), names.published(each))
    print_closing(workflow, workflow.dag.finished_jobs)


# Where all results are up to date Snakemake calls no hook.
if RUNS:
    atexit.register(print_closing, workflow, ())


wildcard_constraints:
    scene="|".join(map(re.escape, known)),
    file=rf"(?!{LISTED}$)(?!logs/).+",
    key=KEY,
    first=r"\d+",
    last=r"\d+",
    design="[a-z_]+",


rule all:
    default_target: True
    input:
        [f"results/{name}/{LISTED}" for name in scenes.default],
        "results/report.html",


include: "workflow/rules/stages.smk"
include: "workflow/rules/several_scenes.smk"


for name in sorted({*known} - RULES):
    if name in scenes.refused:

        rule:
            name:
                name
            localrule: True
            shell:
                "exit 1"

    else:

        rule:
            name:
                name
            input:
                f"results/{name}/{LISTED}",


# A line when a job starts, in place of a block of files and reasons.
for each in workflow.modifier.rules:
    each.message = each.message or (f"{each.name}: {{wildcards}}" if each.wildcard_names else each.name)
