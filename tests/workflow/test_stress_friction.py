"""The stress campaign of friction: problems by number, judges against known answers, false claims that they catch."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.distribution_families import fit_candidates
from roughslip.friction.marginal import distance_to_beta, fit_beta, scaled_beta
from roughslip.friction.paths import METHODS
from roughslip.friction.process import FrictionProcess
from roughslip.friction.statistics import combine, window_statistics
from roughslip.probability import BetaDistribution, Estimate
from workflow.benchmarks.measure import fields
from workflow.stress import (
    friction,
    friction_judge,
    friction_lengths,
    friction_paths,
    friction_penetration,
    friction_shapes,
    outcomes,
)
from workflow.stress.friction_problem import ENTRIES, KINDS, Problem, random_problem
from workflow.stress.outcomes import verdict_of


def names(met: friction_judge.Met) -> set[str]:
    return {what.split(":")[0] for what in verdict_of(met).broken}


def problem_of(strips: int = 8, windows: int = 30) -> Problem:
    """Windows along which friction is correlated, some missing, and a control that resembles them."""
    generator = np.random.default_rng(11)
    z = np.cumsum(generator.standard_normal((strips + 12, windows)), axis=1) / 5
    mu, control = np.exp(0.1 * z), 1 + 0.1 * z + 0.02 * generator.standard_normal(z.shape)
    valid = generator.random(z.shape) > 0.1
    columns = generator.random((strips, 40)) + 0.1
    kept = np.where(valid, mu, 0.0)[:strips]
    return Problem(
        2, "statistics", "rough", columns, columns + 0.1, 9, 2, 2.0, 5.4, kept, valid[:strips], control, valid,
        10, 1e-6, (1, 2, 1),
    )  # fmt: skip


PROBLEM = problem_of()
WEIGHTS = friction.weights_of(PROBLEM)


def shifted(estimate: Estimate, by: float) -> Estimate:
    """Another value, with the interval and the replicates moved along."""
    return Estimate(estimate.value + by, estimate.low + by, estimate.high + by, estimate.replicates + by)


# Problems.


def test_a_number_makes_the_same_problem_again_and_another_seed_another():
    one, again, other = random_problem(3, 17), random_problem(3, 17), random_problem(4, 17)
    assert friction.case_of(one) == friction.case_of(again) != friction.case_of(other)
    assert all(np.array_equal(getattr(one, name), getattr(again, name)) for name in ("mu", "valid", "area", "control"))


def test_problems_cover_what_they_should():
    """Of 600 problems; 1 of 33 is expected of the rarest, and then none of it has a chance of exp(-18)."""
    problems = [random_problem(5, number) for number in range(600)]
    assert {problem.entry for problem in problems} == set(ENTRIES)
    assert {problem.kind for problem in problems} == set(KINDS)
    assert any(problem.mu.shape[1] == 1 for problem in problems)
    assert any(len(problem.mu) == 1 for problem in problems)
    assert any(not problem.valid.any() for problem in problems)
    assert any(0 < problem.valid.mean() < 0.5 for problem in problems)
    sizes = [float(problem.mu.max()) for problem in problems if problem.valid.any()]
    assert 1e-12 <= min(sizes) < 1e-10 < 1e5 < max(sizes)
    paths = [friction_paths.random_problem(5, number) for number in range(400)]
    assert {path.method for path in paths} == set(METHODS)
    betas = [path.process.marginal for path in paths if isinstance(path.process.marginal, BetaDistribution)]
    assert min(min(law.a, law.b) for law in betas) < 0.35
    assert max(max(law.a, law.b) for law in betas) > 40


# Judges of windows.


def test_statistics_that_are_right_pass_and_spoilt_ones_do_not():
    found = window_statistics(PROBLEM.mu, PROBLEM.valid, WEIGHTS)
    assert names(friction_judge.judge_statistics(PROBLEM, found, WEIGHTS)) == set()
    for name in ("mean", "std", "variation", "skewness", "kurtosis", "missing_share"):
        wrong = replace(found, **{name: shifted(getattr(found, name), 1e-8)})
        broken = names(friction_judge.judge_statistics(PROBLEM, wrong, WEIGHTS))
        assert broken == {f"{name.replace('_', ' ')}, sample", f"{name.replace('_', ' ')}, replicate"}, name
    narrow = replace(found.mean, low=found.mean.value, high=found.mean.value)
    assert names(friction_judge.judge_statistics(PROBLEM, replace(found, mean=narrow), WEIGHTS)) == {"mean"}
    more = replace(found, effective_windows=shifted(found.effective_windows, 1e-3))
    assert "effective windows, sample" in names(friction_judge.judge_statistics(PROBLEM, more, WEIGHTS))
    assert "missing" in names(friction_judge.judge_statistics(PROBLEM, replace(found, missing=0), WEIGHTS))


def test_sums_that_are_wrong_are_caught():
    area, force = (friction.window_sums(part, 9, 2) for part in (PROBLEM.area, PROBLEM.force))
    mu, valid = friction.friction_coefficient(area, force, 2.0, 5.4)
    assert names(friction_judge.judge_sums(PROBLEM, area, force, mu, valid)) == set()
    assert 0 < valid.mean() < 1
    wrong = {
        "area of windows": (area * (1 + 1e-13), force, mu, valid),
        "friction": (area, force, mu * (1 + 1e-14), valid),
        "which have friction": (area, force, mu, ~valid),
        "no friction": (area, force, mu + 1e-300, valid),
    }
    for name, parts in wrong.items():
        assert name in names(friction_judge.judge_sums(PROBLEM, *parts)), name


def test_autocorrelations_and_lengths_that_are_wrong_are_caught():
    curve = autocorrelation(PROBLEM.mu, PROBLEM.valid, 10, WEIGHTS)
    assert names(friction_judge.judge_autocorrelation(PROBLEM, curve, WEIGHTS)) == set()
    assert "r, sample" in names(friction_judge.judge_autocorrelation(PROBLEM, shifted(curve, 1e-9), WEIGHTS))
    lags = 1e-6 * np.arange(10)
    found = correlation_fit(lags, curve, 6e-6)
    assert names(friction_lengths.judge(lags, curve, 6e-6, found)) == set()
    for name, broken in {
        "least_squares": "no better length, row 0",
        "half_window": "half a window, row 0",
        "one_over_e": "1/e, row 0",
        "integral": "integral, row 0",
        "misfit_triangle": "misfit of the triangle, row 0",
    }.items():
        wrong = replace(found, **{name: shifted(getattr(found, name), 1e-3 * float(getattr(found, name).value))})
        assert broken in names(friction_lengths.judge(lags, curve, 6e-6, wrong)), name
    assert "told at a bound" in names(friction_lengths.judge(lags, curve, 6e-6, replace(found, at_bound=True)))


def test_shapes_that_are_wrong_are_caught():
    beta = fit_beta(PROBLEM.mu, PROBLEM.valid, WEIGHTS)
    assert names(friction_shapes.judge_beta(PROBLEM, beta, WEIGHTS)) == set()
    other = replace(beta, a=shifted(beta.a, 0.3 * float(beta.a.value)))
    assert {"distance, sample", "no nearer Beta, sample"} <= names(friction_shapes.judge_beta(PROBLEM, other, WEIGHTS))
    assert "its mean, sample" in names(
        friction_shapes.judge_beta(PROBLEM, replace(beta, lower=shifted(beta.lower, 1e-6)), WEIGHTS)
    )
    laws = fit_candidates(PROBLEM.mu, PROBLEM.valid, WEIGHTS)
    assert names(friction_shapes.judge_candidates(PROBLEM, laws, WEIGHTS)) == set()
    moved = {**laws, "gamma": replace(laws["gamma"], skewness=shifted(laws["gamma"].skewness, 0.02))}
    assert "gamma" in names(friction_shapes.judge_candidates(PROBLEM, moved, WEIGHTS))
    scaled = scaled_beta(PROBLEM.mu, PROBLEM.valid, WEIGHTS)
    assert names(friction_shapes.judge_scaled(PROBLEM, scaled, WEIGHTS)) == set()
    assert "a, row 0" in names(
        friction_shapes.judge_scaled(PROBLEM, replace(scaled, a=shifted(scaled.a, 1e-6)), WEIGHTS)
    )
    far = distance_to_beta(PROBLEM.mu, PROBLEM.valid, WEIGHTS, 2.0, 3.0)
    assert names(friction_shapes.judge_distance(PROBLEM, far, WEIGHTS, 2.0, 3.0)) == set()
    for by, broken in ((0.01, "too large"), (-0.01, "too small")):
        wrong = replace(far, standardised=shifted(far.standardised, by))
        assert f"standardised, row 0, {broken}" in names(
            friction_shapes.judge_distance(PROBLEM, wrong, WEIGHTS, 2.0, 3.0)
        )


def test_members_of_families_have_the_skewness_of_their_name():
    """Members at left are mirror images; by scipy's moments."""
    for family, law in (("gamma", stats.gamma(8.0)), ("lognormal", stats.lognorm(0.3))):
        skewness = float(law.stats("s"))
        found = friction_shapes._member(family, skewness)
        np.testing.assert_allclose(found, law.ppf(friction_shapes.PROBABILITIES), rtol=1e-10)
        np.testing.assert_allclose(friction_shapes._member(family, -skewness), -found[::-1], rtol=1e-10)


