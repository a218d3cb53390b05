"""The benchmarks: time is compared fairly, residuals are judged apart from the solvers, the file says what was done."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve
from roughslip.figures.style import save
from roughslip.grid import Grid
from roughslip.source_hash import absolute_imports
from workflow.benchmarks import contact, contact_figure, contact_problem, measure, tuning
from workflow.benchmarks.contact_peers import PEERS, PolonskyKeer

ROOT = Path(__file__).resolve().parents[2]
TINY = contact.Campaign((16,), (24,), (16,), (16,), levels=("50",), quick=True)


# How time is compared.


def test_methods_take_turns_forwards_and_backwards():
    order = []
    contenders = {
        name: measure.Contender(lambda name=name: order.append(name), seconds=1.0, turns=turns, keep=keep)
        for name, turns, keep in (("ours", 3, False), ("peer", 2, False), ("slow", 2, True))
    }
    seconds = measure.race(contenders)
    assert order == ["ours", "peer", "slow", "peer", "ours", "ours"]
    assert {name: len(times) for name, times in seconds.items()} == {"ours": 3, "peer": 2, "slow": 2}
    assert seconds["slow"][0] == 1.0  # the run before the race


def test_a_fast_method_is_called_many_times_a_turn_and_told_by_the_call():
    clock = iter(np.arange(0.0, 100.0))  # a second passes between looks at the clock
    calls = []
    contenders = {"ours": measure.Contender(lambda: calls.append(1), seconds=1e-4, turns=2)}
    seconds = measure.race(contenders, clock=lambda: next(clock))
    assert len(calls) == 2 * 50  # of 0.1 ms each, in turns of 5 ms
    assert seconds["ours"] == [1 / 50, 1 / 50]


def rows_of(case: str, ours: list[float], peer: list[float], error: float = 1e-11) -> list[measure.Row]:
    return [measure.row(case, "roughslip", 1e-11, ours, 1), measure.row(case, "peer", error, peer, 1)]


def test_a_ratio_is_taken_turn_by_turn():
    """The machine at a third of its speed in the second turn; the peer was too slow for a third one."""
    case = measure.case(n=64, tolerance="1e-10")
    rows = rows_of(case, [1.0, 3.0, 0.5], [20.0, 60.0])
    assert measure.ratios(rows) == {"peer": {case: 20.0}}
    assert [rows[1][key] for key in ("seconds", "seconds_min", "seconds_max", "repeats")] == [40.0, 20.0, 60.0, 2]


def test_the_summary_of_speed():
    rows = [
        *rows_of("n=64 tolerance=1e-10", [1.0], [10.0]),
        *rows_of("n=128 tolerance=1e-10", [1.0], [40.0]),
        *rows_of("n=128 tolerance=1e-6", [1.0], [5.0], error=1e-7),
        *rows_of("n=256 tolerance=1e-10", [1.0], [1.0], error=1e-9),  # it stopped early, so its time says nothing
        *rows_of("n=128 quantity=pressure", [1.0], [1.0]),
    ]
    found = measure.speed_summary(rows)["peer"]
    assert found["geometric_mean"] == pytest.approx({"1e-10": 20.0, "1e-6": 5.0})
    assert found["worst"] == {"case": "n=128 tolerance=1e-6", "ratio": 5.0}
    assert found["missed"] == ["n=256 tolerance=1e-10"]


def test_the_power_of_growth():
    sizes = [64**2, 256**2, 2048**2]
    assert measure.growth_exponent(sizes, [1e-9 * size**1.15 for size in sizes]) == pytest.approx(1.15)


def test_the_peak_of_memory_is_that_of_temporaries():
    """In a process of its own, as the benchmark measures it: the system's peak is that of the process so far."""
    code = "import numpy as np; from workflow.benchmarks.measure import peak_memory as peak;"
    code += "print(*peak(lambda: np.add(np.ones(2**20), np.ones(2**20))))"
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT}"}
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    traced, resident = answer.stdout.split()
    assert float(traced) == pytest.approx(3 * 8 * 2**20, rel=0.01)
    assert resident == "None" or 0.5 < float(resident) / (3 * 8 * 2**20) < 2  # whole pages, freed ones used again


# The file.


