"""The benchmark of generic expansions: its functions by plain sums, its rows whole, its peer on the same candidates."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from workflow.benchmarks import chaos_generic
from workflow.benchmarks.chaos_generic import ADAPTIVE, PROBLEMS, QUICK, morris, rows_of
from workflow.benchmarks.chaos_generic_peers import PEERS, Lars
from workflow.benchmarks.measure import OURS


def morris_by_sums(x):
    w = {}
    for i in range(1, 21):
        unit = (x[i - 1] + 1) / 2
        w[i] = 2 * (1.1 * unit / (unit + 0.1) - 0.5) if i in (3, 5, 7) else x[i - 1]
    total = sum((20 if i <= 10 else (-1) ** i) * w[i] for i in w)
    for i in range(1, 21):
        for j in range(i + 1, 21):
            total += (-15 if j <= 6 else (-1) ** (i + j)) * w[i] * w[j]
            total += sum(-10 * w[i] * w[j] * w[k] for k in range(j + 1, 6) if j <= 5)
    return total + 5 * w[1] * w[2] * w[3] * w[4]


def test_the_morris_function_is_its_sums():
    x = np.random.default_rng(1).uniform(-1, 1, (5, 20))
    np.testing.assert_allclose(morris(x), [morris_by_sums(point) for point in x], rtol=1e-12)


def test_every_method_has_a_row_of_every_case():
    rows, refused = rows_of(QUICK, ())
    assert refused == {}
    assert [(row["case"].rpartition("=")[2], row["method"]) for row in rows] == [
        (samples, method) for samples in ("60", "100") for method in (OURS, ADAPTIVE)
    ]
    assert all(0 < row["error"] < 1 and row["repeats"] == len(row["errors"]) == len(row["terms"]) for row in rows)
    assert [row["repeats"] for row in rows] == [2, 2, 1, 1]


def test_the_judge_knows_a_perfect_expansion_and_the_mean():
    problem = PROBLEMS[0]
    ((points, target, judge),) = chaos_generic.designs_of(problem, 50, 1)
    assert np.array_equal(problem.function(points), target)
    assert judge(problem.function) == 0
    assert judge(lambda x: np.full(len(x), 3.5)) == pytest.approx(1.0, rel=1e-3)  # the mean of Ishigami is a / 2


def test_a_refused_design_is_told():
    rows, refused = rows_of(replace(QUICK, samples=((10, 1),)), ())
    assert rows == []
    assert all("too few to choose" in why for why in refused.values())
    assert len(refused) == 2


def test_openturns_has_the_same_candidates_and_finds_a_polynomial():
    pytest.importorskip("openturns", reason="a peer: make benchmark PEERS=1")
    assert list(PEERS) == ["openturns/lars"]
    for problem in PROBLEMS:
        peer = Lars(problem.families, problem.degree, problem.norm)
        assert peer.exponents() == {tuple(row) for row in problem.basis.indices.tolist()}
    peer = Lars(("hermite", "legendre"), 3, 1.0)
    points = np.random.default_rng(2).uniform(-1, 1, (60, 2))
    model, terms = peer(points, points[:, 0] * points[:, 1])
    assert terms < 10
    assert model(np.array([[0.5, -0.5]]))[0] == pytest.approx(-0.25, abs=1e-9)
    assert math.isfinite(model(points).sum())