def test_controls_that_are_wrong_are_caught():
    strips = len(PROBLEM.mu)
    many = friction.strip_weights(12, PROBLEM.replicates, np.random.default_rng(2))
    sets = [(PROBLEM.control[rows], PROBLEM.control_valid[rows]) for rows in (slice(strips), slice(strips, None))]
    found = combine((PROBLEM.mu, PROBLEM.valid), *sets, WEIGHTS, many)
    assert float(found.mean_variance_ratio.value) < 0.5
    assert names(friction_judge.judge_combined(PROBLEM, found, WEIGHTS, many)) == set()
    for name, broken in {
        "mean": "mean, row 0",
        "std": "std, row 0",
        "mean_coefficient": "alpha of mean, row 0",
        "std_variance_ratio": "ratio of std, row 0",
    }.items():
        wrong = replace(found, **{name: shifted(getattr(found, name), 1e-5)})
        assert broken in names(friction_judge.judge_combined(PROBLEM, wrong, WEIGHTS, many)), name


class Straight:
    """A curve through the levels that is broken at each of them."""

    def __init__(self, law):
        self.law = law

    def at(self, points):
        rows = np.stack([np.interp(points, self.law.percentiles, row) for row in self.law.rows])
        return Estimate.from_rows(rows)

    def slope(self, points):
        return self.law.slope(points)


