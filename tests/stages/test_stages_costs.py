"""Sums of costs over jobs, and counts of what solves and motions left out."""

import math
from itertools import islice

import numpy as np
import pytest

from roughslip.chaos.hermite import multi_indices
from roughslip.contact.influence import DIRECT_SUM_LIMIT, Influence
from roughslip.contact.solve import solve, sweep
from roughslip.grid import Grid
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import LOOPS, counts_by_period
from roughslip.oscillator.motion import ensemble_counts
from roughslip.oscillator.path import KeptPath
from roughslip.stages.costs import total
from roughslip.stages.from_scene import elastic
from roughslip.stages.runtime import skip_reasons


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


def test_a_job_too_short_for_the_clock_on_a_platform_that_measures_no_memory():
    (row, _) = total([record("a", 0.0, 0.0, None)], {})
    assert (row["core_share"], row["peak_memory_mib"]) == (0.0, None)


def test_what_was_not_computed_adds_up_and_stages_that_did_not_run_stand_in_the_last_row():
    """Counts of zero are kept too."""
    skips = [{"solves: no contact": 0, "nodes: below the plane": 7}, {"solves: no contact": 0}, {"rows: turned": 2}]
    stages = ("contact", "contact", "chaos")
    records = [record(stage, 1.0, 1.0, 1.0) | {"skipped": one} for stage, one in zip(stages, skips, strict=True)]
    chaos, contact, everything = total(records, {"spacing": "given", "design": "not asked for"})
    assert contact["skipped"] == {"nodes: below the plane": 7, "solves: no contact": 0}
    assert everything["skipped"] == {**contact["skipped"], **chaos["skipped"]}
    assert everything["not_needed"] == {"design": "not asked for", "spacing": "given"}
    assert "not_needed" not in chaos


def summit(n: int, radius: float) -> tuple[Influence, np.ndarray]:
    """A paraboloid that stands over the plane on a disc of so many nodes' radius, in the middle of n x n."""
    x = np.arange(n) - n // 2
    return Influence(Grid(n, n, 1e-6, 1e-6), 1e11), 1e-9 * (radius**2 - x[:, None] ** 2 - x**2)


def counted(*solutions) -> dict[str, int]:
    counts = elastic.empty_skip_counts()
    for solution in solutions:
        elastic.count_solve(counts, solution)
    return {name: number for name, number in counts.items() if number}


def test_no_contact_is_no_solve():
    influence, gap = summit(16, 3.0)
    assert counted(solve(influence, gap - 1e-6)) == {skip_reasons.NO_CONTACT: 1}
    assert set(elastic.empty_skip_counts()) == set(skip_reasons.OF_SOLVES)


def test_few_nodes_are_solved_alone_and_summed_one_by_one():
    influence, u_bar = summit(16, 3.0)
    found = solve(influence, u_bar)
    inside = np.count_nonzero(u_bar > 0)
    assert (found.method, found.nodes, found.start) == ("dense", inside, "none")
    assert counted(found) == {skip_reasons.BELOW: 256 - inside, skip_reasons.SUMMED: 1}
    influence, u_bar = summit(32, 9.0)
    found = solve(influence, u_bar)
    assert np.count_nonzero(found.pressure) > DIRECT_SUM_LIMIT
    assert counted(found, found) == {skip_reasons.BELOW: 2 * (1024 - np.count_nonzero(u_bar > 0))}


def test_what_cannot_touch_is_cropped():
    """A square of 57 nodes holds the disc; 57^2 < 64^2 starts from nothing."""
    influence, u_bar = summit(128, 28.5)
    found = solve(influence, u_bar)
    assert (found.method, found.nodes, found.start) == ("fft", 57**2, "zero")
    assert counted(found) == {skip_reasons.CROPPED: 128**2 - 57**2}


def test_sweeps_start_warm_and_large_meshes_from_coarser_ones():
    influence, u_bar = summit(128, 90.0)
    found = sweep(influence, u_bar, [0.0, -1e-7, -2e-7])
    assert [one.start for one in found] == ["nested", "given", "given"]
    assert counted(*found) == {skip_reasons.NESTED: 1, skip_reasons.WARM: 2}


def test_periods_that_are_counted_and_not_followed():
    """A run by the period ends behind its first cycle: half a period of stick, and LOOPS of slip at D = 0.17."""
    belt, law = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3)
    followed = counts_by_period(belt, law, 100.0, [0.17, 0.17])
    assert ensemble_counts(belt, law, None, 0.0, 100.0, [0.17, 0.17]).periods == 200.0
    first = (belt.F * law.static - 2 * belt.damping_ratio * belt.V) / belt.V / (2 * math.pi)
    assert followed.periods == pytest.approx(2 * (first + LOOPS / math.sqrt(1 - 0.17**2)))


def test_nodes_that_runs_have_asked_for():
    pieces = [np.zeros(10), np.zeros(7), np.zeros(5)]
    path = KeptPath(pieces)
    assert path.nodes == 0
    for _ in range(2):
        np.concatenate(list(islice(path, 2)))
        assert path.nodes == 17


def test_terms_that_a_basis_leaves_out():
    assert skip_reasons.forbidden_terms(multi_indices(8, 3), 3) == 0
    assert skip_reasons.forbidden_terms(multi_indices(8, 3)[:75], 3) == 90
