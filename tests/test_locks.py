"""The lock files against pyproject.toml and against each other; one version everywhere."""

import re
import tomllib
from pathlib import Path

import pytest

import roughslip

ROOT = Path(__file__).resolve().parents[1]
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
