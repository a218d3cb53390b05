"""The cost of an accuracy: the plain way and the true error against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from workflow.benchmarks import chain
from workflow.benchmarks.runner import make_row
from workflow.evidence.rows import case


def test_strips_of_the_plain_way():
    """Strips of one window with mu uniform on [1, 2], equal at all penetrations but for a factor.

    The influences on the logarithms are (mu - 1.5) / 1.5 and ((mu - 1.5)^2 - 1/12) / (1/6). They are uncorrelated, with
    variances 1/27 and 1/5. In units of the mean at the median the scatter has the variance 1/5 + 1/27, the mean none.
    Of 20000 strips it is known to 1 %. At 5 % penetration a scatter that counts nowhere.
    """
    mu = np.random.default_rng(5).uniform(1.0, 2.0, (20000, 1))
    valid = np.ones_like(mu, dtype=bool)
    solved = [(mu**9, valid), (1.1 * mu, valid), (mu, valid)]
    scatter = chain.scatter_of_strip(solved, np.array([5.0, 20.0, 50.0]))
    assert scatter == pytest.approx(math.sqrt(1 / 5 + 1 / 27), rel=0.02)
    strips = chain.count_strips(scatter, 0.01)
    assert 1.96 * scatter / math.sqrt(strips) == pytest.approx(0.01)
    assert chain.count_strips(scatter, 0.005) == pytest.approx(4 * strips)


def test_the_plain_way_takes_the_cheapest_cells_at_the_same_error():
    """At 0.03 cells that leave 0.01 need (0.03 - 0.02)^2 / (0.03 - 0.01)^2 = 1/4 of the strips of those at 0.02."""
    for seconds, chosen in ((3.9, 1.0), (4.1, 2.0)):
        cells = {2.0: chain.PlainCells(0.02, 1.0), 1.0: chain.PlainCells(0.01, seconds)}
        cell, strips = chain.cheapest_cells(cells, 0.5, 0.03)
        assert cell == chosen
        assert strips == pytest.approx(chain.count_strips(0.5, 0.03 - 0.01 * cell))
    assert chain.cheapest_cells(cells, 0.5, 0.01) is None


def test_the_true_error_is_net_of_the_extrapolation_and_of_the_unit():
    """Ours is the reference in another unit, its scatter before the extrapolation 3 % off at 80 % and 100 % at 5 %."""
    reference = {"percentile": np.array([5.0, 20.0, 50.0, 80.0])}
    reference |= {"mean": np.array([4.0, 3.0, 2.0, 1.0]), "std": np.array([0.4, 0.3, 0.2, 0.1])}
    reference |= {
        f"{name}_standard_error": np.array([1e-2, 2e-2, 3e-2, 4e-2]) * reference[name] for name in ("mean", "std")
    }
    changes = {"mean": np.array([0.02, 0.01, 0.0, -0.01]), "std": np.array([0.1, -0.1, 0.05, 0.02])}
    off = {"mean": np.ones(4), "std": np.array([2.0, 1.01, 1.0, 0.97])}
    found = {"percentile": reference["percentile"]}
    for name, change in changes.items():
        found[f"mesh_change_of_{name}"] = change
        found[f"combined_{name}"] = 0.15 * reference[name] * off[name] * (1.0 + change)
    assert chain.find_true_error(found, reference) == pytest.approx((0.03, 4e-2))


def test_the_exponent_is_that_of_a_power_law():
    """Ours costs asked^-1.3; the plain way ten times as much."""
    rows = []
    for asked in (0.1, 0.03, 0.01):
        name, seconds = case(scene="mine", asked=asked), asked**-1.3
        rows.append(make_row(name, chain.OURS, asked, [seconds], 1))
        rows.append(make_row(name, chain.PLAIN, asked, [10 * seconds], 1))
    found = chain.summarise(rows)
    assert found["exponent"] == pytest.approx(1.3)
    assert found["plain_over_ours"] == pytest.approx({row["case"]: 10.0 for row in rows})
