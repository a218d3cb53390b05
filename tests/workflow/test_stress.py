"""Stress campaigns: judges accept right answers and reject wrong ones, bad input is refused, files are whole."""

from __future__ import annotations

import json
import math
import sys
import warnings
from dataclasses import dataclass, replace

import numpy as np
import pytest

from roughslip.chaos.local import fit_local
from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.friction.marginal import fit_beta
from roughslip.grid import Grid
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.motion import MotionOptions
from roughslip.probability import Estimate
from roughslip.surface.embedding import embed
from roughslip.surface.lanczos import leading_modes
from roughslip.surface.models import covariance_of
from roughslip.surface.modes import karhunen_loeve
from workflow.benchmarks.chain import Run
from workflow.stress import (
    accuracy,
    chaos,
    chaos_strip,
    contact,
    friction,
    oscillator,
    refusals,
    runner,
    surface,
    surface_fit,
)
from workflow.stress.runner import SEED, Verdict, verdict_of

CAMPAIGNS = {campaign.STAGE: campaign for campaign in (surface, contact, chaos, friction, oscillator)}


def names(found: Verdict) -> set[str]:
    return {line.split(":")[0] for line in found.broken}


@dataclass(frozen=True)
class Problem:
    number: int = 1
    tolerance: float = 1e-3


def failing(error: Exception):
    def judged(problem=None) -> Verdict:
        raise error

    return judged


@pytest.mark.parametrize(
    ("judged", "outcome", "is_failure"),
    [
        (lambda _: Verdict(1e-4), "converged", False),
        (lambda _: Verdict(math.inf, ("the load: 1 for 0",)), "false claim", True),
        (failing(IllPosedError("take more samples")), "IllPosedError", False),
        (failing(IllPosedError("it did not work")), "IllPosedError", True),
        (failing(ZeroDivisionError()), "ZeroDivisionError", True),
        (lambda _: np.array([1e308]) * 10, "RuntimeWarning", True),
        (lambda _: warnings.warn("slow", UserWarning, stacklevel=1), "UserWarning", True),
    ],
)
def test_outcome_of_a_problem(judged, outcome, is_failure):
    row = runner.problem_row("contact", Problem(), judged, lambda _, error: runner.has_advice(error))
    assert (row["outcome"], "why" in row) == (outcome, is_failure)


@pytest.mark.parametrize(
    ("call", "outcome", "is_failure"),
    [
        (failing(ParameterError("no")), "ParameterError", False),
        (failing(ConvergenceError("no", 1.0, 1)), "ConvergenceError", True),
        (lambda: None, "accepted", True),
    ],
)
def test_outcome_of_bad_input(call, outcome, is_failure):
    row = runner.refusal_row("contact", "input=bad", call)
    assert (row["outcome"], "why" in row) == (outcome, is_failure)


@pytest.mark.parametrize("subject", refusals.REFUSALS)
def test_bad_input_is_refused(subject):
    rows = [runner.refusal_row(subject, name, call) for name, call in refusals.REFUSALS[subject].items()]
    assert len(rows) >= 80
    assert runner.failures(rows) == []


@pytest.mark.slow
@pytest.mark.parametrize("stage", CAMPAIGNS)
def test_a_campaign_on_two_processes_has_no_failure_and_the_same_rows(stage):
    """Both runs are in new processes: a process that compiled functions in another order may differ in last bits."""
    rows = runner.run_problems(CAMPAIGNS[stage].row_of, SEED, range(100), jobs=2)
    assert runner.failures(rows) == []
    assert runner.run_problems(CAMPAIGNS[stage].row_of, SEED, range(10), jobs=3) == rows[:10]


