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


@pytest.mark.parametrize("name", ["requirements-dev.lock", "requirements-peers.lock", "requirements-cluster.lock"])
def test_what_another_lock_shares_with_the_run_it_holds_alike(name):
    """Else installing the tools for checks, or the public solvers, would change what computes."""
    run, other = pins("requirements.lock"), pins(name)
    shared = run.keys() & other.keys()
    assert {package: other[package] for package in shared} == {package: run[package] for package in shared}


@pytest.mark.parametrize("name", ["requirements-peers.lock", "requirements-cluster.lock"])
def test_all_that_a_run_needs_is_there_beside_others(name):
    """Peers are measured in one process with it, and a job on a cluster is a run."""
    assert pins("requirements.lock").keys() - pins(name).keys() == set()


def test_a_cluster_takes_the_plug_in_alone_beside_the_run():
    added = pins("requirements-cluster.lock").keys() - pins("requirements.lock").keys()
    assert added == {"snakemake-executor-plugin-slurm", "snakemake-executor-plugin-slurm-jobstep"}


@pytest.mark.parametrize("name", ["requirements.lock", "requirements-peers.lock", "requirements-cluster.lock"])
def test_one_version_of_each_package_on_every_python(name):
    """So that a result does not depend on which supported Python made it."""
    assert [package for package, found in pins(name).items() if len(found) > 1] == []


@pytest.mark.parametrize("name", LOCKS)
def test_locks_hold_no_address(name):
    assert re.findall(r"https?:|file:|git\+|index-url|find-links| @ ", LOCKS[name]) == []


def test_every_declared_dependency_is_locked():
    assert names(PROJECT["project"]["dependencies"]) - pins("requirements.lock").keys() == set()
    assert names(EXTRAS["scans"]) - pins("requirements.lock").keys() == set()
    assert names(EXTRAS["cluster"]) - pins("requirements-cluster.lock").keys() == set()
    assert names(EXTRAS["peers"]) - pins("requirements-peers.lock").keys() == set()
    assert names(PROJECT["dependency-groups"]["dev"]) - pins("requirements-dev.lock").keys() == set()


def test_tools_for_checks_and_peers_stay_out_of_the_run():
    others = names(PROJECT["dependency-groups"]["dev"]) | names(EXTRAS["peers"])
    assert others & pins("requirements.lock").keys() == set()


def test_the_version_is_told_alike():
    citation = re.search(r"(?m)^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8")).group(1)
    assert {PROJECT["project"]["version"], citation} == {roughslip.__version__}
