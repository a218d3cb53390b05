"""Who may import whom, and how large a piece may be: read from the source, so that the design holds itself.

Error texts name keys that a scene has, in one line. Lock files agree with pyproject.toml and with each other.
"""

import ast
import re
import sys
import tomllib
from pathlib import Path

import roughslip
from roughslip.compilation.source_hash import absolute_imports
from roughslip.scene.schema import keys
from roughslip.study.graph import STAGES

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src"
WORKFLOW = sorted((ROOT / "workflow").rglob("*.py"))
# The ground floor, which everyone may import, and then who else a package may import.
GROUND = (
    *("errors", "atomic_write", "validation", "grid", "store", "compilation", "probability", "limits", "fft"),
    *("public_names", "results"),
)
SUBJECTS = ("surface", "contact", "chaos", "friction", "oscillator")
ALLOWED = {
    **dict.fromkeys(GROUND, ()),
    **dict.fromkeys((*SUBJECTS, "scene", "figures", "report", "datasets"), ()),
    "plot": ("contact", "oscillator"),
    "record": ("oscillator",),  # a measured curve as a friction law
    "scan": ("surface",),
    "verdicts": ("chaos", "friction"),
    "study": (*SUBJECTS, "scan", "record", "figures", "verdicts", "report", "scene"),
}
# Lists of names that import nothing, for the sections of a scene.
LIGHT = ("roughslip.study.graph", "roughslip.study.plan")
# The ceilings; a module of one subject is better at 100 to 300 lines.
MODULE_LINES = 400
TABLES = ("statements.py",)  # rows of text
FUNCTION_LINES = 70
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]
# Import names whose packages are called otherwise.
PACKAGES = {"yaml": "pyyaml", "netCDF4": "netcdf4", "SurfaceTopography": "surfacetopography"}


def module_of(file: Path) -> str:
    parts = file.relative_to(SOURCE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(file): file for file in sorted((SOURCE / "roughslip").rglob("*.py"))}


def imported(module: str) -> set[str]:
    """What a module imports: modules, and for `from a import b` both a.b where that is a module, else a."""
    imported = set()
    for target, names in absolute_imports(MODULES[module], module):
        submodules = {f"{target}.{name}" for name in names} & MODULES.keys()
        imported |= submodules if names and len(submodules) == len(names) else {target} | submodules
    return imported


def importers_of(*packages: str) -> set[str]:
    return {module for module in MODULES if any(name.partition(".")[0] in packages for name in imported(module))}


def room(module: str) -> str:
    """The package below roughslip that a module belongs to."""
    return module.split(".")[1] if "." in module else ""


def test_arrows_point_downwards_only():
    """Subjects do not import each other: arrays pass between them in the stages."""
    wrong = {
        f"{module} imports {name}"
        for module in MODULES
        if room(module)
        for name in imported(module)
        if name.startswith("roughslip.")
        and room(name) != room(module)
        and room(name) not in (*GROUND, *ALLOWED[room(module)])
        and not (room(module) == "scene" and name in LIGHT)
    }
    assert wrong == set()


def test_the_root_holds_the_ground_floor_and_each_format_has_one_reader():
    """What is for users alone stands there too. An import of plotting costs a second, which no other stage pays."""
    loose = {file.stem for file in MODULES.values() if file.parent == SOURCE / "roughslip"}
    assert loose <= {*GROUND, "__init__", "__main__", "datasets", "plot"}
    of_xarray = {module for module in importers_of("xarray") if room(module) != "figures"}  # which take Datasets
    assert of_xarray == {"roughslip.store", "roughslip.datasets"}
    assert importers_of("netCDF4") <= {"roughslip.store", "roughslip.scan.instrument_file"}
    assert {room(module) for module in importers_of("SurfaceTopography")} == {"scan"}
    assert {room(module) for module in importers_of("seaborn", "matplotlib")} == {"figures", "plot"}
    assert importers_of("snakemake", "workflow") == set()


def test_the_wheel_is_the_library():
    """It holds all but the study, and imports neither that nor a package that only the study installs."""
    study = {Path(folder).name for folder in PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["exclude"]}
    assert study == {"scene", "study", "figures", "verdicts", "report"}
    library = {module for module in MODULES if room(module) not in study}
    assert not {(module, name) for module in library for name in imported(module) if room(name) in study}
    assert {room(module) for module in importers_of("jinja2", "yaml", "jsonschema", "snakemake", "seaborn")} <= study


