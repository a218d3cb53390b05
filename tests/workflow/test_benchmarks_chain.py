"""The error budget and the cost of the chain: paired changes, plain methods and counts against closed forms."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from workflow.benchmarks.chain_budget import (
    Change,
    Friction,
    compare_paired,
    count_cycles,
    read_friction,
    rows_of_source,
    strip_sampling,
)

from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve
from roughslip.friction.recursion import recursion
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.motion import MotionOptions, simulate
from workflow.benchmarks import chain
from workflow.benchmarks.chaos import load_scene
from workflow.benchmarks.contact_problem import MODULUS, square, surface
from workflow.benchmarks.oscillator import LAW, PROCESS, STUDY, TOLERANCES, choose_slips, exact_place, slip_by_scipy

COLUMNS = ("combined_mean", "combined_std", "combined_length_least_squares", "beta_a", "beta_b")
ENDS = [f"{name}{end}{'_m' * ('length' in name)}" for name in COLUMNS for end in ("", "_low", "_high")]
SUMMARY = f"""percentile,{",".join(ENDS)},note
20,0.32,0.3161,0.3239,0.05,0.0402,0.0598,3e-4,3e-4,3e-4,2,2,2,5,5,5,
50,0.3,0.3,0.3,0.04,0.038,0.042,3e-4,2e-4,4e-4,2,1,3,5,4,6,at bound
80,0.28,0.28,0.28,0.02,0.02,0.02,3e-4,3e-4,3e-4,2,2,2,5,5,5,
"""


@pytest.mark.parametrize("scatter", [0.0, 0.1])
def test_the_error_of_a_change_is_that_of_a_ratio_of_means(scatter):
    """A change that all samples share has no error. From twenty groups a standard deviation is known to 16 %; four of
    these are allowed."""
    generator = np.random.default_rng(2)
    better = generator.uniform(1.0, 2.0, 2000)
    rough = 1.03 * better + scatter * generator.standard_normal(2000)
    numbers = [lambda chosen, of=of: {"mean": of[chosen].mean()} for of in (rough, better)]
    (change,) = compare_paired(2000, *numbers).values()
    assert change.value == pytest.approx(better.mean())
    assert change.error == pytest.approx(scatter / math.sqrt(2000) / 1.5, rel=0.64, abs=1e-14)
    assert change.shift == pytest.approx(0.03, abs=4 * change.error + 1e-12)
    (row,) = rows_of_source("mine", "mesh", {"mean": Change(3.0, -0.01, 0.002)}, 1.0, 7, 2.0)
    assert row["case"] == "scene=mine number=mean"
    found = [row[name] for name in ("method", "error", "shift", "standard_error", "value", "work")]
    assert found == ["mesh", 0.02, -0.02, 0.004, 3.0, 7]


def test_sampling_errors_follow_from_the_kept_intervals(tmp_path):
    (tmp_path / "summary.csv").write_text(SUMMARY)
    errors = {row["case"]: row["error"] for row in strip_sampling("mine", tmp_path / "summary.csv")}
    assert len(errors) == 5  # the mean at the median sets the shear strength
    assert errors["scene=mine number=mu_mean_20"] == pytest.approx(0.0039 / 1.96 / 0.32)
    assert errors["scene=mine number=mu_std_20"] == pytest.approx(0.0098 / 1.96 / 0.05)
    friction, error = read_friction(tmp_path / "summary.csv")
    assert friction == Friction(0.3, 0.04, 3e-4, 2.0, 5.0)
    assert error == pytest.approx(Friction(0.0, 0.002 / 1.96, 1e-4 / 1.96, 1 / 1.96, 1 / 1.96))


def test_paths_of_one_seed_are_the_same_at_half_their_nodes():
    """With almost no scatter the counts do not depend on the path at all."""
    scene = load_scene("paper")
    smooth = Friction(0.3, 1e-9, 2.5e-4, 2.1, 5.0)
    found = count_cycles(scene, smooth, 2, 8)
    np.testing.assert_array_equal(found, count_cycles(scene, smooth, 2, 16, 2))
    assert found[0, 0] > 80


# The plain methods.


def test_the_plain_contact_finds_our_pressure():
    """At a residual of 1e-10; a second plane with the same setting."""
    influence, rough = Influence(square(32), MODULUS), surface("gauss", square(32))
    plain = chain.plain_contact(square(32), rough - np.median(rough), 1e-10)
    for plane in (np.median(rough), np.quantile(rough, 0.8)):
        ours = solve(influence, rough - plane, 1e-12).pressure
        assert np.linalg.norm(plain(rough - plane) - ours) < 1e-8 * np.linalg.norm(ours)


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.1, 0.17])
def test_the_plain_motion_counts_the_same_cycles(damping):
    """On a smooth path, far from the limit of the cycle; both reattach at one point, to scipy's error at the nodes."""
    belt = dataclasses.replace(STUDY, damping_ratio=damping)
    paths = recursion(PROCESS, PROCESS.correlation_length_m / 2)
    path = next(iter(paths.realisation([1, 0], 2000)))
    ours = simulate(belt, LAW, path, paths.spacing, 5.0, MotionOptions(1e-8))
    found = chain.simulate_plainly(belt, LAW, path, paths.spacing, 5.0, 1e-8, 0.0)
    assert found.cycles == ours.cycles >= 4
    assert found.evaluations > 1000
    assert found.stuck_m == pytest.approx(ours.position[ours.kind == REATTACHMENT][-1], rel=1e-3)


