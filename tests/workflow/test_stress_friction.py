"""Judges of pressure expansions, friction and motions accept right answers and reject wrong ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from roughslip.chaos import local
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.marginal import fit_beta
from roughslip.friction.paths import METHODS
from roughslip.friction.process import FrictionProcess
from roughslip.friction.statistics import window_statistics
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.motion import MotionOptions
from roughslip.probability import BetaDistribution, Estimate
from workflow.stress import chaos, chaos_strip, friction, friction_fits, friction_paths, friction_windows, oscillator
from workflow.stress.friction_paths import PathProblem
from workflow.stress.friction_windows import WindowProblem
from workflow.stress.oscillator_problem import BLOCK, MotionProblem
from workflow.stress.runner import Conditions, Verdict, verdict_of


def names(found: Verdict | Conditions) -> set[str]:
    verdict = found if isinstance(found, Verdict) else verdict_of(found)
    return {line.split(":")[0] for line in verdict.broken}


def test_a_wrong_distribution_of_pressure_is_rejected():
    """A plane that is lower by a standard deviation moves the distribution by 0.2; 0.098 are allowed."""
    problems = (chaos.random_problem(5, number) for number in range(400))
    problem = next(one for one in problems if chaos.is_well_posed(one) and one.entry == "local")
    samples = problem.surfaces_of(0, problem.surfaces)
    found = local.fit_local(samples, problem.degree, problem.target(problem.kinds[0]))
    assert chaos.judge(problem, found, samples, 0.06).broken == ()
    lower = replace(problem, plane=problem.plane + 1.0)
    assert "the distribution" in names(chaos.judge(lower, found, samples, 0.06))
    higher = replace(found, whole=replace(found.whole, coefficients=100 * found.whole.coefficients))
    assert "the distribution" in names(chaos.judge(problem, higher, samples, 0.06))


def test_a_strip_that_understates_its_error_is_rejected(monkeypatch):
    problems = (chaos_strip.random_problem(5, number) for number in range(400))
    problem = next(one for one in problems if chaos_strip.is_well_posed(one) and one.bend and one.degree == 2)
    assert chaos_strip.judged(problem).broken == ()
    plain = chaos_strip.fit_strip

    def praised(*arguments):
        expansion, quality = plain(*arguments)
        return expansion, quality | {"leave_one_out": quality["leave_one_out"] / 1e3}

    monkeypatch.setattr(chaos_strip, "fit_strip", praised)
    assert any("error" in line for line in chaos_strip.judged(problem).broken)


def window_problem() -> WindowProblem:
    """Return windows along which friction is correlated, some of them missing."""
    generator = np.random.default_rng(11)
    mu = np.exp(0.02 * np.cumsum(generator.standard_normal((8, 30)), axis=1))
    valid = generator.random(mu.shape) > 0.1
    return WindowProblem(2, "statistics", "rough", np.where(valid, mu, 0.0), valid, 10, 1e-6, (1, 2, 1))


WINDOWS = window_problem()
WEIGHTS = friction.weights_of(WINDOWS)
ARRAYS = WINDOWS.mu, WINDOWS.valid, WEIGHTS


def shifted(estimate: Estimate, by: float) -> Estimate:
    """Return an estimate whose value, interval and replicates are moved."""
    return Estimate(estimate.value + by, estimate.low + by, estimate.high + by, estimate.replicates + by)


def test_wrong_statistics_are_rejected():
    found = window_statistics(*ARRAYS)

    def broken(**changes: object) -> set[str]:
        return names(friction_windows.judge_statistics(WINDOWS, replace(found, **changes), WEIGHTS))

    assert broken() == set()
    for name in ("mean", "std", "variation", "skewness", "kurtosis", "missing_share"):
        words = name.replace("_", " ")
        assert {f"{words}, sample", f"{words}, replicate"} <= broken(**{name: shifted(getattr(found, name), 1e-8)})
    assert broken(mean=replace(found.mean, low=found.mean.value, high=found.mean.value)) == {"mean"}
    assert "effective windows, sample" in broken(effective_windows=shifted(found.effective_windows, 1e-3))
    assert "missing" in broken(missing=0)


def test_wrong_autocorrelations_and_lengths_are_rejected():
    curve = autocorrelation(WINDOWS.mu, WINDOWS.valid, 10, WEIGHTS)
    assert names(friction_fits.judge_autocorrelation(WINDOWS, curve, WEIGHTS)) == set()
    assert "r, sample" in names(friction_fits.judge_autocorrelation(WINDOWS, shifted(curve, 1e-9), WEIGHTS))
    lags = 1e-6 * np.arange(10)
    found = correlation_fit(lags, curve, 6e-6)
    assert names(friction_fits.judge_lengths(lags, curve, 6e-6, found)) == set()
    for name, broken in {
        "least_squares": "no better length, row 0",
        "half_window": "half a window, row 0",
        "one_over_e": "1/e, row 0",
    }.items():
        wrong = replace(found, **{name: shifted(getattr(found, name), 1e-2 * float(getattr(found, name).value))})
        assert broken in names(friction_fits.judge_lengths(lags, curve, 6e-6, wrong)), name


def test_wrong_distributions_are_rejected():
    beta = fit_beta(*ARRAYS)
    assert names(friction_fits.judge_beta(WINDOWS, beta, WEIGHTS)) == set()
    other = replace(beta, a=shifted(beta.a, 0.3 * float(beta.a.value)))
    assert {"distance, sample", "no nearer Beta, sample"} <= names(friction_fits.judge_beta(WINDOWS, other, WEIGHTS))
    moved = replace(beta, lower=shifted(beta.lower, 1e-6))
    assert "its mean, sample" in names(friction_fits.judge_beta(WINDOWS, moved, WEIGHTS))


PROCESS = FrictionProcess(BetaDistribution(2.1, 5.0, 0.2, 0.6), 1e-4)


@pytest.mark.parametrize("method", METHODS)
def test_paths_of_another_process_are_rejected(method, monkeypatch):
    problem, plain = PathProblem(0, method, PROCESS, 2e-5, 1e-3), friction_paths.prepare
    assert friction_paths.judged(problem).broken == ()
    longer = replace(PROCESS, correlation_length_m=1.001e-4)
    monkeypatch.setattr(friction_paths, "prepare", lambda _, *rest: plain(longer, *rest))
    assert "the autocorrelation" in names(friction_paths.judged(problem))
    wider = replace(PROCESS, marginal=BetaDistribution(0.7, 0.7, 0.2, 0.61))
    monkeypatch.setattr(friction_paths, "prepare", lambda _, *rest: plain(wider, *rest))
    assert {"the marginal", "its bounds, below"} <= names(friction_paths.judged(problem))


def test_paths_that_do_not_follow_their_seed_are_rejected(monkeypatch):
    generator, plain = np.random.default_rng(5), friction_paths._path
    monkeypatch.setattr(friction_paths, "_path", lambda *parts: generator.permutation(plain(*parts)))
    found = friction_paths.judged(PathProblem(0, "recursion", PROCESS, 2e-5, 1e-3))
    assert names(found) == {"again the same bits", "the correlation of paths"}


MOTION = MotionProblem(
    number=0,
    oscillator=Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, 60.0, 430.0),
    law=StribeckLaw(0.3),
    nodes=0.03 * np.random.default_rng(1).uniform(-1, 1, BLOCK),
    spacing=2e-4,
    start=0.0,
    periods=6.0,
    options=MotionOptions(),
    labels={"law": "stribeck"},
)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"law": StribeckLaw(0.29)}, "slip errs"),
        ({"oscillator": replace(MOTION.oscillator, damping_ratio=0.171)}, "slip errs"),
        ({"oscillator": replace(MOTION.oscillator, excitation_force_n=66.0)}, "slip errs"),
        ({"options": MotionOptions(friction_follows="belt")}, "slip errs"),
        ({"nodes": 1.2 * MOTION.nodes}, "slip errs"),
        ({"law": StribeckLaw(0.3, static=0.39)}, "exceeds its limit"),
        ({"law": StribeckLaw(0.3, static=0.41)}, "within the limit"),
    ],
)
def test_motions_of_another_problem_are_rejected(change, reason):
    found = oscillator.drawn(MOTION)
    assert oscillator.judge(MOTION, found).broken == ()
    assert any(reason in line for line in oscillator.judge(replace(MOTION, **change), found).broken)
