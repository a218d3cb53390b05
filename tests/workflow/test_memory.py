"""Memory of jobs: what a stage declares holds what was measured, and grows at each attempt."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from roughslip.scene.declarations import declarations
from workflow.study.commands import NODE_MB, asked_mb, machine_mb

ROOT = Path(__file__).resolve().parents[2]
MIB = 1.048576  # MB


@pytest.mark.parametrize("name", ["paper", "resolved"])
def test_stages_declare_a_tenth_more_than_the_kept_runs_took(name):
    for row in json.loads((ROOT / f"results/reference/{name}/costs.json").read_text()):
        if row["stage"] != "all":
            assert 1.1 * MIB * row["peak_memory_mib"] < declarations()[row["stage"]].memory_mb, row["stage"]


def test_a_job_of_a_cluster_asks_for_more_at_each_attempt_and_never_for_more_than_a_node_has():
    """The second attempt holds the peak of contact_square on 1024 x 1024 nodes in 95 modes, 1812 MB."""
    once = declarations()["contact_square"].memory_mb + NODE_MB
    assert [asked_mb("contact_square", attempt, 4000) for attempt in (1, 2, 3)] == [once, 4 * once, 4000]
    assert [asked_mb("contact_square", attempt, 32_000) for attempt in (1, 2, 3)] == [once, 4 * once, 16 * once]
    assert 4 * once > 1812
    assert asked_mb("contact_square", 1, None) == once - NODE_MB
    assert 500 < machine_mb() < 10_000_000
