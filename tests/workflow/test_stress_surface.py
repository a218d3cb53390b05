"""The stress campaign of surfaces: problems by number, judges against known answers, false claims that they catch."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import kv

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution, translate
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.lanczos import leading_modes
from workflow.benchmarks.measure import fields
from workflow.stress import kernels, outcomes, pairs, surface, surface_fit, surface_law
from workflow.stress.surface_judge import judge_embedding, judge_expansion, judge_modes, response
from workflow.stress.surface_problem import ENTRIES, Problem, random_problem
from workflow.stress.surface_waves import judge_waves

GRID = Grid(6, 5, 1e-6, 2e-6)
FIELD = Covariance("matern", 1e-7, 4e-6, 2e-6, 0.4, smoothness=1.5)
PROBLEM = Problem(0, "expansion", GRID, FIELD, 12, None)


def names(verdict: outcomes.Verdict) -> set[str]:
    return {what.split(":")[0] for what in verdict.broken}


# Problems.


def test_a_number_makes_the_same_problem_again_and_another_seed_another():
    assert random_problem(3, 17) == random_problem(3, 17) != random_problem(4, 17)


def test_problems_cover_what_they_should():
    """Of 800 problems; 1 of 30 is expected of the rarest, and then none of it has a chance of exp(-26)."""
    problems = [random_problem(5, number) for number in range(800)]
    assert {problem.entry for problem in problems} == set(ENTRIES)
    assert {problem.covariance.kind for problem in problems} == {*surface_fit.KINDS}
    assert any(problem.grid.nx == 1 and problem.grid.ny > 50 for problem in problems)
    assert any(problem.order == problem.grid.size > 50 for problem in problems)
    assert any(problem.share == 1.0 for problem in problems)
    units = [problem.covariance.rms_height_m for problem in problems]
    assert 1e-12 <= min(units) < 1e-11 < 1e2 < max(units) <= 1e3
    assert max(max(problem.grid.shape) for problem in problems) <= 200


# What the judges are made of.


@pytest.mark.parametrize("nu", [0.05, 1.5, 20.0])
def test_the_judges_matern_is_that_of_the_bessel_function(nu):
    u = np.array([1e-3, 0.1, 1.0, 10.0])
    expected = 2 ** (1 - nu) / math.gamma(nu) * u**nu * kv(nu, u)
    np.testing.assert_allclose(kernels.matern(u, nu), expected, rtol=1e-11)
    assert kernels.matern(np.zeros(1), nu)[0] == 1.0


def test_the_judges_self_affine_kernel_has_the_limits_of_its_spectrum():
    """Bandwidth near 1: the disc, 2 J1(z) / z; lag zero: 1. Next to zero 1 - z^2 E k^2 / 4."""
    z = np.array([0.0, 1e-3, 0.5, 3.0, 40.0])
    disc = np.append(1.0, 2 * kernels.j1(z[1:]) / z[1:])
    np.testing.assert_allclose(kernels.self_affine(z, 0.7, 1 + 1e-12), disc, atol=1e-11)
    mass = 0.5 + (1 - 10**-1.4) / 1.4
    square = (0.25 + (10**0.6 - 1) / 0.6) / mass
    assert kernels.self_affine(z[1:2], 0.7, 10.0)[0] == pytest.approx(1 - 1e-6 * square / 4, abs=1e-11)


def test_pairs_of_translated_normals():
    """Closed forms: the normal itself, a uniform (6 / pi) asin(r / 2), a lognormal."""
    rho = np.array([-0.7, 0.0, 0.3, 0.99])
    for quantile, expected in (
        (lambda g: 3 + 2 * g, rho),
        (surface_law.ndtr, 6 / math.pi * np.arcsin(rho / 2)),
        (lambda g: np.exp(0.5 * g), np.expm1(0.25 * rho) / math.expm1(0.25)),
    ):
        found, error = pairs.pair_correlation(quantile, rho)
        assert np.abs(found - expected).max() <= error < 1e-8
    assert pairs.left_out(lambda g: g**3, 2) == pytest.approx(0.4, abs=1e-10)  # x^3 = H3 + 3 H1: 6 of 15


# Judges of fields.


def test_expansions_that_are_right_pass_and_spoilt_ones_do_not():
    found = karhunen_loeve(FIELD, GRID, 12)
    assert judge_expansion(PROBLEM, found).broken == ()
    swapped = found.modes[::-1].copy()
    tilted = found.modes.copy()
    tilted[3] += 1e-8 * tilted[4]
    spoilt = {
        "the residual": replace(found, modes=tilted),
        "eigenvalues": replace(found, eigenvalues=found.eigenvalues * (1 + 1e-8)),
        "orthonormal": replace(found, modes=swapped),
        "its residuals": replace(found, modes=tilted, residuals=np.zeros(12)),
        "captured variance": replace(found, captured_variance=found.captured_variance + 1e-8),
        "the largest entry is positive": replace(found, modes=-found.modes),
        "fields of another shape, or not finite": replace(found, modes=found.modes * np.nan),
    }
    for name, wrong in spoilt.items():
        assert name in names(judge_expansion(PROBLEM, wrong)), name
    more = replace(PROBLEM, order=None, share=found.captured_variance - 0.3)
    assert "with no mode too many" in names(judge_expansion(more, found))
    assert "carries the share" in names(judge_expansion(replace(more, share=0.9999), found))
    assert "its order" in names(judge_expansion(replace(PROBLEM, order=11), found))


def test_a_mode_left_out_is_seen():
    values, vectors, residuals = leading_modes(FIELD, GRID, 7)
    found = outcomes.verdict_of(judge_modes(PROBLEM, values, vectors, residuals, False))
    assert found.broken == ()
    kept = np.arange(7) != 2
    wrong = outcomes.verdict_of(judge_modes(PROBLEM, values[kept], vectors[kept], residuals[kept], False))
    assert names(wrong) == {"eigenvalues"}


def test_embeddings_that_are_right_pass_and_spoilt_ones_do_not():
    found = embed(FIELD, GRID)
    problem = replace(PROBLEM, entry="embedding", order=None)
    assert judge_embedding(problem, found).broken == ()
    assert response(found).shape == found.torus
    # the root of a correlation a millionth longer, and a sampler that is not linear
    assert "the covariance" in names(judge_embedding(problem, replace(found, root=found.root * (1 + 1e-9))))
    longer = replace(FIELD, correlation_length_m=4e-6 * (1 + 1e-6))
    assert names(judge_embedding(problem, embed(longer, GRID))) == {"the covariance"}


class Bent:
    """An embedding whose heights are squared where they are large."""

    def __init__(self, embedding):
        self.embedding = embedding

    def __getattr__(self, name):
        return getattr(self.embedding, name)

    def sample(self, generator):
        heights = self.embedding.sample(generator)
        return heights + np.maximum(heights / FIELD.rms_height_m - 0.5, 0) ** 2 * FIELD.rms_height_m


def test_a_sampler_that_is_not_linear_is_seen():
    problem = replace(PROBLEM, entry="embedding", number=3)
    assert "linear in its noise" in names(judge_embedding(problem, Bent(embed(FIELD, GRID))))


def test_errors_of_fields_that_are_no_answer():
    assert not surface.honest(PROBLEM, IllPosedError("sample by embedding: use it"))
    long = Covariance("self_affine", 1.0, 1e-3, hurst=0.8, bandwidth=3.0)
    far = replace(PROBLEM, entry="embedding", covariance=long)
    assert surface.honest(far, IllPosedError("use a shorter roll-off"))
    assert not surface.honest(far, IllPosedError("no"))
    assert not surface.honest(far, ParameterError("use larger cells"))
    assert not surface.honest(replace(far, covariance=FIELD), IllPosedError("use a shorter roll-off"))


# Judges of laws.

LAW = surface_law.Problem(1, "translation", FamilyDistribution("beta", 1e-7, (2.1, 5.0)), None, GRID)
WAVES = replace(LAW, kind="waves", waves=WeierstrassMandelbrot(0.7, 1e-7, 1e-4, 1e-5, 3), grid=Grid(5, 4, 1e-6, 1e-6))


def test_translations_that_are_right_pass_and_spoilt_ones_do_not():
    found = translate(LAW.marginal)
    assert surface_law.judge_translation(LAW, found).broken == ()
    assert surface_law.judge_torus(LAW, found).broken == ()
    shares = found.shares.copy()
    shares[:2] += (-1e-6, 1e-6)
    assert "the correlation" in names(surface_law.judge_translation(LAW, replace(found, shares=shares)))
    moved = replace(found, values=found.values + 1e-3 * LAW.marginal.standard_deviation)
    assert names(surface_law.judge_translation(LAW, moved)) == {"heights of the table"}
    other = replace(LAW, marginal=FamilyDistribution("beta", 1e-7, (2.1, 5.001)))
    assert "heights of the table" in names(surface_law.judge_translation(other, found))


def test_waves_that_are_right_pass_and_spoilt_ones_do_not(monkeypatch):
    assert judge_waves(0, WAVES.waves, WAVES.grid).broken == ()
    plain = WeierstrassMandelbrot.waves

    def turned(law):
        kx, ky, a = plain(law)
        return kx * (1 + 1e-9), ky, a

    monkeypatch.setattr(WeierstrassMandelbrot, "waves", turned)
    assert {"the covariance", "the heights"} <= names(judge_waves(0, WAVES.waves, WAVES.grid))


def test_errors_of_laws_that_are_no_answer():
    steps = replace(LAW, marginal=FamilyDistribution("beta", 1.0, (0.03, 0.03)))
    assert surface_law.honest(steps, IllPosedError("use a smoother one"))
    assert not surface_law.honest(LAW, IllPosedError("use a smoother one"))
    assert not surface_law.honest(WAVES, ConvergenceError("use more", 1.0, 1))
    few = replace(WAVES, waves=WeierstrassMandelbrot(0.7, 1e-7, 1e-4, 1e-4))
    assert surface_law.honest(few, ConvergenceError("use more", 1.0, 1))


# The judge of fits.


def fit_problem() -> surface_fit.Problem:
    x = 1e-6 * np.arange(-6.0, 7.0)
    exact = kernels.correlation(FIELD, x[:, None], x)
    data = surface_fit.estimates(x[:, None], x, exact, np.full(exact.shape, 0.01))
    return surface_fit.Problem(0, "exact", "matern", FIELD, data, True, None)


def test_fits_that_are_no_least_squares_are_caught(monkeypatch):
    problem = fit_problem()
    assert surface_fit.judged(problem).broken == ()
    found = fit_covariance("matern", problem.data, 1e-7)
    moved = replace(found, covariance=replace(found.covariance, correlation_length_m=4.1e-6))
    monkeypatch.setattr(surface_fit, "fit_covariance", lambda *_, **__: moved)
    assert {"its misfit", "fewer squares nearby", "the model comes back"} <= names(surface_fit.judged(problem))
    praised = replace(found, standard_errors={**found.standard_errors, "smoothness": -1.0})
    monkeypatch.setattr(surface_fit, "fit_covariance", lambda *_, **__: praised)
    assert names(surface_fit.judged(problem)) == {"errors are not negative"}


def test_a_fit_that_the_lags_tell_must_not_be_refused():
    problem = fit_problem()
    assert not surface_fit.honest(problem, IllPosedError("give more lags"))
    assert surface_fit.honest(replace(problem, source="noise"), IllPosedError("give more lags"))
    assert not surface_fit.honest(replace(problem, source="noise"), IllPosedError("no"))


# The campaign.


@pytest.fixture(scope="module")
def rows() -> list[outcomes.Row]:
    return outcomes.campaign(surface.rows_of, outcomes.SEED, range(120), jobs=1)


def test_problems_of_every_class_without_a_failure(rows):
    assert outcomes.failures(rows) == []
    entries = {fields(row["case"])["entry"] for row in rows}
    assert entries == {*ENTRIES, *surface_law.KINDS, "fit"}
    assert [fields(row["case"])["number"] for row in rows] == [f"{number}" for number in range(120)]


def test_all_bad_input_is_refused():
    refused = surface.refused()
    assert len(refused) > 200
    assert outcomes.failures(refused) == []
