"""The stress campaigns: problems come back by number, the judge is right and catches what is wrong, failures show."""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load
from roughslip.errors import ConvergenceError, ParameterError
from roughslip.grid import Grid
from workflow.benchmarks.measure import fields
from workflow.stress import contact, contact_judge, outcomes
from workflow.stress.contact_judge import Displacement, judge
from workflow.stress.contact_problem import ADVERSARIAL, CONTROLS, RANDOM, Problem, random_problem
from workflow.stress.outcomes import Verdict

MODULUS = 2e11


# Problems.


def test_a_number_makes_the_same_problem_again_and_another_seed_another():
    one, again, other = random_problem(3, 17), random_problem(3, 17), random_problem(4, 17)
    assert np.array_equal(one.heights, again.heights)
    assert replace(one, heights=again.heights) == again
    assert contact.case_of(one) != contact.case_of(other)


def test_problems_cover_what_they_should():
    """Of 1500 problems; 1 of 100 is expected of the rarest, and then none of it has a chance of exp(-15)."""
    problems = [random_problem(5, number) for number in range(1500)]
    grids = [problem.grid for problem in problems]
    assert {problem.surface for problem in problems} == {*RANDOM, *ADVERSARIAL}
    assert {problem.control for problem in problems} == set(CONTROLS)
    assert max(max(grid.shape) for grid in grids) <= 128
    assert min(max(grid.shape) for grid in grids) == 1
    assert any(min(grid.shape) > 110 for grid in grids)
    assert any(grid.nx == 1 and grid.ny > 50 for grid in grids)
    assert any(grid.ny == 1 and grid.nx > 50 for grid in grids)
    aspects = [grid.dx / grid.dy for grid in grids]
    assert 0.01 <= min(aspects) < 0.02 < 50 < max(aspects) <= 100
    scales = [float(problem.labels["scale"]) for problem in problems]
    assert 1e-12 <= min(scales) < 1e-11 < 1e2 < max(scales) <= 1e3
    moduli = [problem.modulus for problem in problems]
    assert 1e-3 <= min(moduli) < 1e-2 < 1e14 < max(moduli) <= 1e15
    caps = [problem.cap for problem in problems if math.isfinite(problem.cap)]
    assert 0.01 <= min(caps) < 0.012 < 8 < max(caps) <= 10
    above = [100 * np.mean(p.heights > p.planes[0]) for p in problems if p.planes and p.grid.size > 100]
    assert min(above) < 1
    assert max(above) == 100
    assert all(np.isfinite(problem.heights).all() for problem in problems)


# The judge's displacements.


@pytest.mark.parametrize(
    ("x", "y", "dx", "dy"), [(0, 0, 1, 1), (1, 0, 1, 1), (1, 2, 1, 1), (30, 2, 10, 0.1), (41, 0, 10, 0.1)]
)
def test_love_is_the_integral(x, y, dx, dy):
    """By adaptive quadrature of 1/r in polar pieces where the cell holds the point; both branches, near and far."""
    found = contact_judge.love(np.array([[x]], dtype=np.longdouble), np.array([[y]], dtype=np.longdouble), dx, dy)
    if x == y == 0:  # of the unit square
        expected = 4 * math.asinh(1)
    else:
        expected, _ = dblquad(
            lambda v, u: 1 / math.hypot(x - u, y - v), -dx / 2, dx / 2, -dy / 2, dy / 2, epsabs=0, epsrel=1e-12
        )
    assert float(found[0, 0]) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("aspect", [0.01, 1.0, 30.0])
def test_the_sum_and_the_transform_agree(aspect, monkeypatch):
    """Below rounding of doubles, which says that it is done in long doubles."""
    grid = Grid(21, 12, aspect, 1.0)
    pressure = np.random.default_rng(2).random(grid.shape)
    plain = Displacement(grid, MODULUS, False)(pressure)
    monkeypatch.setattr(contact_judge, "SUMMED", 1)
    transformed = Displacement(grid, MODULUS, False)(pressure)
    limit = 100 * np.finfo(np.longdouble).eps
    assert float(np.abs(transformed / plain - 1).max()) < limit


