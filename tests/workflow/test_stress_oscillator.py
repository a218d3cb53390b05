"""The stress campaign of the oscillator: problems by number, and a judge that catches motions that are not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.law import CoulombLaw, StribeckLaw
from roughslip.oscillator.motion import trajectory
from roughslip.oscillator.system import Oscillator
from workflow.stress import oscillator, oscillator_problem
from workflow.stress.oscillator_judge import Judge, Slide, judge
from workflow.stress.oscillator_problem import Problem, random_problem
from workflow.stress.outcomes import SEED

STUDY = Problem(
    number=0,
    oscillator=Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, 60.0, 430.0),
    law=StribeckLaw(0.3),
    nodes=0.03 * np.random.default_rng(1).uniform(-1, 1, oscillator_problem.BLOCK),
    spacing=2e-4,
    start=0.0,
    periods=6.0,
    tolerance=1e-9,
    stochastic=True,
    interpolation="cubic",
    follows="slip",
    negative="clip",
    integrator="fehlberg45",
    labels={"law": "stribeck"},
)


def drawn(problem: Problem):
    return trajectory(
        problem.oscillator,
        problem.law,
        problem.path,
        problem.spacing,
        problem.periods,
        problem.tolerance,
        problem.start,
        problem.stochastic,
        problem.interpolation,
        problem.follows,
        problem.negative,
        problem.integrator,
        oscillator.SAMPLES,
    )


def test_a_number_makes_the_same_problem_again_and_another_seed_another():
    one, again, other = random_problem(3, 17), random_problem(3, 17), random_problem(4, 17)
    assert oscillator.case_of(one) == oscillator.case_of(again) != oscillator.case_of(other)
    assert np.array_equal(one.nodes, again.nodes)


def test_problems_cover_what_they_should():
    """Of 400 problems; a share of 0.03 is expected of the rarest, and then none of it has a chance of 6e-6."""
    problems = [random_problem(5, number) for number in range(400)]
    for key, names in (
        ("law", oscillator_problem.LAWS),
        ("excitation", oscillator_problem.EXCITATIONS),
        ("path", oscillator_problem.PATHS),
    ):
        assert {problem.labels[key] for problem in problems} == set(names)
    assert {problem.follows for problem in problems} == {"slip", "belt", "time"}
    belts = [problem.oscillator.V / problem.oscillator.F for problem in problems]
    assert min(belts) == 0.0
    assert min(belt for belt in belts if belt > 0.0) < 1e-5
    assert max(belts) > 300
    assert max(problem.oscillator.damping_ratio for problem in problems) > 4.5
    assert min(problem.oscillator.damping_ratio for problem in problems) == 0.0
    loads = [problem.oscillator.normal_force_n for problem in problems]
    assert min(loads) < 1e-8
    assert max(loads) > 1e8
    per_cycle = [float(problem.labels["per_cycle"]) for problem in problems]
    assert min(per_cycle) < 2e-3
    assert max(per_cycle) > 500


def test_the_judge_s_path_is_scipy_s():
    nodes = np.concatenate((STUDY.nodes, STUDY.nodes[:3]))
    grid = STUDY.spacing * np.arange(nodes.size)
    s = np.linspace(0.0, grid[-3], 500)
    tangents = np.gradient(nodes, STUDY.spacing)
    for way, expected in (
        ("cubic", CubicHermiteSpline(grid, nodes, tangents)(s)),
        ("linear", np.interp(s, grid, nodes)),
    ):
        found = Judge(replace(STUDY, interpolation=way)).scatter(np.zeros(500), s)
        assert found == pytest.approx(expected, abs=1e-13)


def test_the_judge_s_slip_is_the_closed_form():
    """Undamped about the friction of one sign: a circle; the classical method errs by (h / steps)^4 / 120."""
    free = replace(
        STUDY,
        oscillator=Oscillator(1.0, 316.0, 0.0, 0.948, 2500.0),
        law=CoulombLaw(0.4, 0.4),
        nodes=np.zeros(0),
    )
    F, V = free.oscillator.F, free.oscillator.V
    one = np.ones(1)
    x, u = Judge(free).slip(Slide(0 * one, 0.012 * one, V * one, 0 * one, one), 0.5 * one, 50)
    c, s = math.cos(0.5), math.sin(0.5)
    assert x[0] == pytest.approx(0.4 * F + (0.012 - 0.4 * F) * c + V * s, abs=1e-10 * F)
    assert u[0] == pytest.approx(-(0.012 - 0.4 * F) * s + V * c, abs=1e-10 * F)


@pytest.mark.parametrize("follows", ["slip", "belt", "time"])
@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
def test_a_motion_is_accepted(follows, interpolation):
    spacing = STUDY.spacing / (0.948 if follows == "time" else 1.0)
    problem = replace(STUDY, follows=follows, interpolation=interpolation, spacing=spacing)
    motion = drawn(problem)
    assert motion.motion.cycles > 2
    verdict = judge(problem, motion)
    assert verdict.broken == ()
    assert verdict.residual < 3e-6


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"law": StribeckLaw(0.29)}, "slip errs"),
        ({"oscillator": replace(STUDY.oscillator, damping_ratio=0.171)}, "slip errs"),
        ({"oscillator": replace(STUDY.oscillator, excitation_force_n=66.0)}, "slip errs"),
        ({"follows": "belt"}, "slip errs"),
        ({"nodes": 1.2 * STUDY.nodes}, "slip errs"),
        ({"law": StribeckLaw(0.3, static=0.39)}, "exceeds its limit"),
        ({"law": StribeckLaw(0.3, static=0.41)}, "within the limit"),
    ],
)
def test_the_motion_of_another_problem_is_not(change, reason):
    verdict = judge(replace(STUDY, **change), drawn(STUDY))
    assert any(reason in one for one in verdict.broken)


def test_events_that_were_tampered_with_are_noticed():
    motion = drawn(STUDY)
    events = motion.motion
    first, late = events.kind.copy(), events.time.copy()
    first[0] = 1
    late[3] = late[4] + 0.1
    for change, reason in (({"kind": first}, "alternate"), ({"time": late}, "runs back")):
        tampered = replace(motion, motion=replace(events, **change))
        assert any(reason in one for one in judge(STUDY, tampered).broken)


def test_a_sample_of_the_campaign_has_no_failure():
    rows = [row for number in range(200, 212) for row in oscillator.rows_of(SEED, number)]
    assert [row["case"] for row in rows if "why" in row] == []


def test_bad_input_is_refused():
    rows = oscillator.refused()
    assert len(rows) > 60
    assert [row["case"] for row in rows if "why" in row] == []


def test_which_errors_are_honest():
    limit = ConvergenceError("within the step limit; try a larger tolerance", residual=1.0, work=2)
    assert oscillator.honest(limit, False)
    assert not oscillator.honest(ConvergenceError("no idea", residual=1.0, work=2), False)
    negative = ParameterError("friction turns negative after 1 of 2 natural periods")
    assert oscillator.honest(negative, True)
    assert not oscillator.honest(negative, False)
    assert not oscillator.honest(ParameterError("the friction path ends"), True)
