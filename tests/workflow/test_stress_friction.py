"""Judges of pressure expansions, friction and motions accept right answers and reject wrong ones."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.interpolate import CubicHermiteSpline

from roughslip.chaos import local
from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.distribution_families import fit_candidates
from roughslip.friction.marginal import PROBABILITIES, fit_beta
from roughslip.friction.paths import METHODS
from roughslip.friction.process import FrictionProcess
from roughslip.friction.statistics import window_statistics
from roughslip.oscillator.law import CoulombLaw, StribeckLaw
from roughslip.oscillator.system import Oscillator
from roughslip.probability import BetaDistribution, Estimate
from workflow.stress import chaos, chaos_strip, friction, friction_fits, friction_paths, friction_windows, oscillator
from workflow.stress.chaos_strip import RISK, beyond, seen_error
from workflow.stress.friction_paths import PathProblem
from workflow.stress.friction_windows import WindowProblem
from workflow.stress.oscillator import Judge, Slide
from workflow.stress.oscillator_problem import BLOCK, MotionProblem
from workflow.stress.runner import Conditions, Verdict, verdict_of


def names(found: Verdict | Conditions) -> set[str]:
    verdict = found if isinstance(found, Verdict) else verdict_of(found)
    return {line.split(":")[0] for line in verdict.broken}


def test_points_that_samples_cannot_have_seen_are_left_out():
    """100 samples miss nine points of 1000 with a probability of 0.991^100 = 0.4, 2000 samples with 1e-8."""
    squares = np.ones(1000)
    squares[:9] = 1e6
    assert seen_error(squares, 100) <= 1.0
    assert seen_error(squares, 2000) > 1e3


def test_few_degrees_of_freedom_determine_little():
    """With one, the square of a normal is below 1.6e-12 in one of a million cases: pi / 2 times RISK^2."""
    assert beyond(1) == pytest.approx(2 / (math.pi / 2 * RISK**2), rel=1e-5)
    assert beyond(100_000) == pytest.approx(2.0, rel=0.05)
    assert beyond(0) == math.inf


def test_a_wrong_distribution_of_pressure_is_rejected():
    """A plane that is lower by a standard deviation moves the distribution by 0.2; 0.098 are allowed."""
    problems = (chaos.random_problem(5, number) for number in range(400))
    problem = next(one for one in problems if chaos.is_well_posed(one) and one.entry == "local")
    samples = problem.surfaces_of(0, problem.surfaces)
    found = local.fit_local(samples, problem.degree, problem.target(problem.kinds[0]))
    assert chaos.judge(problem, found, samples, 0.06).broken == ()
    lower = replace(problem, plane=problem.plane + 1.0)
    assert "the distribution" in names(chaos.judge(lower, found, samples, 0.06))
    higher = replace(found, coefficients=100 * found.coefficients)
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
        "integral": "integral, row 0",
        "misfit_triangle": "misfit of the triangle, row 0",
    }.items():
        wrong = replace(found, **{name: shifted(getattr(found, name), 1e-2 * float(getattr(found, name).value))})
        assert broken in names(friction_fits.judge_lengths(lags, curve, 6e-6, wrong)), name
    at_bound = replace(found, at_bound=True)
    assert "stated at a bound" in names(friction_fits.judge_lengths(lags, curve, 6e-6, at_bound))


def test_wrong_distributions_are_rejected():
    beta = fit_beta(*ARRAYS)
    assert names(friction_fits.judge_beta(WINDOWS, beta, WEIGHTS)) == set()
    other = replace(beta, a=shifted(beta.a, 0.3 * float(beta.a.value)))
    assert {"distance, sample", "no nearer Beta, sample"} <= names(friction_fits.judge_beta(WINDOWS, other, WEIGHTS))
    moved = replace(beta, lower=shifted(beta.lower, 1e-6))
    assert "its mean, sample" in names(friction_fits.judge_beta(WINDOWS, moved, WEIGHTS))
    families = fit_candidates(*ARRAYS)
    assert names(friction_fits.judge_candidates(WINDOWS, families, WEIGHTS)) == set()
    skewed = {**families, "gamma": replace(families["gamma"], skewness=shifted(families["gamma"].skewness, 0.02))}
    assert "gamma, distance, sample" in names(friction_fits.judge_candidates(WINDOWS, skewed, WEIGHTS))


@pytest.mark.parametrize(("family", "law"), [("gamma", stats.gamma(8.0)), ("lognormal", stats.lognorm(0.3))])
def test_the_judges_families_have_the_skewness_of_their_name(family, law):
    skewness = float(law.stats("s"))
    found = friction_fits.family_member(family, skewness)
    scores = (law.ppf(PROBABILITIES) - law.mean()) / law.std()
    np.testing.assert_allclose(np.corrcoef(found, scores)[0, 1], 1.0, rtol=1e-12)
    np.testing.assert_allclose(friction_fits.family_member(family, -skewness), -found[::-1], rtol=1e-10)


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


def test_errors_that_answer_no_friction_problem():
    advice = IllPosedError("too few: solve more strips")
    flat = replace(WINDOWS, mu=np.where(WINDOWS.valid, 0.3, 0.0))
    assert not friction.is_answer(WINDOWS, advice)
    assert friction.is_answer(flat, advice)
    assert not friction.is_answer(flat, IllPosedError("no"))
    assert not friction.is_answer(flat, ParameterError("solve more strips"))
    assert friction.is_answer(replace(WINDOWS, entry="autocorrelation", lags=40), advice)
    steps = FrictionProcess(BetaDistribution(0.01, 0.01, 0.0, 1.0), 1.0)
    for process, answers in ((PROCESS, False), (steps, True)):
        problem = PathProblem(0, "recursion", process, 1.0, 9.0)
        assert friction_paths.is_answer(problem, IllPosedError("use larger shapes")) is answers


MOTION = MotionProblem(
    number=0,
    oscillator=Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, 60.0, 430.0),
    law=StribeckLaw(0.3),
    nodes=0.03 * np.random.default_rng(1).uniform(-1, 1, BLOCK),
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


def test_the_judges_friction_is_the_interpolant_of_its_nodes():
    """scipy's Hermite spline with the slopes of the central differences, one-sided at zero; and straight lines."""
    nodes = np.concatenate([MOTION.nodes, MOTION.nodes[:2]])
    places = MOTION.spacing * np.arange(nodes.size)
    slopes = np.gradient(nodes, MOTION.spacing)
    slopes[0] = (nodes[1] - nodes[0]) / MOTION.spacing
    s = np.random.default_rng(2).uniform(0, BLOCK * MOTION.spacing, 500)
    cubic = Judge(MOTION).scatter(np.zeros(500), s)
    linear = Judge(replace(MOTION, interpolation="linear")).scatter(np.zeros(500), s)
    assert cubic == pytest.approx(CubicHermiteSpline(places, nodes, slopes)(s), abs=1e-13)
    assert linear == pytest.approx(np.interp(s, places, nodes), abs=1e-13)


