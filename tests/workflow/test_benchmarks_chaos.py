"""The chaos benchmark: the square against its reference, and multilevel sums."""

from __future__ import annotations

import itertools
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtr

from roughslip.contact.solve import solve
from roughslip.figures.style import save
from workflow.benchmarks import chaos, chaos_figure, chaos_multilevel
from workflow.benchmarks.chaos_problem import Reference, Square
from workflow.benchmarks.chaos_summary import LIMITS, beside_limits
from workflow.benchmarks.measure import OURS
from workflow.keys.evidence_keys import evidence_key, measured_scenes

ROOT = Path(__file__).resolve().parents[2]


# The centre of the square.


def linear_reference(error: float) -> Reference:
    """Contact with probability 0.1, then a pressure uniform on (0, 1)."""
    numbers = {"contact_probability": (0.1, 0.0), "mean_pressure": (0.05, 0.03), "quantile_50": (0.5, 0.0)}
    numbers |= {"quantile_90": (0.9, 0.0), "quantile_99": (0.99, 0.0)}
    return Reference(np.array([0.0, 1.0]), np.array([0.9, 1.0]), np.full(2, error), numbers)


def test_the_distance_is_the_largest_of_both_sides_of_every_step():
    """Ten pressures in a hundred at 0.3: the step is 0.03 below and 0.07 above the reference."""
    pressure = np.repeat([0.0, 0.3], [90, 10])
    assert linear_reference(0.0).distance(pressure).net == pytest.approx(0.07)
    assert linear_reference(0.0).distance(np.repeat([0.0, 0.8], [90, 10])).net == pytest.approx(0.08)  # below the step
    often = np.concatenate([np.zeros(70), np.linspace(0.01, 0.99, 30)])
    assert linear_reference(0.0).distance(often).net == pytest.approx(0.201)  # the atom at zero, and up to 0.01
    assert linear_reference(0.042).distance(pressure).net == pytest.approx(math.sqrt(0.07**2 - 0.042**2))
    assert linear_reference(0.08).distance(pressure).net == 0


def test_errors_are_relative_net_and_signed():
    found = linear_reference(0.0).differences(np.repeat([0.0, 0.3, 0.6], [80, 10, 10]))
    errors = {name: one.net for name, one in found.items()}
    assert found["mean_pressure"] == (pytest.approx(0.8), pytest.approx(0.6))
    assert errors["contact_probability"] == pytest.approx(1.0)
    assert errors["mean_pressure"] == pytest.approx(math.sqrt(0.04**2 - 0.03**2) / 0.05)
    assert errors["quantile_90"] == pytest.approx(-1 / 3)
    assert math.isnan(linear_reference(0.0).differences(np.zeros(10))["quantile_50"].net)


@pytest.fixture(scope="module")
def paper() -> Square:
    return Square.of("paper")


def test_every_design_is_what_its_name_says(paper):
    """A Latin hypercube has a sample in each of K strata, scrambled Sobol points in each of a power of two."""
    for name in ("latin_hypercube", "sobol"):
        strata = np.floor(ndtr(paper.design(name, 64, 1)) * 64)
        assert all(np.array_equal(np.sort(column), np.arange(64)) for column in strata.T)
    assert np.array_equal(paper.design("sobol", 40, 1), paper.design("sobol", 64, 1)[:40])
    pool = paper.design("monte_carlo", 20, 0)
    assert np.array_equal(paper.design("monte_carlo", 10, 1), pool[10:])
    assert not np.isin(pool[0], paper.design("monte_carlo", 20, 1)).any()


def test_solves_are_those_of_the_study_and_the_central_nodes_come_first(paper):
    solved = paper.solved(paper.design("monte_carlo", 3, 0))
    expected = solve(paper.influence, paper.surface(solved.xi[2]) - paper.planes[1], 1e-10).pressure
    assert paper.central == 4
    np.testing.assert_allclose(solved.pressure[2, 1], expected[paper.nodes.x, paper.nodes.y], rtol=1e-5, atol=1e2)
    assert np.all(paper.nodes.distance2[: paper.central] < 1e-12)


def test_each_surface_is_solved_once_and_parts_do_not_meet(paper):
    """A pool of 40 Monte Carlo samples is one design of 40 and four of 10."""
    plan = chaos.Plan({10: 2, 40: 1}, 1, 1, 1)
    found = [(kind, number, len(part.xi), part.xi[0, 0]) for kind, number, part in plan.designs(paper)]
    of_pool = [entry for entry in found if entry[0] == "monte_carlo"]
    assert [(number, count) for _, number, count, _ in of_pool] == [(0, 10), (1, 10), (2, 10), (3, 10), (0, 40)]
    assert len({start for *_, start in of_pool}) == 4
    assert [entry[1:3] for entry in found if entry[0] == "sobol"] == [(0, 10), (0, 40)]
    assert [entry[1:3] for entry in found if entry[0] == "latin_hypercube"] == [(0, 10), (1, 10), (0, 40)]


def as_a_row(errors: dict) -> dict:
    return {"errors": errors, "seen": errors, "reference_errors": dict.fromkeys(errors, 0.0)}


def test_the_limits_are_held_by_the_median_and_by_nine_in_ten():
    good = {name: [0.5 * limit] * 20 for name, limit in LIMITS.items()}
    assert all(one["met"] for one in beside_limits(as_a_row(good)).values())
    outliers = {**good, "distance": [0.005] * 17 + [0.03] * 3, "mean_pressure": [-0.02] * 20}
    outliers |= {"quantile_50": [0.01] * 18 + [None] * 2, "quantile_99": [0.01] * 17 + [None] * 3}
    met = {name: one["met"] for name, one in beside_limits(as_a_row(outliers)).items()}
    assert [name for name, fine in met.items() if not fine] == ["distance", "mean_pressure", "quantile_99"]


