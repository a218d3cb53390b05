"""Who may import whom, and how large a piece may be: read from the source, so that the design holds itself."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

from workflow.lib.closure import absolute_imports

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src"
FILES = sorted((SOURCE / "roughslip").rglob("*.py"))
WORKFLOW = sorted((ROOT / "workflow").rglob("*.py"))
LIBRARY = [file for file in WORKFLOW if file.parent.name == "lib"]
SUBJECTS = ("surface", "contact", "chaos", "friction", "oscillator")

# The ceilings; a module of one subject is better at 100 to 300 lines.
MODULE_LINES = 400
FUNCTION_LINES = 70

# Import names whose packages are called otherwise.
PACKAGES = {"yaml": "pyyaml", "netCDF4": "netcdf4", "SurfaceTopography": "surfacetopography"}


def module_of(file: Path) -> str:
    parts = file.relative_to(SOURCE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(file): file for file in FILES}


def imported(module: str) -> set[str]:
    """What a module imports: modules, and for `from a import b` both a.b where that is a module, else a."""
    found = set()
    for target, names in absolute_imports(MODULES[module], module):
        submodules = {f"{target}.{name}" for name in names} & MODULES.keys()
        found |= submodules if names and len(submodules) == len(names) else {target} | submodules
    return found


def importers_of(*packages: str) -> set[str]:
    return {module for module in MODULES if any(name.partition(".")[0] in packages for name in imported(module))}


def within(name: str, package: str) -> bool:
    return name == package or name.startswith(f"{package}.")


@pytest.mark.parametrize("subject", SUBJECTS)
def test_a_subject_imports_only_errors_arrays_grid_and_itself(subject):
    """Arrays pass between the subjects in the stages."""
    allowed = {"roughslip.errors", "roughslip.arrays", "roughslip.grid"}
    package = f"roughslip.{subject}"
    wrong = {
        f"{module} imports {name}"
        for module in MODULES
        if within(module, package)
        for name in imported(module)
        if within(name, "roughslip") and name not in allowed and not within(name, package)
    }
    assert wrong == set()


def test_errors_arrays_and_grid_stand_at_the_bottom():
    assert {name for name in imported("roughslip.errors") if within(name, "roughslip")} == set()
    for module in ("roughslip.arrays", "roughslip.grid"):
        assert {name for name in imported(module) if within(name, "roughslip")} <= {"roughslip.errors"}


def test_only_store_knows_the_file_format():
    """Strangers' scans may be netCDF files too; results are read and written by the store alone."""
    assert importers_of("xarray") == {"roughslip.store"}
    assert importers_of("netCDF4") <= {"roughslip.store", "roughslip.scan_file"}
    assert importers_of("SurfaceTopography") == {"roughslip.scan_file"}


def test_only_figures_know_plotting():
    """Importing it costs more than a second, which no other stage should pay."""
    assert {m for m in importers_of("seaborn", "matplotlib") if not m.rpartition(".")[2].startswith("figures")} == set()


def test_the_package_does_not_know_the_workflow():
    assert importers_of("snakemake", "workflow") == set()


def test_only_the_workflow_reads_whole_scenes():
    """A stage that imported the scene would run again on every edit of what other stages read."""
    scene = {module for module in MODULES if module.startswith("roughslip.scene")}
    assert {module for module in MODULES.keys() - scene if imported(module) & scene} == set()


def test_nothing_imports_a_stage_that_is_a_command():
    """Else an edit of one stage would re-run another; what stages share stands in modules that are no command."""
    commands = {module for module, file in MODULES.items() if '__name__ == "__main__"' in file.read_text("utf-8")}
    assert {f"{module} imports {name}" for module in MODULES for name in imported(module) & commands} == set()


def test_imports_are_statements():
    """The hash of a stage's code cannot see any other import."""
    hidden = re.compile(r"import_module|__import__|\bexec\(|\beval\(")
    assert {module for module, file in MODULES.items() if hidden.search(file.read_text("utf-8"))} == set()


def test_what_is_imported_is_declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    lines = project["project"]["dependencies"] + project["project"]["optional-dependencies"]["scans"]
    declared = {re.match(r"[\w.-]+", line).group().lower() for line in lines}
    targets = {name for module in MODULES for name in imported(module)}
    targets |= {name for file in LIBRARY for name, _ in absolute_imports(file, f"workflow.lib.{file.stem}")}
    tops = {name.partition(".")[0] for name in targets} - {"roughslip", "workflow"} - sys.stdlib_module_names
    assert {PACKAGES.get(name, name) for name in tops} - declared == set()


@pytest.mark.parametrize("file", [*FILES, *WORKFLOW], ids=lambda file: file.relative_to(ROOT).as_posix())
def test_pieces_stay_small_and_named_by_their_subject(file):
    source = file.read_text(encoding="utf-8")
    assert not re.search(r"utils?|helpers?|misc", file.stem)
    assert len(source.splitlines()) <= MODULE_LINES
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    long = {
        node.name: node.end_lineno - node.lineno + 1
        for node in ast.walk(ast.parse(source))
        if isinstance(node, functions) and node.end_lineno - node.lineno + 1 > FUNCTION_LINES
    }
    assert long == {}
