"""What the study cost: sums over jobs."""

import pytest

from roughslip.stages.costs import total


def record(stage, cpu, core, peak, **did):
    numbers = {"cpu_seconds": cpu, "wall_seconds": 2 * cpu, "core_cpu_seconds": core, "peak_memory_mib": peak}
    return {"stage": stage, "jobs": 1, **numbers, "did": did, "skipped": {}}


def test_seconds_and_counts_add_up_and_memory_is_that_of_the_largest_job():
    rows = total(
        [
            record("friction", 4.0, 3.0, 100.0, windows=10),
            record("contact", 10.0, 9.0, 300.0, solves=3, convolutions=40),
            record("contact", 20.0, 18.0, 250.0, solves=4),
        ],
        {},
    )
    assert [row["stage"] for row in rows] == ["contact", "friction", "all"]
    contact, friction, everything = rows
    assert contact == {
        "stage": "contact",
        "jobs": 2,
        "cpu_seconds": 30.0,
        "wall_seconds": 60.0,
        "core_cpu_seconds": 27.0,
        "core_share": 0.9,
        "peak_memory_mib": 300.0,
        "did": {"convolutions": 40, "solves": 7},
        "skipped": {},
    }
    assert friction["core_share"] == 0.75
    assert (everything["jobs"], everything["cpu_seconds"], everything["core_share"]) == (3, 34.0, pytest.approx(0.882))
    assert everything["did"] == {"convolutions": 40, "solves": 7, "windows": 10}


def test_a_platform_that_does_not_tell_its_memory():
    known, mixed, unknown, everything = total(
        [
            record("a", 1.0, 1.0, 5.0),
            record("b", 1.0, 1.0, None),
            record("b", 1.0, 1.0, 7.0),
            record("c", 1.0, 1.0, None),
        ],
        {},
    )
    assert [row["peak_memory_mib"] for row in (known, mixed, unknown, everything)] == [5.0, 7.0, None, 7.0]


def test_a_job_too_short_for_the_clock():
    (row, _) = total([record("a", 0.0, 0.0, 1.0)], {})
    assert row["core_share"] == 0.0


def test_what_was_not_computed_adds_up_and_stages_that_did_not_run_stand_in_the_last_row():
    """Also that something never occurred is told."""
    skips = [{"solves: no contact": 0, "nodes: below the plane": 7}, {"solves: no contact": 0}, {"rows: turned": 2}]
    stages = ("contact", "contact", "chaos")
    records = [record(stage, 1.0, 1.0, 1.0) | {"skipped": one} for stage, one in zip(stages, skips, strict=True)]
    chaos, contact, everything = total(records, {"spacing": "given", "design": "not asked for"})
    assert contact["skipped"] == {"nodes: below the plane": 7, "solves: no contact": 0}
    assert everything["skipped"] == {**contact["skipped"], **chaos["skipped"]}
    assert everything["not_needed"] == {"design": "not asked for", "spacing": "given"}
    assert "not_needed" not in chaos