# Multilevel Monte Carlo.


def test_the_allocation_spends_the_budget_and_tells_the_error_that_it_leaves():
    variances, costs = np.array([4.0, 0.5, 0.1]), np.array([0.1, 1.0, 7.0])
    counts, error = chaos_multilevel.allocation(variances, costs, 50.0)
    assert counts @ costs == pytest.approx(50.0)
    assert np.sum(variances / counts) == pytest.approx(error**2)
    moved = counts + np.array([10.0, -1.0, 0.0])  # of equal cost: no better
    assert np.sum(variances / moved) > error**2


def test_the_terms_of_the_levels_add_up_to_the_fine_mesh(paper):
    """Of one surface; meshes of 10 and 5 nodes cover the same square."""
    meshes = [chaos_multilevel.Mesh(paper, stride) for stride in (2, 1)]
    edges = [mesh.influence.grid.nx * mesh.influence.grid.dx for mesh in meshes]
    assert edges == [pytest.approx(6e-4)] * 2
    terms, _ = chaos_multilevel.samples_of(meshes, 1, float(paper.planes[2]), 3)
    for number, term in enumerate(terms):
        xi = np.random.default_rng([paper.seed, chaos_multilevel.STREAM, 2, 1, number]).standard_normal(100)
        pressures = []
        for mesh in meshes:
            z = np.tensordot(xi, mesh.modes, 1)
            pressures.append(solve(mesh.influence, z - paper.planes[2]).pressure)
        expected = [pressures[1].mean() - pressures[0].mean(), np.mean(pressures[1] > 0) - np.mean(pressures[0] > 0)]
        np.testing.assert_allclose(term, expected, rtol=1e-4)


# The file.


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory) -> dict:
    path = tmp_path_factory.mktemp("chaos") / "chaos.json"
    command = [sys.executable, "-m", "workflow.benchmarks.chaos", "--quick", "--output", str(path)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return json.loads(path.read_text())


def test_the_whole_benchmark(benchmark):
    rows = benchmark["rows"]
    assert len({(row["case"], row["method"], row["work"]) for row in rows}) == len(rows)
    for percentile in (20, 50, 80):
        of_case = [row for row in rows if row["case"] == f"scene=paper percentile={percentile} quantity=pressure"]
        found = {(row["method"], row["work"]) for row in of_case if not row["method"].startswith("equation")}
        assert found == set(itertools.product((*chaos.DIRECT, OURS), (250, 500)))
        assert all(row["error"] == np.median(row["errors"]["distance"]) for row in of_case)
        assert all(row["error"] < 0.05 for row in of_case if row["method"] in (*chaos.DIRECT, OURS))
        assert all(len(errors) == row["repeats"] for row in of_case for errors in row["errors"].values())
    assert any("equation_8 250" in name for name in benchmark["summary"]["refused"])  # fewer contacts than terms
    assert {row["case"].partition(" ")[0] for row in rows} == {"scene=paper", "scene=resolved"}


def test_multilevel_estimates_are_those_of_plain_monte_carlo(benchmark):
    """Within four standard errors of a pilot of ten surfaces a level, which itself is known to a quarter."""
    pairs: dict[str, list] = {}
    for row in benchmark["rows"]:
        if "variances" in row:
            pairs.setdefault(row["case"], []).append(row)
    assert len(pairs) == 6
    for plain, multilevel in pairs.values():
        error = math.hypot(plain["standard_error"], multilevel["standard_error"])
        assert abs(plain["estimate"] - multilevel["estimate"]) < 4 * error
        assert plain["gain"] == 1
        assert len(multilevel["variances"]) == 3


def test_its_figure_is_the_same_at_every_drawing(benchmark, tmp_path):
    for name in ("one.svg", "two.svg"):
        save(chaos_figure.figure(benchmark["rows"]), tmp_path / name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


def test_what_is_measured_is_in_the_key(empty, tmp_path, monkeypatch):
    """Stages that are imported as `from roughslip.stages import elastic` too, the scenes and their references."""
    project = empty.copy(tmp_path / "copy")
    monkeypatch.chdir(project.folder)
    scenes = {"paper": {"seed": 1}, "mine": {"seed": 1}}

    def key() -> str:
        lock = project.path("requirements.lock")
        more = measured_scenes("chaos", scenes)
        return project.path(evidence_key("benchmarks", "chaos", project.folder, lock, **more)).read_text()

    def append(file):
        with project.path(file).open("a") as source:
            source.write("\n_edited = 1\n")

    project.path("results/reference/paper").mkdir(parents=True)
    first = key()
    for change, changes in (
        (lambda: append("src/roughslip/chaos/local.py"), True),
        (lambda: append("src/roughslip/stages/from_scene/elastic.py"), True),
        (lambda: append("src/roughslip/friction/process.py"), False),
        (lambda: append("workflow/benchmarks/chaos_figure.py"), False),
        (lambda: project.path("results/reference/paper/pressure.nc").write_bytes(b"new"), True),
        (lambda: scenes["mine"].update(seed=2), False),
        (lambda: scenes["paper"].update(seed=2), True),
    ):
        change()
        assert (key() != first) is changes
        first = key()