def test_a_periodic_cell_is_the_sum_over_its_images():
    """Differences of displacement. Over M images each way, odd powers of 1/M are left: the first goes by extrapolation
    from 6 and 12, the third is below 1e-5."""
    grid = Grid(4, 3, 1.0, 1.5)
    pressure = np.random.default_rng(4).random(grid.shape)

    def summed(images: int) -> np.ndarray:
        period = 2 * images + 1
        wide = Grid(grid.nx * period, grid.ny * period, grid.dx, grid.dy)
        displacement = Displacement(wide, 1.0, False)(np.tile(pressure - pressure.mean(), (period, period)))
        return displacement[images * grid.nx :, images * grid.ny :][: grid.nx, : grid.ny]

    # The windows end at M + 1/2 cells.
    expected = (12.5 * summed(12) - 6.5 * summed(6)) / 6
    found = Displacement(grid, 1.0, True)(pressure)
    assert float(abs(found.sum())) < 1e-15
    off = (found - found[0, 0]) - (expected - expected[0, 0])
    assert float(np.abs(off).max()) < 2e-5 * float(np.ptp(found))


# The judge.


def problem_of(control: str = "plane", load: float | None = None, tolerance: float = 1e-10) -> Problem:
    """A rough surface of 12 x 9 nodes; the plane at its median, or a load."""
    heights = 1e-7 * np.random.default_rng(8).standard_normal((12, 9))
    planes = () if load else (float(np.median(heights)),)
    return Problem(
        0, Grid(12, 9, 1e-6, 2e-6), MODULUS, heights, "white", control, planes, load, math.inf, tolerance, {}
    )


def verdict(problem: Problem, solution: ContactSolution, hardness: float = math.inf) -> Verdict:
    displacement = Displacement(problem.grid, problem.modulus, problem.periodic)
    return judge(problem, displacement, solution, problem.planes[0] if problem.planes else None, hardness)


def solved(problem: Problem, hardness: float = math.inf) -> ContactSolution:
    influence = Influence(problem.grid, problem.modulus, problem.periodic)
    if problem.load is not None:
        return solve_load(influence, problem.heights, problem.load, problem.tolerance, hardness_pa=hardness)
    return solve(influence, problem.heights - problem.planes[0], problem.tolerance, hardness_pa=hardness)


def names(found: Verdict) -> set[str]:
    return {what.split(":")[0] for what in found.broken}


PLANE, LOAD, PERIODIC = problem_of(), problem_of("load", 1e9), problem_of("periodic-load", 1e9)
SOFT = 5e9  # a cap that a third of the pressed nodes reach


@pytest.mark.parametrize("problem", [PLANE, LOAD, PERIODIC], ids=["plane", "load", "periodic"])
@pytest.mark.parametrize("hardness", [math.inf, SOFT], ids=["elastic", "capped"])
def test_what_is_right_passes(problem, hardness):
    solution = solved(problem, hardness)
    found = verdict(problem, solution, hardness)
    assert found.broken == ()
    assert found.residual <= 1e-10
    assert bool(solution.plastic_displacement.any()) is math.isfinite(hardness)


def test_the_residual_of_nothing_is_one():
    """min(gap, B_00 p) with p = 0 is -u_bar where u_bar > 0."""
    u_bar = PLANE.heights - PLANE.planes[0]
    nothing = ContactSolution(np.zeros(u_bar.shape), -u_bar, np.zeros(u_bar.shape), 0.0, 0.0, 0, "none", 0, "none")
    found = verdict(PLANE, nothing)
    assert found.residual == pytest.approx(1.0, rel=1e-15)
    assert names(found) == {"the residual", "gap >= 0"}