def test_nothing_imports_a_stage_that_is_a_command():
    """Else an edit of one stage would re-run another; what stages share stands in modules that are no command."""
    commands = {name for stage in STAGES.values() for name in stage.modules.split() if room(name) == "study"}
    assert {f"{module} imports {name}" for module in MODULES for name in imported(module) & commands} == set()


def test_imports_are_statements():
    """The hash of a stage's code cannot see any other import. It reads what public names and figures import by."""
    hidden = re.compile(r"import_module\(|__import__\(|\bexec\(|\beval\(")
    hides = {module for module, file in MODULES.items() if hidden.search(file.read_text("utf-8"))}
    assert hides == {"roughslip.public_names", "roughslip.study.job", "roughslip.study.figures"}


def names(requirements: list[str]) -> set[str]:
    """Of packages, as registries compare them (PEP 503)."""
    return {re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", line).group()).lower() for line in requirements}


def test_what_is_imported_is_declared():
    declared = names(PROJECT["project"]["dependencies"] + EXTRAS["study"] + EXTRAS["scans"])
    targets = {name for module in MODULES for name in imported(module)}
    run = (file for file in WORKFLOW if file.parent.name in ("workflow", "study"))
    targets |= {name for file in run for name, _ in absolute_imports(file, "workflow")}
    tops = {name.partition(".")[0] for name in targets} - {"roughslip", "workflow"} - sys.stdlib_module_names
    assert {PACKAGES.get(name, name) for name in tops} - declared == set()


def test_pieces_stay_small_and_named_by_their_subject():
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    wrong = []
    for file in [*MODULES.values(), *WORKFLOW]:
        source = file.read_text(encoding="utf-8")
        if re.search(r"utils?|helpers?|misc", file.stem) or (
            len(source.splitlines()) > MODULE_LINES and file.name not in TABLES
        ):
            wrong.append(file.name)
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, functions) and node.end_lineno - node.lineno >= FUNCTION_LINES:
                wrong.append(f"{file.name}: {node.name}")
    assert wrong == []


KEY = re.compile(r"[a-z_]+(?:\.[a-z_0-9]+)+|\bseed\b")


def test_an_error_names_keys_that_a_scene_has():
    """Where a text of the sources announces scene keys."""
    source = "".join(file.read_text(encoding="utf-8") for file in MODULES.values())
    assert not re.search(
        r"; scene keys?: ", source
    )  # an error of the library carries them: its message is for its users
    texts = re.findall(r'(?:keys=|keys = |KEYS? = )"([^"]+)"', source)
    named = {key for text in texts for key in KEY.findall(text)}
    assert named <= set(dict(keys()))
    assert {key.partition(".")[0] for key in named} >= {"expansion", "roughness", "strip"}


def test_locks_agree_hold_what_is_declared_and_have_no_address():
    """Else the tools for checks, or the public solvers, would change what computes."""
    run, groups = EXTRAS["study"] + EXTRAS["plot"] + EXTRAS["scans"], PROJECT["dependency-groups"]
    declared = {"": PROJECT["project"]["dependencies"] + run, "-dev": groups["dev"], "-docs": groups["docs"]}
    declared |= {f"-{name}": EXTRAS[name] for name in ("cluster", "peers")}
    locks = {name: (ROOT / f"requirements{name}.lock").read_text(encoding="utf-8") for name in declared}
    pins = {name: dict(re.findall(r"(?m)^([\w.-]+)==([^\\\n]+?) \\$", lock)) for name, lock in locks.items()}
    for name, needed in declared.items():
        assert names(needed) <= names(list(pins[name]))
        shared = pins[""].keys() & pins[name].keys()
        assert [pins[name][package] for package in shared] == [pins[""][package] for package in shared]
        assert name == "-dev" or shared == pins[""].keys()  # the others are complete environments
        assert re.findall(r"https?:|file:|git\+|index-url|find-links| @ ", locks[name]) == []
    assert (names(groups["dev"]) | names(EXTRAS["peers"])) & pins[""].keys() == set()


def test_the_version_is_the_same_everywhere():
    citation = re.search(r"(?m)^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8")).group(1)
    assert {PROJECT["project"]["version"], citation} == {roughslip.__version__}
