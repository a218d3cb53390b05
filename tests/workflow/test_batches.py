"""Results do not depend on batches or on the number of jobs, and hold their configuration and code hash."""

from __future__ import annotations

import json
import re
from collections import Counter

import netCDF4
import pytest

from roughslip.scene.declarations import declarations
from roughslip.scene.plan import stages_needed
from workflow.study.scenes import Scenes

pytestmark = pytest.mark.slow

# Strips two by two, so that those that train fall into two batches.
SPLIT = """\
extends: tiny
jobs: 4
"""
BATCHED = {"contact/square-*": 12, "contact/strip-*": 4, "friction/expansion-*": 4, "oscillator/ensemble-*": 4}

# What sums up batches; one figure, as figures draw what is stored in these.
SUMMED_UP = (
    *("chaos/square.nc", "chaos/strip.nc", "friction/statistics.nc", "summary.csv"),
    *("oscillator/deterministic.nc", "oscillator/statistics.nc", "figure5.nc", "figure5.png", "figure5.svg"),
    "claims.json",
)


@pytest.fixture(scope="module")
def both(shared):
    """The scene made in large batches by one job at a time, and in small ones by two: other names from there on."""
    shared.scene("split", SPLIT)
    shared.make("-j2", *(f"results/split/{name}" for name in SUMMED_UP))
    return shared.path("results/tiny"), shared.path("results/split")


def test_results_are_the_same_bit_for_bit(both):
    """Each result that combines batches."""
    tiny, split = both
    assert [name for name in SUMMED_UP if (tiny / name).read_bytes() != (split / name).read_bytes()] == []


def test_the_batches_were_others(both):
    tiny, split = both
    for pattern, count in BATCHED.items():
        stored = split.parent.glob(f"store/*/*/{pattern}")
        counts = sorted(Counter(path.parents[1].name for path in stored).values())
        assert counts[-1] == count  # of `split`
        assert len(list(tiny.glob(pattern))) < count


def test_every_result_carries_what_made_it(shared):
    folder, found = shared.path("results/tiny"), set()
    for stage in stages_needed(Scenes(shared.folder, ["tiny"])["tiny"]):
        key = json.loads((folder / f"keys/{stage}.json").read_text())
        for path in folder.glob(re.sub(r"\{.*\}", "*", declarations()[stage].result)):
            if path.suffix == ".nc":
                found.add(path)
                with netCDF4.Dataset(path) as result:
                    assert json.loads(result.configuration) == key["configuration"]
                    assert result.code_hash == key["code"]
                    assert result.seed == str(key["configuration"].get("seed", "none used"))
                    assert {"python", "numpy", "scipy", "numba"} <= set(json.loads(result.versions))
                    labels = [variable.ncattrs() for variable in result.variables.values()]
                    assert all({"units", "long_name"} <= set(names) for names in labels)
    assert found == set(folder.rglob("*.nc"))
