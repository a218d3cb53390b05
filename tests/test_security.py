"""The source runs no text from users and no objects from files.

The lock files against pyproject.toml and against each other; one version everywhere.
"""

import ast
import re
import tomllib
from pathlib import Path

import pytest

import roughslip

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted([*(ROOT / "src").rglob("*.py"), *(ROOT / "workflow").rglob("*.py")])
RULES = [ROOT / "Snakefile", *sorted((ROOT / "workflow/rules").glob("*.smk"))]

# Calls that run text, or objects from files.
RUNS_TEXT = {"eval", "exec", "compile", "os.system", "os.popen", "subprocess.getoutput", "subprocess.getstatusoutput"}
UNPICKLES = {"pickle.load", "pickle.loads", "marshal.load", "marshal.loads", "shelve.open"}
UNSAFE_YAML = {"yaml.load", "yaml.load_all", "yaml.unsafe_load", "yaml.full_load"}
IMPORTS = {"pickle", "marshal", "shelve", "dill", "joblib", "cloudpickle"}


def called(node: ast.Call) -> str:
    return ast.unparse(node.func)


def taken(node: ast.AST) -> list[str]:
    """Modules that an import statement names."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""] if isinstance(node, ast.ImportFrom) else []


def offences(source: str) -> list[str]:
    """Lines that run text or objects of others."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            if called(node) in RUNS_TEXT | UNPICKLES | UNSAFE_YAML:
                found.append(f"{node.lineno}: {called(node)}")
            stated = [keyword.arg for keyword in node.keywords]
            if called(node) == "np.load" and "allow_pickle" not in stated:
                found.append(f"{node.lineno}: np.load")
            for keyword in node.keywords:
                if keyword.arg in ("shell", "allow_pickle") and not (
                    isinstance(keyword.value, ast.Constant) and keyword.value.value is False
                ):
                    found.append(f"{node.lineno}: {keyword.arg}={ast.unparse(keyword.value)}")
        elif IMPORTS & {name.partition(".")[0] for name in taken(node)}:
            found.append(f"{node.lineno}: import")
    return found


def test_nothing_runs_text_or_objects_of_others():
    assert {file.name: lines for file in FILES if (lines := offences(file.read_text(encoding="utf-8")))} == {}


@pytest.mark.parametrize(
    "source",
    ["eval(x)", "import os\nos.system(x)", "run(x, shell=True)", "run(x, shell=y)", "np.load(x)", "import pickle",
     "from pickle import loads", "load(x, allow_pickle=True)", "yaml.load(x)"],
)  # fmt: skip
def test_each_offence_is_seen(source):
    assert offences(source)


@pytest.mark.parametrize("file", RULES, ids=lambda file: file.name)
def test_shell_lines_quote_every_path(file):
    """`:q` on inputs, outputs and logs. Parameters are quoted where they are made; wildcards have patterns."""
    text = file.read_text(encoding="utf-8")
    assert [use for use in re.findall(r"\{((?:input|output|log)[^}]*)\}", text) if not use.endswith(":q")] == []
    shells = "\n".join(re.findall(r"shell:\n(.*?)(?:\n\n|\Z)", text, re.DOTALL))
    assert shells.count("exec ") + shells.count("{params.command}") == text.count("shell:")
    for use in re.findall(r"\{((?:wildcards)[^}]*)\}", shells):
        assert use in ("wildcards.scene", "wildcards.design", "wildcards.first", "wildcards.last", "wildcards.stage")
    made = [line for line in text.splitlines() if re.search(r'f"--\w+ \{', line)]
    assert [line for line in made if "shlex.quote(" not in line] == []


LOCKS = {path.name: path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("requirements*.lock"))}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]


def normal(name: str) -> str:
    """The name of a package as registries compare it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def pins(name: str) -> dict[str, set[str]]:
    """Package -> its requirement lines: version and marker. Every requirement must be an exact pin with hashes."""
    found: dict[str, set[str]] = {}
    for block in re.split(r"\n(?=\S)", LOCKS[name]):
        if block.strip() and not block.startswith("#"):
            package, pin = re.fullmatch(r"([\w.-]+)==([^\\]+?) \\", block.splitlines()[0]).groups()
            assert "--hash=sha256:" in block, f"{package} in {name} has no hash"
            found.setdefault(normal(package), set()).add(pin)
    return found


def names(requirements: list[str]) -> set[str]:
    return {normal(re.match(r"[\w.-]+", requirement).group()) for requirement in requirements}


@pytest.mark.parametrize("name", sorted(LOCKS.keys() - {"requirements.lock"}))
def test_another_lock_holds_what_a_run_needs_alike(name):
    """Else the tools for checks, or the public solvers, would change what computes."""
    run, other = pins("requirements.lock"), pins(name)
    shared = run.keys() & other.keys()
    assert {package: other[package] for package in shared} == {package: run[package] for package in shared}
    assert name == "requirements-dev.lock" or shared == run.keys()  # the others are complete environments


def test_a_cluster_takes_the_plug_in_alone_beside_the_run():
    added = pins("requirements-cluster.lock").keys() - pins("requirements.lock").keys()
    assert added == {"snakemake-executor-plugin-slurm", "snakemake-executor-plugin-slurm-jobstep"}


@pytest.mark.parametrize("name", sorted(LOCKS.keys() - {"requirements-dev.lock", "requirements-docs.lock"}))
def test_one_version_of_each_package_on_every_python(name):
    """So that a result does not depend on which supported Python made it."""
    assert [package for package, found in pins(name).items() if len(found) > 1] == []


def test_every_declared_dependency_is_locked_and_no_lock_has_an_address():
    declared = {
        "requirements.lock": PROJECT["project"]["dependencies"] + EXTRAS["study"] + EXTRAS["plot"] + EXTRAS["scans"],
        "requirements-cluster.lock": EXTRAS["cluster"],
        "requirements-peers.lock": EXTRAS["peers"],
        "requirements-dev.lock": PROJECT["dependency-groups"]["dev"],
        "requirements-docs.lock": PROJECT["dependency-groups"]["docs"],
    }
    assert declared.keys() == LOCKS.keys()
    assert {name for lock, needed in declared.items() for name in names(needed) - pins(lock).keys()} == set()
    others = names(PROJECT["dependency-groups"]["dev"]) | names(EXTRAS["peers"])
    assert others & pins("requirements.lock").keys() == set()
    for text in LOCKS.values():
        assert re.findall(r"https?:|file:|git\+|index-url|find-links| @ ", text) == []


def test_the_version_is_the_same_everywhere():
    citation = re.search(r"(?m)^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8")).group(1)
    assert {PROJECT["project"]["version"], citation} == {roughslip.__version__}