def test_files_hold_all_rows_and_a_failure_ends_the_command_with_one(tmp_path, monkeypatch, capsys):
    def row_of(seed: int, number: int) -> runner.Row:
        verdict = Verdict(5e-4, ("p >= 0: 1 for 0",) if number == 4 else ())
        return runner.problem_row("contact", Problem(number), lambda _: verdict, lambda *_: False)

    path, joint = tmp_path / "stress" / "contact.json", tmp_path / "stress.json"
    monkeypatch.setattr("sys.argv", ["stress", "--problems", "6", "--seed", "1", "--output", f"{path}"])
    assert runner.command("", "contact", row_of, 10) == 1
    assert "false claim: number=4 tolerance=0.001: p >= 0: 1 for 0" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["runner", "--campaigns", f"{path}", "--output", f"{joint}"])
    runner.main()
    for file in (path, joint):
        content = json.loads(file.read_text())
        assert content["rows"] == [row_of(1, number) for number in range(6)]
        assert (content["problems"], content["failures"], content["seeds"]) == (6, 1, {"contact": 1})
        (stage,) = content["summary"]
        assert (stage["stage"], stage["problems"], stage["failures"]) == ("contact", 6, 1)
        assert stage["outcomes"] == {"converged": 5, "false claim": 1}
        assert stage["worst_residual_over_tolerance"] == pytest.approx(0.5)
    for most, solved in ((sys.maxsize, 5), (10, 10)):  # half of ten random problems, but all of a list
        monkeypatch.setattr("sys.argv", ["stress", "--share", "0.5", "--output", f"{path}"])
        runner.command("", "contact", row_of, 10, most)
        assert json.loads(path.read_text())["problems"] == solved
    monkeypatch.setattr("sys.argv", ["stress", "--only", "3", "5"])
    assert runner.command("", "contact", row_of, 10) == 0


# The judge of accuracies.

ASKING = accuracy.random_problem(SEED, 1)
PERCENTILES = np.array([33.0, 50.0, 85.0])


def answer_of(mean: np.ndarray, std: np.ndarray) -> Run:
    """A run that gives these numbers."""
    found = {"percentile": PERCENTILES, "combined_mean": mean, "combined_std": std}
    return Run(1.0, 30, 0.1, found, [])


def test_numbers_farther_away_than_four_errors_are_rejected():
    """A known number without error: the limit is 4 / 1.96 of the accuracy, in units of the mean at the median."""
    mean, std = np.array([0.33, 0.3, 0.25]), np.array([0.03, 0.02, 0.01])
    known = np.log([mean, std]).T - np.log(0.3)
    nothing = np.zeros((3, 2))
    assert accuracy.judge(ASKING, answer_of(7 * mean, 7 * std), known, nothing, nothing).broken == ()
    limit = np.exp(accuracy.SIGMAS / accuracy.NORMAL_95 * ASKING.asked * np.array([1.0, 1.0, 0.99]))
    found = accuracy.judge(ASKING, answer_of(mean, std * limit * 1.001), known, nothing, nothing)
    assert names(found) == {"std at 33 %", "std at 50 %"}
    assert found.residual == pytest.approx(4.0 / 1.96, rel=0.01)
    known_to = accuracy.judge(ASKING, answer_of(mean, std * limit * 1.001), known, nothing, np.full((3, 2), 0.01))
    assert known_to.broken == ()


@pytest.mark.slow
def test_a_random_scene_keeps_its_accuracy():
    """Asked 26 %; the difference from 324 strips on cells of the scene and 24 on half of them is below that."""
    row = accuracy.row_of(SEED, 1)
    assert (row["outcome"], row["residual"] < 1.0) == ("converged", True)


# Judges of surfaces.

GRID = Grid(6, 5, 1e-6, 2e-6)
FIELD = covariance_of("matern", 1e-7, 4e-6, 2e-6, 0.4, smoothness=1.5)
EXPANSION = surface.FieldProblem(0, "expansion", GRID, FIELD, 12, None)


def test_wrong_expansions_are_rejected():
    found = karhunen_loeve(FIELD, GRID, 12)
    assert surface.judge_expansion(EXPANSION, found).broken == ()
    tilted = found.modes.copy()
    tilted[3] += 1e-8 * tilted[4]
    wrong = {
        "the residual": replace(found, modes=tilted),
        "eigenvalues": replace(found, eigenvalues=found.eigenvalues * (1 + 1e-8)),
        "orthonormal": replace(found, modes=found.modes[::-1]),
        "captured variance": replace(found, captured_variance=found.captured_variance + 1e-8),
        "the largest entry is positive": replace(found, modes=-found.modes),
    }
    for name, answer in wrong.items():
        assert name in names(surface.judge_expansion(EXPANSION, answer)), name
    more = replace(EXPANSION, order=None, share=found.captured_variance - 0.3)
    assert "with no mode too many" in names(surface.judge_expansion(more, found))
    modes = leading_modes(FIELD, GRID, 7)
    assert verdict_of(surface.judge_modes(EXPANSION, *modes)).broken == ()
    missing_one = (part[np.arange(7) != 2] for part in modes)
    assert names(verdict_of(surface.judge_modes(EXPANSION, *missing_one))) == {"eigenvalues"}