def test_the_judges_slip_is_the_closed_form():
    """Undamped with friction of one sign: a circle. The classical method errs by (h / steps)^4 / 120."""
    free = Oscillator(1.0, 316.0, 0.0, 0.948, 2500.0)
    judge = Judge(replace(MOTION, oscillator=free, law=CoulombLaw(0.4, 0.4), nodes=np.zeros(0)))
    one, F, V = np.ones(1), free.F, free.V
    x, u = judge.slip(Slide(0 * one, 0.012 * one, V * one, 0 * one, one), 0.5 * one, 50)
    c, s = math.cos(0.5), math.sin(0.5)
    assert x[0] == pytest.approx(0.4 * F + (0.012 - 0.4 * F) * c + V * s, abs=1e-10 * F)
    assert u[0] == pytest.approx(-(0.012 - 0.4 * F) * s + V * c, abs=1e-10 * F)


@pytest.mark.parametrize("follows", ["slip", "belt", "time"])
def test_right_motions_are_accepted(follows):
    spacing = MOTION.spacing / (0.948 if follows == "time" else 1.0)
    problem = replace(MOTION, follows=follows, spacing=spacing)
    found = oscillator.drawn(problem)
    assert found.motion.cycles > 2
    verdict = oscillator.judge(problem, found)
    assert verdict.broken == ()
    assert verdict.residual < 3e-6


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"law": StribeckLaw(0.29)}, "slip errs"),
        ({"oscillator": replace(MOTION.oscillator, damping_ratio=0.171)}, "slip errs"),
        ({"oscillator": replace(MOTION.oscillator, excitation_force_n=66.0)}, "slip errs"),
        ({"follows": "belt"}, "slip errs"),
        ({"nodes": 1.2 * MOTION.nodes}, "slip errs"),
        ({"law": StribeckLaw(0.3, static=0.39)}, "exceeds its limit"),
        ({"law": StribeckLaw(0.3, static=0.41)}, "within the limit"),
    ],
)
def test_motions_of_another_problem_are_rejected(change, reason):
    verdict = oscillator.judge(replace(MOTION, **change), oscillator.drawn(MOTION))
    assert any(reason in line for line in verdict.broken)


def test_changed_events_are_rejected():
    found = oscillator.drawn(MOTION)
    events = found.motion
    first, late = events.kind.copy(), events.time.copy()
    first[0] = 1
    late[3] = late[4] + 0.1
    for change, reason in (({"kind": first}, "alternate"), ({"time": late}, "runs back")):
        changed = replace(found, motion=replace(events, **change))
        assert any(reason in line for line in oscillator.judge(MOTION, changed).broken)
