"""The error budget: paired changes against closed forms, and a small run of the whole."""

import json
import math
import sys

import numpy as np
import pytest

from roughslip.figures.style import save
from workflow.benchmarks import chain, chain_figure
from workflow.benchmarks.chain_oscillator import Friction, counts, told
from workflow.benchmarks.chain_problem import Change, jackknifed, rows
from workflow.benchmarks.chain_strips import sampling

COLUMNS = ("combined_mean", "combined_std", "length_least_squares", "beta_a", "beta_b")
ENDS = [f"{name}{end}{'_m' * ('length' in name)}" for name in COLUMNS for end in ("", "_low", "_high")]
SUMMARY = f"""percentile,{",".join(ENDS)}
20,0.32,0.3161,0.3239,0.05,0.0402,0.0598,3e-4,3e-4,3e-4,2,2,2,5,5,5
50,0.3,0.3,0.3,0.04,0.038,0.042,3e-4,2e-4,4e-4,2,1,3,5,4,6
80,0.28,0.28,0.28,0.02,0.02,0.02,3e-4,3e-4,3e-4,2,2,2,5,5,5
"""


def test_a_change_that_all_samples_share_is_known_without_error():
    values = np.random.default_rng(1).uniform(1.0, 2.0, 100)

    def mean(factor):
        return lambda chosen: {"mean": float(factor * values[chosen].mean())}

    (change,) = jackknifed(100, mean(1.03), mean(1.0)).values()
    assert change.shift == pytest.approx(0.03)
    assert change.error < 1e-14
    assert change.value == pytest.approx(values.mean())


def test_the_error_of_a_change_is_that_of_a_ratio_of_means():
    """Twenty groups tell a standard deviation to within 16 %; four of these."""
    generator = np.random.default_rng(2)
    better = generator.uniform(1.0, 2.0, 2000)
    rough = better + 0.1 * generator.standard_normal(2000)
    (change,) = jackknifed(
        2000, lambda chosen: {"mean": rough[chosen].mean()}, lambda chosen: {"mean": better[chosen].mean()}
    ).values()
    assert change.error == pytest.approx(0.1 / math.sqrt(2000) / 1.5, rel=0.64)
    assert abs(change.shift) < 4 * change.error


def test_a_row_tells_the_change_and_its_error_times_the_factor():
    (row,) = rows("mine", "mesh", {"mean": Change(3.0, -0.01, 0.002)}, [1.0], 7, factor=2.0)
    assert row["case"] == "scene=mine number=mean"
    found = [row[name] for name in ("method", "error", "shift", "standard_error", "value", "work")]
    assert found == ["mesh", 0.02, -0.02, 0.004, 3.0, 7]


def test_sampling_is_read_off_the_intervals_that_are_kept(tmp_path):
    (tmp_path / "summary.csv").write_text(SUMMARY)
    errors = {row["case"]: row["error"] for row in sampling("mine", tmp_path / "summary.csv")}
    assert len(errors) == 5  # the mean at the median is what the shear strength is set by
    assert errors["scene=mine number=mu_mean_20"] == pytest.approx(0.0039 / 1.96 / 0.32)
    assert errors["scene=mine number=mu_std_20"] == pytest.approx(0.0098 / 1.96 / 0.05)
    friction, error = told(tmp_path / "summary.csv")
    assert friction == Friction(0.3, 0.04, 3e-4, 2.0, 5.0)
    assert error == pytest.approx(Friction(0.0, 0.002 / 1.96, 1e-4 / 1.96, 1 / 1.96, 1 / 1.96))


def test_a_small_run_measures_and_draws(tmp_path, monkeypatch):
    """Every source of every number of the paper's scene, and no number without its sampling error."""
    monkeypatch.setattr(sys, "argv", ["chain", "--quick", "--output", str(tmp_path / "chain.json")])
    chain.main()
    benchmark = json.loads((tmp_path / "chain.json").read_text())
    found = {}
    for row in benchmark["rows"]:
        found.setdefault(row["case"], set()).add(row["method"])
    assert set(found) == set(benchmark["summary"])
    for case, sources in found.items():
        assert "sampling" in sources
        if "mu_" in case:
            assert {"mesh", "solver tolerance"} < sources
        elif "cycles" in case:
            assert {"path nodes", "integrator", "friction std"} < sources
        else:
            assert {"mesh", "solver tolerance", "expansion"} < sources
        assert sources <= set(chain_figure.SOURCES)
    exact = [row for row in benchmark["rows"] if row["method"] == "solver tolerance"]
    assert max(row["error"] for row in exact) < 1e-5
    stages = benchmark["cost"]["stages"]
    assert [one["stage"] for one in stages] == ["surface", "contact_square", "contact_strip", "oscillator"]
    for one in stages:
        assert one["scene"] == "paper"
        assert one["how"].endswith(".")
        assert one["ratio"] == pytest.approx(one["plain"]["seconds"] / one["ours"]["seconds"])
        assert all(one[way]["seconds_each"] > 0 and one[way]["units"] >= 1 for way in ("ours", "plain"))
    (together,) = benchmark["cost"]["chain"]
    for way in ("ours", "plain"):
        assert together[f"{way}_seconds"] == pytest.approx(sum(one[way]["seconds"] for one in stages))
    assert [one["ours"]["units"] for one in stages] == [1, 1000, 480, 240 * 21 * 100]  # as the scene has them
    assert stages[3]["plain"]["units"] == stages[3]["ours"]["units"]
    save(chain_figure.figure(benchmark["rows"]), tmp_path / "chain.png")
    assert (tmp_path / "chain.png").stat().st_size > 10_000


def test_paths_of_one_seed_are_the_same_at_half_their_nodes():
    """With hardly any scatter the counts do not depend on the path at all."""
    scene = chain.load("paper", chain.ROOT / "config" / "scenes")
    smooth = Friction(0.3, 1e-9, 2.5e-4, 2.1, 5.0)
    found = counts(scene, smooth, 2, 8)
    np.testing.assert_array_equal(found, counts(scene, smooth, 2, 16, 2))
    assert found[0, 0] > 80