def test_names_of_cases():
    name = measure.case(n=128, surface="gauss", tolerance=measure.power(1e-6))
    assert name == "n=128 surface=gauss tolerance=1e-6"
    assert measure.fields(name) == {"n": "128", "surface": "gauss", "tolerance": "1e-6"}
    assert [measure.power(value) for value in (1e-10, 0.01, 2.5e-3)] == ["1e-10", "1e-2", "2.5e-3"]


def test_a_row_without_an_error_is_refused():
    with pytest.raises(ValueError, match="peer at n=1"):
        measure.row("n=1", "peer", math.nan, [1.0], 1)


def test_the_machine_is_told_by_its_processor_alone():
    assert measure.machine().keys() == {"processor", "cores"}
    assert measure.versions(("numpy", "no-such-package")).keys() == {"python", "numpy"}


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "benchmarks" / "contact.json"
    measure.write(path, {"rows": [1]})
    with pytest.raises(ValueError, match="JSON"):
        measure.write(path, {"rows": [math.inf]})
    assert json.loads(path.read_text()) == {"rows": [1]}
    assert [file.name for file in path.parent.iterdir()] == ["contact.json"]


# The judge.


def test_the_judges_convolution_is_the_sum():
    """To rounding: 108 terms of alike size, and transforms of 432 nodes."""
    grid = Grid(12, 9, 1e-6, 2e-6)
    convolution = contact_problem.Convolution(grid, 2e11)
    pressure = np.random.default_rng(5).random(grid.shape)
    assert convolution(pressure) == pytest.approx(convolution.direct_sum(pressure), rel=1e-14)
    assert convolution.direct_sum(pressure) == pytest.approx(Influence(grid, 2e11).apply(pressure), rel=1e-13)


def test_the_residual_is_zero_at_the_solution_and_one_without_pressure():
    """One node above the plane: its pressure is u_bar / B_00."""
    grid = contact_problem.square(8)
    heights = np.full(grid.shape, -1e-6)
    heights[3, 4] = 1e-9
    problem, judge = contact_problem.Problem(grid, heights, 0.0), contact_problem.Judge(grid)
    pressure = np.maximum(heights, 0.0) / judge.convolution.coefficients[0, 0]
    assert judge.residual(problem, np.zeros(grid.shape)) == 1.0
    assert judge.residual(problem, pressure) < 1e-14
    assert judge.residual(problem, 1.5 * pressure) == pytest.approx(0.5)
    pressure[0, 0] = pressure[3, 4]  # pressed without contact: |min(gap, B_00 p)| = B_00 p, and a trace at the other
    assert judge.residual(problem, pressure) == pytest.approx(1.0, rel=0.01)


def test_planes_stand_where_they_should():
    grid = contact_problem.square(32)
    influence = Influence(grid, contact_problem.MODULUS)
    heights = contact_problem.surface("gauss", grid)
    assert np.array_equal(heights, contact_problem.surface("gauss", grid))
    for level in ("5", "50", "95"):
        plane = contact_problem.plane_height(level, heights, influence)
        assert 100 * np.mean(heights > plane) == pytest.approx(float(level), abs=100 / grid.size)
    plane = contact_problem.plane_height("contact90", heights, influence)
    assert solve(influence, heights - plane).area_fraction == pytest.approx(0.9, abs=0.003)


# Peers.


class Told:
    """A peer and a judge in one: the residual is a function of the setting."""

    def __init__(self, residual_at):
        self.residual_at, self.found = residual_at, []

    def solve(self, problem, load, setting, counting=False):
        self.found.append(self.residual_at(setting))
        return self.found[-1], 7

    def residual(self, problem, pressure):
        return pressure


def tuned(residual_at):
    """What tuning to 1e-10 from 1e-9 ends with, and the residuals on the way."""
    told = Told(residual_at)
    return tuning.tune(told, None, 0.0, 1e-10, 1e-9, told), told.found


@pytest.mark.parametrize("factor", [1e-4, 1e-2, 1.0, 30.0])
@pytest.mark.parametrize("power", [0.9, 1.0, 1.1])
def test_a_peer_is_tuned_to_what_just_meets_the_tolerance(factor, power):
    trial, found = tuned(lambda setting: factor * setting**power)
    assert 1e-10 / tuning.BAND <= trial.residual <= 1e-10
    assert trial.residual == found[-1]
    assert len(found) <= 4  # each may take a minute
    assert trial.work == 7


def test_a_peer_that_jumps_over_the_tolerance_gets_the_loosest_setting_to_a_factor_of_two():
    trial, _ = tuned(lambda setting: 1e-3 if setting > 3e-7 else 1e-13)
    assert 1.5e-7 <= trial.setting <= 3e-7


