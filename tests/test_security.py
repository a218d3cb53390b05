"""The source runs no text from users and no objects from files."""

import ast
import re
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_nothing_runs_text_or_objects_of_others(file):
    assert offences(file.read_text(encoding="utf-8")) == []


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