def changed(solution: ContactSolution, field: str, node: tuple, value: float) -> ContactSolution:
    values = getattr(solution, field).copy()
    values[node] = value
    return replace(solution, **{field: values})


def test_false_claims_are_caught():
    """Every field of a right solution spoilt in turn; small faults are a hundred times the tolerance."""
    elastic, capped = solved(PLANE), solved(PLANE, SOFT)
    u_bar = PLANE.heights - PLANE.planes[0]
    pressed, open_ = (tuple(np.argwhere(mask)[0]) for mask in (elastic.contact, ~elastic.contact))
    between = tuple(np.argwhere(capped.contact & (capped.pressure < SOFT))[0])
    at_cap = tuple(np.argwhere(capped.plastic_displacement > 0)[0])
    small = 1e-8 * float(np.linalg.norm(np.maximum(u_bar, 0)))  # [m]
    rate = Displacement(PLANE.grid, MODULUS, False).diagonal
    p = float(elastic.pressure[pressed])
    spoilt = {
        "the residual": (changed(elastic, "pressure", pressed, p + small / float(rate)), math.inf),
        "p >= 0": (changed(elastic, "pressure", open_, -1e-300), math.inf),
        "p <= H": (changed(capped, "pressure", at_cap, np.nextafter(SOFT, math.inf)), SOFT),
        "gap >= 0": (changed(capped, "plastic_displacement", at_cap, 0.0), SOFT),
        "gap = 0 where p > 0": (changed(elastic, "pressure", open_, 1e-6 * p), math.inf),
        "u_plastic >= 0": (changed(capped, "plastic_displacement", at_cap, -1e-30), SOFT),
        "u_plastic = 0 where p < H": (changed(capped, "plastic_displacement", between, 1e-30), SOFT),
        "its gap is B p - u_bar + u_plastic": (changed(elastic, "gap", open_, 2 * elastic.gap[open_]), math.inf),
        "its residual": (replace(elastic, residual=2e-10), math.inf),
    }
    for name, (solution, hardness) in spoilt.items():
        assert name in names(verdict(PLANE, solution, hardness)), name
    assert "fields of another shape, or not finite" in names(verdict(PLANE, changed(elastic, "gap", open_, math.nan)))


@pytest.mark.parametrize("problem", [LOAD, PERIODIC], ids=["free", "periodic"])
def test_false_claims_under_a_load_are_caught(problem):
    solution = solved(problem)
    assert names(verdict(replace(problem, load=(1 + 1e-11) * problem.load), solution)) == {"the load"}
    reach = float(np.linalg.norm(np.maximum(problem.heights - solution.plane, 0)))
    moved = names(verdict(problem, replace(solution, plane=solution.plane + 1e-8 * reach)))
    assert {"the residual", "gap = 0 where p > 0"} <= moved


def test_another_modulus_or_cell_is_caught():
    """A solver whose influence matrix is off by 1e-8 makes all its residuals small, but not the judge's."""
    u_bar = PLANE.heights - PLANE.planes[0]
    for grid, modulus in ((PLANE.grid, MODULUS * (1 + 1e-8)), (Grid(12, 9, 1e-6, 2e-6 * (1 + 1e-7)), MODULUS)):
        off = solve(Influence(grid, modulus), u_bar)
        assert "the residual" in names(verdict(PLANE, off))


# Outcomes.


def failing(error: Exception):
    def judged() -> Verdict:
        raise error

    return judged