@pytest.mark.parametrize("stalls", [lambda setting: max(setting, 2e-8), lambda setting: 2e-8 + 1e-20 / setting])
def test_a_peer_that_cannot_meet_the_tolerance_is_told_at_its_best(stalls):
    """The second grows worse where its setting is too tight."""
    trial, found = tuned(stalls)
    assert trial.residual == min(found) == pytest.approx(2e-8, rel=1e-2)


def agrees_with_ours(peer, kind, level):
    grid = contact_problem.square(24)
    influence = Influence(grid, contact_problem.MODULUS)
    heights = contact_problem.surface(kind, grid)
    problem = contact_problem.Problem(grid, heights, contact_problem.plane_height(level, heights, influence))
    ours = solve(influence, problem.interference, 1e-12)
    pressure, work = peer(grid).solve(problem, ours.mean_pressure, 1e-11, counting=True)
    assert pressure == pytest.approx(ours.pressure, abs=1e-8 * ours.pressure.max())
    return work


def test_polonsky_keer_finds_our_solution():
    """In 32 and 118 products with B; by steepest descent it would take 52 and 650."""
    assert agrees_with_ours(PolonskyKeer, "gauss", "5") < 40
    assert agrees_with_ours(PolonskyKeer, "gauss", "contact90") < 150


@pytest.mark.parametrize("name", [name for name in PEERS if "/" in name])
def test_public_solvers_find_our_solution(name):
    pytest.importorskip("tamaas" if name.startswith("tamaas") else "ContactMechanics")
    assert agrees_with_ours(PEERS[name], "gauss", "50") > 20  # they are counted: ten steps at least to 11 digits
    assert agrees_with_ours(PEERS[name], "exp", "contact90") > 20


def test_the_package_knows_no_peer():
    peers = {"tamaas", "ContactMechanics"}
    files = (ROOT / "src").rglob("*.py")
    assert [
        file for file in files for name, _ in absolute_imports(file, file.stem) if name.split(".")[0] in peers
    ] == []


# The whole, small.


@pytest.fixture(scope="module")
def benchmark():
    return json.loads(json.dumps(contact.run(TINY, ("polonsky-keer",)), allow_nan=False))


def test_the_whole_benchmark(benchmark):
    rows = benchmark["rows"]
    assert len({(row["case"], row["method"], row.get("setting")) for row in rows}) == len(rows)
    assert all(row["seconds_min"] <= row["seconds"] <= row["seconds_max"] for row in rows)
    assert all(row["work"] > 0 and row["repeats"] == len(row["turns"]) >= 1 for row in rows)
    equal = [row for row in rows if "tolerance" in measure.fields(row["case"])]
    assert all(measure.meets(row) for row in equal)
    assert {row["method"] for row in equal} == {"roughslip", "polonsky-keer", "roughslip/sweep", "roughslip/cold"}
    compared = {row["case"] for row in equal if row["method"] == "polonsky-keer"}
    assert len(compared) == 6  # 10 x 10 of white heights and two surfaces of 16 x 16, each at two tolerances
    assert max(benchmark["checks"]["displacement"].values()) < 1e-13


def test_its_summary(benchmark):
    found = benchmark["summary"]
    assert len(found["times_faster_than"]["polonsky-keer"]["cases"]) == 4
    assert len(found["times_faster_than_on_10_x_10"]["polonsky-keer"]["cases"]) == 2
    assert found["growth"]["seconds"].keys() == {"16", "24"}
    assert len(found["sweep_over_cold"]) == 2
    assert found["missed"] == []
    assert all(memory["traced"] > 1 for memory in found["memory_in_padded_arrays"].values())


def test_pressure_errors_fall_with_the_setting(benchmark):
    errors = {}
    for row in benchmark["rows"]:
        if "quantity=pressure" in row["case"]:
            errors.setdefault(row["method"], []).append((row["setting"], row["error"]))
    assert errors.keys() == {"roughslip", "polonsky-keer"}
    loosest, *_, tightest = (error for _, error in sorted(errors["polonsky-keer"], reverse=True))
    assert tightest < 1e-10 < 1e-4 < loosest


def test_its_figure_is_the_same_at_every_drawing(benchmark, tmp_path):
    for name in ("one.svg", "two.svg"):
        save(contact_figure.figure(benchmark["rows"]), tmp_path / name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
