"""The runner of the benchmarks compares times fairly, and a quick run of each benchmark gives rows and a figure."""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict

import numpy as np
import pytest

from roughslip.figures.style import save
from roughslip.scene.loader import load
from workflow.benchmarks import chain, chaos, contact, oscillator, plot, runner, surface
from workflow.benchmarks.runner import OURS, make_row
from workflow.evidence.rows import fields


def test_methods_take_turns_forwards_and_backwards():
    """One call of each method that may compile, one that estimates its time, and the turns."""
    clock = iter(np.arange(0.0, 1000.0))  # A second passes between two readings.
    order = []
    calls = {name: lambda name=name: order.append(name) for name in ("ours", "peer")}
    seconds, _ = runner.race(calls, clock=lambda: next(clock))
    assert order == ["ours", "ours", "peer", "peer", "ours", "peer", "peer", "ours", "ours", "peer"]
    assert seconds == {"ours": [1.0] * 3, "peer": [1.0] * 3}


def test_a_fast_method_is_called_many_times_a_turn():
    clock = iter(np.arange(0.0, 1.0, 1e-4))
    calls = []
    seconds, _ = runner.race({"ours": lambda: calls.append(1)}, quick=True, clock=lambda: next(clock))
    assert len(calls) == 2 + 50  # calls of 0.1 ms, in one turn of 5 ms
    assert seconds["ours"] == [pytest.approx(1e-4 / 50)]


def rows_of(name: str, ours: list[float], peer: list[float], error: float = 1e-11) -> list[runner.Row]:
    return [make_row(name, "roughslip", 1e-11, ours, 1), make_row(name, "peer", error, peer, 1)]


def test_the_summary_of_speed():
    """Ratios are taken turn by turn: the machine is three times as slow in the second turn of n=64."""
    rows = [
        *rows_of("n=64 tolerance=1e-10", [1.0, 3.0, 0.5], [10.0, 30.0]),
        *rows_of("n=128 tolerance=1e-10", [1.0], [40.0]),
        *rows_of("n=128 tolerance=1e-6", [1.0], [5.0], error=1e-7),
        *rows_of("n=256 tolerance=1e-10", [1.0], [1.0], error=1e-9),  # stopped early, so its time does not count
        *rows_of("n=128 quantity=pressure", [1.0], [1.0]),
    ]
    found = runner.summarise_speed(rows)["peer"]
    assert found["geometric_mean"] == pytest.approx({"1e-10": 20.0, "1e-6": 5.0})
    assert found["worst"] == {"case": "n=128 tolerance=1e-6", "ratio": 5.0}


def test_a_row_without_an_error_is_refused():
    with pytest.raises(ValueError, match="peer at n=1"):
        make_row("n=1", "peer", math.nan, [1.0], 1)


def test_ratios_of_the_oscillator_are_at_equal_error():
    """Ours at 1e-6 in 1 s and at 1e-9 in 2 s, theirs at 1e-7 in 600 s: 300 times as fast, not 600."""
    named = [
        ("roughslip/fehlberg45", 1e-6, 1.0),
        ("roughslip/dormand_prince853", 1e-9, 2.0),
        ("scipy/RK45", 1e-7, 600.0),
    ]
    rows = [
        make_row(f"motion=deterministic asked={number}", method, error, [seconds], 1)
        for number, (method, error, seconds) in enumerate(named)
    ]
    assert oscillator.ratios_at_equal_error(rows) == {"scipy/RK45": {"motion=deterministic asked=2": 300.0}}


# Quick runs.

FEW = [20.0, 50.0, 95.0]  # penetrations


def check(benchmark: str, rows: list[runner.Row]) -> None:
    """Rows are distinct and can be stored and drawn."""
    keys = {(row["case"], row["method"], row["work"], row.get("setting"), row.get("samples")) for row in rows}
    assert len(keys) == len(rows)
    assert all(min(row["turns"]) <= row["seconds"] <= max(row["turns"]) for row in rows)
    assert plot.FIGURES[benchmark](json.loads(json.dumps(rows, allow_nan=False))).axes