def test_wrong_embeddings_are_rejected():
    """A root that is too large, and a correlation that is a millionth too long."""
    found, problem = embed(FIELD, GRID), replace(EXPANSION, entry="embedding", order=None)
    longer = embed(replace(FIELD, correlation_length_m=4e-6 * (1 + 1e-6)), GRID)
    assert surface.judge_embedding(problem, found).broken == ()
    for wrong in (replace(found, root=found.root * (1 + 1e-9)), longer):
        assert names(surface.judge_embedding(problem, wrong)) == {"the covariance"}


def test_fits_that_are_no_minimum_are_rejected(monkeypatch):
    x = 1e-6 * np.arange(-6.0, 7.0)
    exact = FIELD(x[:, None], x) / FIELD.rms_height_m**2
    data = surface_fit.estimates(x[:, None], x, exact, np.full(exact.shape, 0.01))
    problem = surface_fit.FitProblem(0, "exact", "matern", FIELD, data, None)
    assert surface_fit.judged(problem).broken == ()
    found = surface_fit.fit_covariance("matern", data, 1e-7)
    moved = replace(found, covariance=replace(found.covariance, correlation_length_m=4.1e-6))
    monkeypatch.setattr(surface_fit, "fit_covariance", lambda *_, **__: moved)
    assert {"its misfit", "fewer squares nearby", "the model comes back"} <= names(surface_fit.judged(problem))


# Judges of contacts.

SOFT = 5e9  # [Pa] a hardness that a third of the pressed nodes reach


def contact_problem(control: str, load: float | None = None) -> contact.ContactProblem:
    """Return a rough surface of 12 x 9 nodes, with the plane at its median or under a load."""
    heights = 1e-7 * np.random.default_rng(8).standard_normal((12, 9))
    planes, grid = () if load else (float(np.median(heights)),), Grid(12, 9, 1e-6, 2e-6)
    return contact.ContactProblem(0, grid, 2e11, heights, "white", control, planes, load, math.inf, 1e-10)


PLANE, LOAD = contact_problem("plane"), contact_problem("load", 1e9)
PERIODIC = contact_problem("periodic-load", 1e9)


def solved(problem: contact.ContactProblem, hardness: float = math.inf) -> ContactSolution:
    influence = Influence(problem.grid, problem.modulus, problem.periodic)
    return next(contact.solve_planes(problem, influence, problem.tolerance, hardness))


def judged(problem: contact.ContactProblem, solution: ContactSolution, hardness: float = math.inf) -> Verdict:
    displacement = contact.Displacement(problem.grid, problem.modulus, problem.periodic)
    return contact.judge(problem, displacement, solution, problem.planes[0] if problem.planes else None, hardness)


def changed(solution: ContactSolution, field: str, node: tuple, value: float) -> ContactSolution:
    values = getattr(solution, field).copy()
    values[node] = value
    return replace(solution, **{field: values})


@pytest.mark.parametrize("problem", [PLANE, LOAD, PERIODIC], ids=["plane", "load", "periodic"])
@pytest.mark.parametrize("hardness", [math.inf, SOFT], ids=["elastic", "capped"])
def test_right_contacts_are_accepted(problem, hardness):
    assert judged(problem, solved(problem, hardness), hardness).broken == ()


def test_wrong_contacts_are_rejected():
    """Each field of a right solution changed in turn; small changes are a hundred times the tolerance."""
    elastic, capped = solved(PLANE), solved(PLANE, SOFT)
    pressed, open_ = (tuple(np.argwhere(mask)[0]) for mask in (elastic.contact, ~elastic.contact))
    between = tuple(np.argwhere(capped.contact & (capped.pressure < SOFT))[0])
    at_cap = tuple(np.argwhere(capped.plastic_displacement > 0)[0])
    p = float(elastic.pressure[pressed])
    wrong = {
        "the residual": (changed(elastic, "pressure", pressed, p * (1 + 1e-7)), math.inf),
        "p >= 0": (changed(elastic, "pressure", open_, -1e-300), math.inf),
        "p <= H": (changed(capped, "pressure", at_cap, np.nextafter(SOFT, math.inf)), SOFT),
        "gap >= 0": (changed(capped, "plastic_displacement", at_cap, 0.0), SOFT),
        "gap = 0 where p > 0": (changed(elastic, "pressure", open_, 1e-6 * p), math.inf),
        "u_plastic >= 0": (changed(capped, "plastic_displacement", at_cap, -1e-30), SOFT),
        "u_plastic = 0 where p < H": (changed(capped, "plastic_displacement", between, 1e-30), SOFT),
        "its gap is B p - u_bar + u_plastic": (changed(elastic, "gap", open_, 2 * elastic.gap[open_]), math.inf),
        "its residual": (replace(elastic, residual=2e-10), math.inf),
        "fields of another shape, or not finite": (changed(elastic, "gap", open_, math.nan), math.inf),
    }
    for name, (solution, hardness) in wrong.items():
        assert name in names(judged(PLANE, solution, hardness)), name
    assert "the residual" in names(judged(PLANE, solved(replace(PLANE, modulus=2e11 * (1 + 1e-8)))))
    for problem in (LOAD, PERIODIC):
        assert names(judged(replace(problem, load=(1 + 1e-11) * problem.load), solved(problem))) == {"the load"}


