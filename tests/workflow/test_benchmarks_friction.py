"""The friction benchmark: its judges against known ensembles, and a small run of the whole."""

import json
import math
import sys

import numpy as np
import pytest

from roughslip.figures.style import save
from workflow.benchmarks import friction, friction_figure
from workflow.benchmarks.measure import fields


def test_judge_of_the_correlation():
    """Alternating signs have the autocorrelation (-1)^lag; constants of either sign have 1 at every lag."""
    signs = np.tile([1.0, -1.0], (3, 50))
    assert friction.correlation_error(signs, 4) == pytest.approx(1.0 + math.exp(-1 / 4))
    still = np.array([[1.0], [-1.0]]) * np.ones((2, 100))
    assert friction.correlation_error(still, 4) == pytest.approx(1.0 - math.exp(-4))


def test_judge_of_the_marginal():
    """Uniform values at the middles of 1000 cells are right to half a cell, and wrong by as much as they are moved."""
    values = math.sqrt(12.0) * ((np.arange(1000) + 0.5) / 1000 - 0.5)
    assert friction.marginal_distance(values, 1.0, 1.0) <= 0.5 / 1000 + 1e-12
    assert friction.marginal_distance(values + 0.1 * math.sqrt(12.0), 1.0, 1.0) == pytest.approx(0.1, abs=1e-3)


def test_a_small_run_measures_and_draws(tmp_path, monkeypatch):
    """Every method on every case; errors of 16 paths of 16 lengths are some 1 / sqrt(128) at most times four."""
    monkeypatch.setattr(sys, "argv", ["friction", "--quick", "--output", str(tmp_path / "friction.json")])
    friction.main()
    benchmark = json.loads((tmp_path / "friction.json").read_text())
    rows = benchmark["rows"]
    assert len(rows) == 6
    assert {row["method"] for row in rows} == set(friction_figure.MARKERS)
    assert [row["work"] for row in rows] == [int(fields(row["case"])["paths"]) * 64 for row in rows]
    assert all(row["error"] < 4 / math.sqrt(128) for row in rows if row["work"] == 16 * 64)
    assert set(benchmark["summary"]["points_per_second"]) == set(friction_figure.MARKERS)
    save(friction_figure.figure(rows), tmp_path / "friction.png")
    assert (tmp_path / "friction.png").stat().st_size > 10_000