@pytest.mark.slow
def test_scipys_tolerance_is_the_loosest_with_our_error():
    tolerance, ours, plain = chain.find_equal_tolerance(1e-6, 4)
    assert 0.0 < plain <= ours < 1e-4
    slip = choose_slips(4)[1]
    looser = TOLERANCES[TOLERANCES.index(tolerance) - 1]
    assert abs(slip_by_scipy(slip, chain.METHOD, looser)[0] / exact_place(slip) - 1.0) > ours


# The cost.


def test_the_chain_is_the_sum_of_its_stages():
    """Ours 3 + 10 s; plain 100 + 1000 s, or 100 + 160 s at the tolerance that the scene sets."""
    work = chain.work
    stages = [
        chain.stage_cost("a", "solves", work(2, 1.0, 1.0), work(100, 1.0), "so"),
        chain.stage_cost("b", "periods", work(10, 1.0), work(10, 100.0), "so", work(10, 16.0)),
    ]
    assert [(one["ratio"], one["ratio_at_the_tolerance_asked"]) for one in stages] == [(100 / 3, 100 / 3), (100, 16)]
    found = chain.sum_stages("mine", stages)
    assert (found["ours_seconds"], found["plain_seconds"]) == (13.0, 1100.0)
    assert found["ratio"] == pytest.approx(1100 / 13)
    assert found["ratio_at_the_tolerance_asked"] == pytest.approx(260 / 13)


def test_strips_of_the_plain_method(tmp_path):
    """Strips of one window with mu uniform on [1, 2]: the mean has the relative error sqrt(1/12) / 1.5 / sqrt(K).

    From 20 groups of 400 strips a standard deviation is known to 16 %, K to a third: two of these are allowed.
    """
    area = np.random.default_rng(5).uniform(1.0, 2.0, (400, 1, 1))
    summary = "percentile,combined_mean,combined_mean_low,combined_mean_high,combined_std,combined_std_low,"
    summary += "combined_std_high\n50,1.5,1.4706,1.5294,0.3,0.28824,0.31176\n"  # 1 % and 2 %
    (tmp_path / "summary.csv").write_text(summary)
    counts = chain.count_strips(load_scene("paper"), area, np.ones_like(area), tmp_path / "summary.csv", [50.0])
    assert counts["mu_mean_50"] == pytest.approx(1 / 12 / 1.5**2 / 0.01**2, rel=0.7)
    assert counts["mu_std_50"] == pytest.approx(0.2 / 0.02**2, rel=0.7)  # Var s^2 = 0.8 sigma^4 / K, a quarter for s


def test_surfaces_of_the_plain_method():
    """A reference of 1000 surfaces with errors of 3 % and 6 %, an expansion with errors of 3 % and 4 %.

    The error of the reference is subtracted from the expansion's difference from it.
    """
    reference = SimpleNamespace(surfaces=1000, plain_error={"mean_pressure": 0.03, "quantile_90": 0.06})
    rows = []
    for name in reference.plain_error:
        of = {"case": f"scene=mine number={name}"}
        rows.append(of | {"method": "expansion", "error": math.hypot(0.04, 0.01), "standard_error": 0.01})
        rows.append(of | {"method": "sampling", "error": 0.03})
    counts = chain.count_surfaces(rows, reference)
    assert counts == pytest.approx({"mean_pressure": 360.0, "quantile_90": 4 * 360.0})