# Judges of pressure expansions.


def test_wrong_distributions_of_pressure_are_rejected():
    """A plane that is lower by a standard deviation moves the distribution by 0.2; 0.098 are allowed."""
    problems = (chaos.random_problem(5, number) for number in range(400))
    problem = next(one for one in problems if one.is_well_posed)
    samples = problem.samples()
    found = fit_local(samples, problem.degree, problem.target)
    assert chaos.judge(problem, found, samples, 0.06).broken == ()
    lower = replace(problem, plane=problem.plane + 1.0)
    assert "the distribution" in names(chaos.judge(lower, found, samples, 0.06))


def test_a_strip_that_understates_its_error_is_rejected(monkeypatch):
    problems = (chaos_strip.random_problem(5, number) for number in range(400))
    problem = next(one for one in problems if one.is_well_posed and one.bend and one.degree == 2)
    assert chaos_strip.judged(problem).broken == ()
    plain = chaos_strip.fit_strip

    def praised(*arguments):
        expansion, quality = plain(*arguments)
        return expansion, quality | {"leave_one_out": quality["leave_one_out"] / 1e3}

    monkeypatch.setattr(chaos_strip, "fit_strip", praised)
    assert any("error" in line for line in chaos_strip.judged(problem).broken)


# Judges of friction.


def shifted(estimate: Estimate, by: float) -> Estimate:
    """Return an estimate whose value, interval and replicates are moved."""
    return Estimate(estimate.value + by, estimate.low + by, estimate.high + by, estimate.replicates + by)


def test_wrong_beta_distributions_are_rejected():
    generator = np.random.default_rng(11)
    mu = np.exp(0.02 * np.cumsum(generator.standard_normal((8, 30)), axis=1))
    valid = generator.random(mu.shape) > 0.1
    problem = friction.WindowProblem(2, "rough", np.where(valid, mu, 0.0), valid)
    beta = fit_beta(problem.mu, valid, problem.weights)
    assert friction.judge(problem, beta).broken == ()
    other = replace(beta, a=shifted(beta.a, 0.3 * float(beta.a.value)))
    assert {"distance, row 0", "no nearer Beta, row 0"} <= names(friction.judge(problem, other))
    moved = replace(beta, lower=shifted(beta.lower, 1e-6))
    assert "its mean, row 0" in names(friction.judge(problem, moved))


# Judges of motions.

MOTION = oscillator.MotionProblem(
    number=0,
    oscillator=Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, 60.0, 430.0),
    law=StribeckLaw(0.3),
    nodes=0.03 * np.random.default_rng(1).uniform(-1, 1, oscillator.BLOCK),
    spacing=2e-4,
    start=0.0,
    options=MotionOptions(),
    labels={"law": "stribeck"},
)


@pytest.fixture(scope="module")
def motion():
    """The motion of that problem, which the judge accepts."""
    found = oscillator.drawn(MOTION)
    assert oscillator.judge(MOTION, found).broken == ()
    return found


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"law": StribeckLaw(0.29)}, "slip errs"),
        ({"oscillator": replace(MOTION.oscillator, damping_ratio=0.171)}, "slip errs"),
        ({"options": MotionOptions(friction_follows="belt")}, "slip errs"),
        ({"nodes": 1.2 * MOTION.nodes}, "slip errs"),
        ({"law": StribeckLaw(0.3, static=0.39)}, "exceeds its limit"),
        ({"law": StribeckLaw(0.3, static=0.41)}, "within the limit"),
    ],
)
def test_motions_of_another_problem_are_rejected(motion, change, reason):
    assert any(reason in line for line in oscillator.judge(replace(MOTION, **change), motion).broken)