def test_outcomes():
    def made(judged, tolerance: str = "1e-10") -> tuple[str, float | None, bool]:
        row = outcomes.problem_row("contact", f"number=1 tolerance={tolerance}", judged)
        return row["outcome"], row["residual"], "why" in row

    def warned() -> Verdict:
        np.array([1e308]) * 10
        return Verdict(0.0)

    assert made(lambda: Verdict(1e-11)) == ("converged", 1e-11, False)
    assert made(lambda: Verdict(math.inf, ("the load: 1 for 0",))) == ("false claim", None, True)
    assert made(failing(ConvergenceError("no", 1e-9, 7))) == ("ConvergenceError", 1e-9, True)
    assert made(failing(ConvergenceError("no", 1e-11, 7)), "1e-12") == ("ConvergenceError", 1e-11, False)
    assert made(failing(ConvergenceError("no", 1e-9, 7)), "1e-12") == ("ConvergenceError", 1e-9, True)
    assert made(failing(ParameterError("no"))) == ("ParameterError", None, True)
    assert made(failing(ZeroDivisionError())) == ("ZeroDivisionError", None, True)
    assert made(warned) == ("RuntimeWarning", None, True)
    assert made(lambda: warnings.warn("slow", UserWarning, stacklevel=1)) == ("UserWarning", None, True)


def test_bad_input_must_meet_a_parameter_error():
    def made(call) -> tuple[str, bool]:
        row = outcomes.refusal_row("contact", "input=bad", call)
        return row["outcome"], "why" in row

    assert made(failing(ParameterError("no"))) == ("ParameterError", False)
    assert made(failing(ConvergenceError("no", 1.0, 1))) == ("ConvergenceError", True)
    assert made(failing(ValueError("no"))) == ("ValueError", True)
    assert made(lambda: None) == ("accepted", True)


# The campaign.


@pytest.fixture(scope="module")
def rows() -> list[outcomes.Row]:
    return outcomes.campaign(contact.rows_of, outcomes.SEED, range(100), jobs=1)


def test_a_hundred_problems_without_a_failure(rows):
    assert [fields(row["case"])["number"] for row in rows] == [f"{number}" for number in range(100)]
    assert outcomes.failures(rows) == []


def test_processes_change_nothing(rows):
    assert outcomes.campaign(contact.rows_of, outcomes.SEED, range(30), jobs=2) == rows[:30]


def test_all_bad_input_is_refused():
    refused = contact.refused()
    assert len(refused) > 100
    assert outcomes.failures(refused) == []


def test_the_file_and_its_summary(rows, tmp_path):
    wrong = outcomes.problem_row("contact", rows[0]["case"], failing(OverflowError("too far")))
    all_ = [*rows, wrong]
    path = tmp_path / "stress" / "contact.json"
    outcomes.write(path, all_, outcomes.summary(all_, contact.CLASSES), {"contact": 1})
    told = json.loads(path.read_text())
    assert told["rows"] == all_
    assert (told["problems"], told["failures"], told["seeds"]) == (101, len(outcomes.failures(all_)), {"contact": 1})
    assert sum(entry["problems"] for entry in told["summary"]) == 101
    assert sum(entry["failures"] for entry in told["summary"]) == told["failures"]
    assert any(entry["outcomes"].get("OverflowError") == 1 for entry in told["summary"])
    assert all((entry["worst_residual_over_tolerance"] or 0) <= 1.0001 for entry in told["summary"])
    assert all(row.keys() - {"why"} == {"stage", "case", "outcome", "residual"} for row in told["rows"])


def test_a_failure_is_told_by_its_number_and_ends_the_command_with_one(capsys, monkeypatch):
    def broken(seed: int, number: int) -> list[outcomes.Row]:
        verdict_ = Verdict(1.0, ("p >= 0: 1 for 0",) if number == 4 else ())
        return [outcomes.problem_row("contact", f"number={number} tolerance=1e-3", lambda: verdict_)]

    monkeypatch.setattr("sys.argv", ["stress", "--problems", "6"])
    assert outcomes.command("", "contact", broken, list, ()) == 1
    assert "false claim: number=4 tolerance=1e-3: p >= 0: 1 for 0" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["stress", "--only", "3", "5"])
    assert outcomes.command("", "contact", broken, list, ()) == 0
