"""The cost of the chain beside the plain way: plain methods against ours, counts of samples against closed forms."""

import dataclasses
import math

import numpy as np
import pytest

from roughslip import store
from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve
from roughslip.friction.recursion import recursion
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.motion import simulate
from workflow.benchmarks import chain_plain
from workflow.benchmarks.chain_cost import Stage, Work, median_count, samples_for, together
from workflow.benchmarks.chain_cost_stages import LEVEL, square_counts, strip_counts
from workflow.benchmarks.contact_problem import MODULUS, square, surface
from workflow.benchmarks.oscillator import LAW, PROCESS, STUDY


def test_the_plain_contact_is_ours():
    """At a residual of 1e-10 and another modulus, which scales the pressure; the next surface with the same setting."""
    influence, rough = Influence(square(32), 3 * MODULUS), surface("gauss", square(32))
    plain = chain_plain.PlainContact.of(square(32), rough - np.median(rough), 1e-10)
    for plane in (np.median(rough), np.quantile(rough, 0.8)):
        ours = solve(influence, rough - plane, 1e-12).pressure
        found, products = plain.solve(square(32), rough - plane, 3 * MODULUS)
        assert np.linalg.norm(found - ours) < 1e-8 * np.linalg.norm(ours)
        assert products > 10


@pytest.mark.parametrize("damping", [0.1, 0.17])
def test_the_plain_motion_counts_the_same_cycles(damping):
    """On a smooth path, where both are far from the limit of the cycle: five periods hold four or five cycles, and both
    stick again at one point, to what scipy errs by at the nodes."""
    belt = dataclasses.replace(STUDY, damping_ratio=damping)
    paths = recursion(PROCESS, PROCESS.correlation_length_m / 2)
    path = next(iter(paths.realisation([1, 0], 2000)))
    ours = simulate(belt, LAW, path, paths.spacing, 5.0, 1e-8)
    found = chain_plain.motion(belt, LAW, path, paths.spacing, 5.0, 1e-8)
    assert found.cycles == ours.cycles >= 4
    assert found.evaluations > 1000
    assert found.stuck_m == pytest.approx(ours.position[ours.kind == REATTACHMENT][-1], rel=1e-3)
    late = chain_plain.motion(belt, LAW, path, paths.spacing, 5.0, 1e-8, belt.F * LAW.static - 0.01 * belt.V)
    assert late.cycles >= found.cycles


def test_scipys_tolerance_is_the_loosest_that_errs_as_little():
    tolerance, ours, plain = chain_plain.tolerance_of_the_same_error(1e-6, 4)
    assert 0.0 < plain <= ours < 1e-4
    slip = chain_plain.slips(4)[1]
    exact, *_ = chain_plain.ours(slip, "dormand_prince853", 1e-13)
    looser = chain_plain.TOLERANCES[chain_plain.TOLERANCES.index(tolerance) - 1]
    assert abs(chain_plain.theirs(slip, chain_plain.METHOD, looser)[0] / exact - 1.0) > ours


def test_samples_go_with_the_square_of_the_error():
    assert samples_for(0.01, 100, 0.1) == pytest.approx(10_000)
    assert samples_for(0.0, 100, 0.1) == math.inf
    assert median_count({"a": 5.0, "b": 1.0, "c": 100.0}) == 5.0


def test_the_chain_is_the_sum_of_its_stages():
    """Ours 3 + 10 s, plain 100 + 1000 s, or 100 + 160 s at the tolerance asked."""
    stages = [
        Stage("a", "solves", Work(2, 1.0, 1.0), Work(100, 1.0), "so", {"mean": 100.0}),
        Stage("b", "periods", Work(10, 1.0), Work(10, 100.0), "so", as_asked=Work(10, 16.0)),
    ]
    found = together("mine", stages)
    assert (found["ours_seconds"], found["plain_seconds"]) == (13.0, 1100.0)
    assert found["ratio"] == pytest.approx(1100 / 13)
    assert found["ratio_at_the_tolerance_asked"] == pytest.approx(260 / 13)
    assert found["met"] is False
    told = stages[0].told("mine")
    assert (told["ratio"], told["ratio_at_the_tolerance_asked"]) == (pytest.approx(100 / 3),) * 2
    assert stages[1].told("mine")["ratio_at_the_tolerance_asked"] == 16.0


def test_strips_of_the_plain_way(tmp_path):
    """Strips of one window with mu uniform on [1, 2]: the mean has the relative error sqrt(1/12) / 1.5 / sqrt(K).

    Of 400 strips 20 groups tell a standard deviation to 16 %, K to a third: two of these are allowed.
    """
    area = np.random.default_rng(5).uniform(1.0, 2.0, (400, 1, 1))
    force = np.ones_like(area)
    summary = "percentile,combined_mean,combined_mean_low,combined_mean_high,combined_std,combined_std_low,"
    summary += "combined_std_high\n50,1.5,1.4706,1.5294,0.3,0.28824,0.31176\n"  # 1 % and 2 %
    (tmp_path / "summary.csv").write_text(summary)
    counts = strip_counts(area, force, 0.5, tmp_path / "summary.csv", [50.0])
    expected = 1 / 12 / 1.5**2 / 0.01**2
    assert counts["mean_50"] == pytest.approx(expected, rel=0.7)
    assert counts["std_50"] == pytest.approx(
        0.2 / 0.02**2, rel=0.7
    )  # Var s^2 = (1.8 - 1) sigma^4 / K, half of it for s


def test_surfaces_of_the_plain_way(tmp_path):
    """A reference of 1000 surfaces that knows all numbers to 3 %, an expansion that errs by 3 % and 4 %: 360 surfaces.

    Of what the expansion misses the reference by, the error of the reference is taken out.
    """
    level = np.array([1.0, 2.0, 4.0])
    variables = {"surfaces": store.Variable((), 1000, "1", "surfaces")}
    for name in ("contact_probability", "mean_pressure"):
        variables[name] = store.Variable(("level",), level, "1", name)
        variables[f"{name}_standard_error"] = store.Variable(("level",), 0.03 * level, "1", name)
    probability = np.array([0.5, 0.9, 0.99])
    variables["probability"] = store.Variable(("probability",), probability, "1", "of the quantiles")
    quantiles = level[:, None] * probability
    variables["quantile"] = store.Variable(("level", "probability"), quantiles, "1", "quantiles")
    variables["quantile_standard_error"] = store.Variable(("level", "probability"), 0.06 * quantiles, "1", "errors")
    store.write(tmp_path / "pressure.nc", variables, store.Key({}, "any"))
    names = ("contact_probability", "mean_pressure", "quantile_50", "quantile_90", "quantile_99")
    rows = []
    for name in names:
        of = {"case": f"scene=mine number={name}"}
        rows.append(of | {"method": "expansion", "error": math.hypot(0.04, 0.01), "standard_error": 0.01})
        rows.append(of | {"method": "sampling", "error": 0.03})
    counts = square_counts(rows, tmp_path / "pressure.nc")
    assert LEVEL == 1
    assert counts["mean_pressure"] == counts["contact_probability"] == pytest.approx(360.0)
    assert counts["quantile_90"] == pytest.approx(4 * 360.0)