def test_a_curve_that_is_not_the_one_of_its_slopes_is_caught(monkeypatch):
    """Of twelve sets of levels a few have two levels or are flat, where a straight line is right."""
    assert set().union(*(names(friction_penetration.judged((1, k))) for k in range(12))) == set()
    plain = friction_penetration.penetration_law
    monkeypatch.setattr(friction_penetration, "penetration_law", lambda *parts: Straight(plain(*parts)))
    assert sum("its slope" in names(friction_penetration.judged((1, k))) for k in range(12)) >= 6


# The judge of paths.


@pytest.mark.parametrize("method", METHODS)
def test_paths_of_another_correlation_are_caught(method, monkeypatch):
    process = FrictionProcess(BetaDistribution(2.1, 5.0, 0.2, 0.6), 1e-4)
    problem = friction_paths.Problem(0, method, process, 2e-5, 1e-3)
    assert friction_paths.judged(problem).broken == ()
    plain = friction_paths.prepare

    def longer(law, spacing, length, name):
        return plain(replace(law, correlation_length_m=1.001 * law.correlation_length_m), spacing, length, name)

    monkeypatch.setattr(friction_paths, "prepare", longer)
    assert "the autocorrelation" in {what.split(":")[0] for what in friction_paths.judged(problem).broken}

    def wider(law, spacing, length, name):
        return plain(replace(law, marginal=BetaDistribution(0.7, 0.7, 0.2, 0.61)), spacing, length, name)

    monkeypatch.setattr(friction_paths, "prepare", wider)
    broken = {what.split(":")[0] for what in friction_paths.judged(problem).broken}
    assert {"the marginal", "its bounds, below"} <= broken


def test_paths_that_forget_their_seed_are_caught(monkeypatch):
    """Every path anew with other numbers: not the same bits again, and in time no correlation of what is drawn."""
    process = FrictionProcess(BetaDistribution(2.1, 5.0, 0.2, 0.6), 1e-4)
    problem = friction_paths.Problem(0, "recursion", process, 2e-5, 1e-3)
    generator = np.random.default_rng(5)
    plain = friction_paths._path
    monkeypatch.setattr(friction_paths, "_path", lambda *parts: generator.permutation(plain(*parts)))
    broken = {what.split(":")[0] for what in friction_paths.judged(problem).broken}
    assert broken == {"again the same bits", "the correlation of paths"}


# Refusals.


def test_errors_that_are_no_answer():
    advice = IllPosedError("too few: solve more strips")
    assert not friction.honest(PROBLEM, advice)
    assert not friction.honest(replace(PROBLEM, entry="combine"), advice)
    flat = replace(PROBLEM, mu=np.where(PROBLEM.valid, 0.3, 0.0))
    assert friction.honest(flat, advice)
    assert not friction.honest(flat, IllPosedError("no"))
    assert not friction.honest(flat, ParameterError("solve more strips"))
    assert friction.honest(replace(PROBLEM, entry="autocorrelation", lags=40), advice)
    path = friction_paths.Problem(0, "recursion", FrictionProcess(BetaDistribution(2.1, 5.0, 0.0, 1.0), 1.0), 1.0, 9.0)
    assert not friction_paths.honest(path, IllPosedError("use larger shapes"))
    steps = replace(path, process=FrictionProcess(BetaDistribution(0.01, 0.01, 0.0, 1.0), 1.0))
    assert friction_paths.honest(steps, IllPosedError("use larger shapes"))
    assert friction_paths.honest(replace(path, spacing=math.e**3), ParameterError("use another spacing"))


# The campaign.


@pytest.fixture(scope="module")
def rows() -> list[outcomes.Row]:
    return outcomes.campaign(friction.rows_of, outcomes.SEED, range(120), jobs=1)


def test_problems_of_every_class_without_a_failure(rows):
    assert outcomes.failures(rows) == []
    entries = {fields(row["case"])["entry"] for row in rows}
    assert entries == {*ENTRIES, "process"}
    assert [fields(row["case"])["number"] for row in rows] == [f"{number}" for number in range(120)]


def test_all_bad_input_is_refused():
    refused = friction.refused()
    assert len(refused) > 300
    assert outcomes.failures(refused) == []
