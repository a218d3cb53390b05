"""The lock files against pyproject.toml and against each other; one version everywhere."""

import re
import tomllib
from pathlib import Path

import pytest

import roughslip

ROOT = Path(__file__).resolve().parents[1]
LOCKS = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("requirements.lock", "requirements-dev.lock")}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


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


def test_what_both_locks_hold_they_hold_alike():
    """Else installing the tools for checks would change what computes."""
    run, dev = pins("requirements.lock"), pins("requirements-dev.lock")
    shared = run.keys() & dev.keys()
    assert {name: dev[name] for name in shared} == {name: run[name] for name in shared}


def test_one_version_of_each_package_on_every_python():
    """So that a result does not depend on which supported Python made it."""
    assert [name for name, found in pins("requirements.lock").items() if len(found) > 1] == []


@pytest.mark.parametrize("name", LOCKS)
def test_locks_hold_no_address(name):
    assert re.findall(r"https?:|file:|git\+|index-url|find-links| @ ", LOCKS[name]) == []


def test_every_declared_dependency_is_locked():
    assert names(PROJECT["project"]["dependencies"]) - pins("requirements.lock").keys() == set()
    assert names(PROJECT["dependency-groups"]["dev"]) - pins("requirements-dev.lock").keys() == set()


def test_tools_for_checks_stay_out_of_the_run():
    assert names(PROJECT["dependency-groups"]["dev"]) & pins("requirements.lock").keys() == set()


def test_the_version_is_told_alike():
    citation = re.search(r"(?m)^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8")).group(1)
    assert {PROJECT["project"]["version"], citation} == {roughslip.__version__}