def test_contact(tmp_path):
    """10 x 10 nodes of white heights, two surfaces of 16 x 16, one of 24 x 24; errors fall with the setting."""
    sizes = contact.Sizes((16,), (24,), (16,), levels=("50",), quick=True)
    found = contact.measure_sizes(sizes, ("polonsky-keer",))
    rows = found["rows"]
    check("contact", rows)
    equal = [row for row in rows if "tolerance" in fields(row["case"])]
    assert all(runner.is_met(row) for row in equal)
    assert len([row for row in equal if row["method"] == "polonsky-keer"]) == 6
    assert len([row for row in equal if row["method"] == OURS]) == 7
    for summary in found["summary"].values():
        assert summary["polonsky-keer"]["geometric_mean"].keys() == {"1e-6", "1e-10"}
    errors = [(row["setting"], row["error"]) for row in rows if row not in equal and row["method"] == "polonsky-keer"]
    loosest, *_, tightest = (error for _, error in sorted(errors, reverse=True))
    assert tightest < 1e-10 < 1e-4 < loosest
    for file in ("one.svg", "two.svg"):  # the same bytes at every drawing
        save(plot.FIGURES["contact"](rows), tmp_path / file)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


@pytest.mark.slow
def test_surface(monkeypatch):
    """Peers that are our method again. The error of exact samples falls with the square root of their number, whose RMS
    scatters by 20 % over 4 sets of 16. The torus of a self-affine spectrum may add images of 1e-3."""
    for peer in surface.PEERS:
        monkeypatch.setitem(surface.PEERS, peer, surface.set_up_embedding)
    rows = surface.measure_sizes(surface.QUICK._replace(most_samples=64, budget=1.0), tuple(surface.PEERS))["rows"]
    check("surface", rows)
    by_quantity = defaultdict(list)
    for row in rows:
        by_quantity[fields(row["case"]).get("quantity", "modes")].append(row)
    assert len(by_quantity["modes"]) == len(by_quantity["sample"]) == 6
    assert all(runner.is_met(row) for row in by_quantity["modes"])
    for row in by_quantity["sample"]:
        assert row["error"] < (5e-3 if "self_affine" in row["case"] else 1e-9)
    single = {
        (row["case"], row["method"], row["setting"]): row for row in by_quantity["covariance"] if row["samples"] == 1
    }
    for row in by_quantity["covariance"]:
        error = single[row["case"], row["method"], row["setting"]]["error"]
        assert row["error"] == pytest.approx(error / math.sqrt(row["samples"]), rel=0.6)


@pytest.mark.slow
def test_chaos():
    found = chaos.measure(True, False)
    check("chaos", found["rows"])
    for percentile in (20, 50, 80):
        of_case = [row for row in found["rows"] if f"percentile={percentile} " in row["case"]]
        of_case = [row for row in of_case if not row["method"].startswith("equation")]
        assert len({(row["method"], row["work"]) for row in of_case}) == 4 * 2
        assert all(row["error"] == np.median(row["errors"]["distance"]) < 0.05 for row in of_case)
    assert any("equation_8 250" in name for name in found["summary"]["refused"])  # fewer contacts than terms


@pytest.mark.slow
def test_oscillator():
    rows = oscillator.measure(True, False)["rows"]
    check("oscillator", rows)
    assert len(rows) == 2 * 2 * (2 * 2 + 2)
    assert all(row["error"] < 0.1 for row in rows)


@pytest.mark.slow
def test_chain(tmp_path, monkeypatch):
    """By its command, at three penetrations. The true error, less three standard errors of the reference, lies in the
    largest interval; half widths of 30 strips are themselves known to 13 %. Cells follow from the accuracy."""
    scene = chain.changed(load("resolved", chain.ROOT / "config" / "scenes"), strip={"penetration_percentiles": FEW})
    monkeypatch.setattr(chain, "load", lambda *_: scene)
    monkeypatch.setattr(chain, "QUICK", (0.1, 0.05, 0.035))
    monkeypatch.setattr(chain, "LIMIT_S", 9.0)
    monkeypatch.setattr(sys, "argv", ["chain", "--quick", "--output", str(tmp_path / "chain.json")])
    runner.run_command(None, chain.measure)
    benchmark = json.loads((tmp_path / "chain.json").read_text())
    assert benchmark["machine"].keys() == {"processor", "cores"}
    check("chain", benchmark["rows"])
    ours, plain = ([row for row in benchmark["rows"] if row["method"] == one] for one in (OURS, chain.PLAIN))
    assert {row["case"] for row in plain} <= {row["case"] for row in ours}
    assert [row["cell_m"] for row in ours] == [2.5e-6, 1.25e-6]
    for row in ours:
        assert row["error"] < 1.4 * float(fields(row["case"])["asked"])
    (known,) = [row for row in ours if "true_error" in row]
    assert known["true_error"] < known["error"] + 3 * known["reference_error"]
    assert all(0.0 < row["mesh_error"] < row["error"] for row in plain)
    ((name, why),) = benchmark["summary"]["refused"].items()
    assert fields(name)["asked"] == "0.035"
    assert "is not reached" in why
