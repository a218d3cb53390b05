"""Judges of surfaces and contacts accept right answers and reject wrong ones."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.special import kv, ndtr

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load
from roughslip.errors import IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution, translate
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.surface.covariance import Covariance
from roughslip.surface.embedding import embed
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.lanczos import leading_modes
from workflow.stress import contact, kernels, surface, surface_fit, surface_heights
from workflow.stress.contact import Displacement
from workflow.stress.contact_problem import ContactProblem
from workflow.stress.runner import Verdict, verdict_of
from workflow.stress.surface_problem import FieldProblem

GRID = Grid(6, 5, 1e-6, 2e-6)
FIELD = Covariance("matern", 1e-7, 4e-6, 2e-6, 0.4, smoothness=1.5)
EXPANSION = FieldProblem(0, "expansion", GRID, FIELD, 12, None)
EMBEDDING = FieldProblem(3, "embedding", GRID, FIELD, None, None)


def names(found: Verdict) -> set[str]:
    return {line.split(":")[0] for line in found.broken}


@pytest.mark.parametrize("nu", [0.05, 1.5, 20.0])
def test_the_judges_matern_is_that_of_the_bessel_function(nu):
    u = np.array([1e-3, 0.1, 1.0, 10.0])
    expected = 2 ** (1 - nu) / math.gamma(nu) * u**nu * kv(nu, u)
    np.testing.assert_allclose(kernels.matern(u, nu), expected, rtol=1e-11)


def test_the_judges_self_affine_kernel_has_the_limits_of_its_spectrum():
    """Bandwidth near 1: the disc, 2 J1(z) / z. Near zero: 1 - z^2 E k^2 / 4."""
    z = np.array([0.0, 1e-3, 0.5, 3.0, 40.0])
    disc = np.append(1.0, 2 * kernels.j1(z[1:]) / z[1:])
    np.testing.assert_allclose(kernels.self_affine(z, 0.7, 1 + 1e-12), disc, atol=1e-11)
    square = (0.25 + (10**0.6 - 1) / 0.6) / (0.5 + (1 - 10**-1.4) / 1.4)
    assert kernels.self_affine(z[1:2], 0.7, 10.0)[0] == pytest.approx(1 - 1e-6 * square / 4, abs=1e-11)


def test_correlations_of_translated_normals_have_their_closed_forms():
    """The normal itself, a uniform (6 / pi) asin(r / 2), and a lognormal."""
    rho = np.array([-0.7, 0.0, 0.3, 0.99])
    for quantile, expected in (
        (lambda g: 3 + 2 * g, rho),
        (ndtr, 6 / math.pi * np.arcsin(rho / 2)),
        (lambda g: np.exp(0.5 * g), np.expm1(0.25 * rho) / math.expm1(0.25)),
    ):
        found, error = kernels.pair_correlation(quantile, rho)
        assert np.abs(found - expected).max() <= error < 1e-8
    assert kernels.left_out(lambda g: g**3, 2) == pytest.approx(0.4, abs=1e-10)  # x^3 = H3 + 3 H1: 6 of 15


def test_wrong_expansions_are_rejected():
    found = karhunen_loeve(FIELD, GRID, 12)
    assert surface.judge_expansion(EXPANSION, found).broken == ()
    tilted = found.modes.copy()
    tilted[3] += 1e-8 * tilted[4]
    wrong = {
        "the residual": replace(found, modes=tilted),
        "eigenvalues": replace(found, eigenvalues=found.eigenvalues * (1 + 1e-8)),
        "orthonormal": replace(found, modes=found.modes[::-1]),
        "its residuals": replace(found, modes=tilted, residuals=np.zeros(12)),
        "captured variance": replace(found, captured_variance=found.captured_variance + 1e-8),
        "the largest entry is positive": replace(found, modes=-found.modes),
        "fields of another shape, or not finite": replace(found, modes=found.modes * np.nan),
    }
    for name, answer in wrong.items():
        assert name in names(surface.judge_expansion(EXPANSION, answer)), name
    more = replace(EXPANSION, order=None, share=found.captured_variance - 0.3)
    assert "with no mode too many" in names(surface.judge_expansion(more, found))
    assert "carries the share" in names(surface.judge_expansion(replace(more, share=0.9999), found))
    assert "its order" in names(surface.judge_expansion(replace(EXPANSION, order=11), found))


def test_a_missing_mode_is_detected():
    modes = leading_modes(FIELD, GRID, 7)
    assert verdict_of(surface.judge_modes(EXPANSION, *modes, False)).broken == ()
    kept = (part[np.arange(7) != 2] for part in modes)
    assert names(verdict_of(surface.judge_modes(EXPANSION, *kept, False))) == {"eigenvalues"}


class Bent:
    """An embedding whose heights are squared where they are large."""

    def __init__(self, embedding):
        self.embedding = embedding

    def __getattr__(self, name):
        return getattr(self.embedding, name)

    def sample(self, generator):
        heights = self.embedding.sample(generator)
        return heights + np.maximum(heights / FIELD.rms_height_m - 0.5, 0) ** 2 * FIELD.rms_height_m


def test_wrong_embeddings_are_rejected():
    """A root that is too large, a correlation that is a millionth too long, and a sampler that is not linear."""
    found = embed(FIELD, GRID)
    longer = embed(replace(FIELD, correlation_length_m=4e-6 * (1 + 1e-6)), GRID)
    assert surface.judge_embedding(EMBEDDING, found).broken == ()
    assert "the covariance" in names(surface.judge_embedding(EMBEDDING, replace(found, root=found.root * (1 + 1e-9))))
    assert names(surface.judge_embedding(EMBEDDING, longer)) == {"the covariance"}
    assert "linear in its noise" in names(surface.judge_embedding(EMBEDDING, Bent(found)))


def test_errors_that_answer_no_field_problem():
    advice = IllPosedError("use a shorter roll-off")
    long = replace(EMBEDDING, covariance=Covariance("self_affine", 1.0, 1e-3, hurst=0.8, bandwidth=3.0))
    assert surface.is_answer(long, advice)
    assert not surface.is_answer(long, IllPosedError("no"))
    assert not surface.is_answer(long, ParameterError("use larger cells"))
    assert not surface.is_answer(EMBEDDING, advice)
    assert not surface.is_answer(EXPANSION, advice)


BETA = FamilyDistribution("beta", 1e-7, (2.1, 5.0))
HEIGHTS = surface_heights.HeightProblem(
    1, "translation", BETA, WeierstrassMandelbrot(0.7, 1e-7, 1e-4, 1e-5, 3), Grid(5, 4, 1e-6, 1e-6)
)


def test_wrong_translations_are_rejected():
    found = translate(BETA)
    assert surface_heights.judge_translation(HEIGHTS, found).broken == ()
    assert surface_heights.judge_torus(HEIGHTS, found).broken == ()
    shares = found.shares.copy()
    shares[:2] += (-1e-6, 1e-6)
    assert "the correlation" in names(surface_heights.judge_translation(HEIGHTS, replace(found, shares=shares)))
    moved = replace(found, values=found.values + 1e-3 * BETA.standard_deviation)
    assert names(surface_heights.judge_translation(HEIGHTS, moved)) == {"heights of the table"}
    steps = replace(HEIGHTS, marginal=FamilyDistribution("beta", 1.0, (0.03, 0.03)))
    assert surface_heights.is_answer(steps, IllPosedError("use a smoother one"))
    assert not surface_heights.is_answer(HEIGHTS, IllPosedError("use a smoother one"))


def test_wrong_waves_are_rejected(monkeypatch):
    waves = HEIGHTS.waves
    assert surface_heights.judge_waves(0, waves, HEIGHTS.grid).broken == ()
    plain = WeierstrassMandelbrot.waves

    def turned(law):
        kx, ky, a = plain(law)
        return kx * (1 + 1e-9), ky, a

    monkeypatch.setattr(WeierstrassMandelbrot, "waves", turned)
    assert {"the covariance", "the heights"} <= names(surface_heights.judge_waves(0, waves, HEIGHTS.grid))


def test_fits_that_are_no_minimum_are_rejected(monkeypatch):
    x = 1e-6 * np.arange(-6.0, 7.0)
    exact = kernels.correlation(FIELD, x[:, None], x)
    data = surface_fit.estimates(x[:, None], x, exact, np.full(exact.shape, 0.01))
    problem = surface_fit.FitProblem(0, "exact", "matern", FIELD, data, True, None)
    assert surface_fit.judged(problem).broken == ()
    found = fit_covariance("matern", data, 1e-7)
    moved = replace(found, covariance=replace(found.covariance, correlation_length_m=4.1e-6))
    monkeypatch.setattr(surface_fit, "fit_covariance", lambda *_, **__: moved)
    assert {"its misfit", "fewer squares nearby", "the model comes back"} <= names(surface_fit.judged(problem))
    assert not surface_fit.is_answer(problem, IllPosedError("give more lags"))
    assert surface_fit.is_answer(replace(problem, source="noise"), IllPosedError("give more lags"))


MODULUS = 2e11
SOFT = 5e9  # [Pa] a hardness that a third of the pressed nodes reach


@pytest.mark.parametrize(
    ("x", "y", "dx", "dy"), [(0, 0, 1, 1), (1, 0, 1, 1), (1, 2, 1, 1), (30, 2, 10, 0.1), (41, 0, 10, 0.1)]
)
def test_the_judges_love_coefficient_is_the_integral(x, y, dx, dy):
    found = contact.love(np.array([[x]], dtype=np.longdouble), np.array([[y]], dtype=np.longdouble), dx, dy)
    expected = 4 * math.asinh(1)  # of the unit square at its centre
    if (x, y) != (0, 0):
        bounds = (-dx / 2, dx / 2, -dy / 2, dy / 2)
        expected, _ = dblquad(lambda v, u: 1 / math.hypot(x - u, y - v), *bounds, epsabs=0, epsrel=1e-12)
    assert float(found[0, 0]) == pytest.approx(expected, rel=1e-12)


def test_the_judges_sum_and_transform_agree_in_long_doubles(monkeypatch):
    grid = Grid(21, 12, 30.0, 1.0)
    pressure = np.random.default_rng(2).random(grid.shape)
    plain = Displacement(grid, MODULUS, False)(pressure)
    monkeypatch.setattr(contact, "SUMMED", 1)
    transformed = Displacement(grid, MODULUS, False)(pressure)
    assert float(np.abs(transformed / plain - 1).max()) < 100 * np.finfo(np.longdouble).eps


def test_the_judges_periodic_cell_is_the_sum_over_its_images():
    """Over M images each way odd powers of 1/M remain: extrapolation removes the first, the third is below 1e-5."""
    grid = Grid(4, 3, 1.0, 1.5)
    pressure = np.random.default_rng(4).random(grid.shape)

    def summed(images: int) -> np.ndarray:
        period = 2 * images + 1
        wide = Grid(grid.nx * period, grid.ny * period, grid.dx, grid.dy)
        displacement = Displacement(wide, 1.0, False)(np.tile(pressure - pressure.mean(), (period, period)))
        return displacement[images * grid.nx :, images * grid.ny :][: grid.nx, : grid.ny]

    expected = (12.5 * summed(12) - 6.5 * summed(6)) / 6  # The windows end at M + 1/2 cells.
    found = Displacement(grid, 1.0, True)(pressure)
    off = (found - found[0, 0]) - (expected - expected[0, 0])
    assert float(np.abs(off).max()) < 2e-5 * float(np.ptp(found))


def contact_problem(control: str, load: float | None = None) -> ContactProblem:
    """Return a rough surface of 12 x 9 nodes, with the plane at its median or under a load."""
    heights = 1e-7 * np.random.default_rng(8).standard_normal((12, 9))
    planes, grid = () if load else (float(np.median(heights)),), Grid(12, 9, 1e-6, 2e-6)
    return ContactProblem(0, grid, MODULUS, heights, "white", control, planes, load, math.inf, 1e-10, {})


PLANE = contact_problem("plane")
LOAD, PERIODIC = contact_problem("load", 1e9), contact_problem("periodic-load", 1e9)


def solved(problem: ContactProblem, hardness: float = math.inf) -> ContactSolution:
    influence = Influence(problem.grid, problem.modulus, problem.periodic)
    if problem.load is not None:
        return solve_load(influence, problem.heights, problem.load, problem.tolerance, hardness_pa=hardness)
    return solve(influence, problem.heights - problem.planes[0], problem.tolerance, hardness_pa=hardness)


def verdict(problem: ContactProblem, solution: ContactSolution, hardness: float = math.inf) -> Verdict:
    displacement = Displacement(problem.grid, problem.modulus, problem.periodic)
    return contact.judge(problem, displacement, solution, problem.planes[0] if problem.planes else None, hardness)


@pytest.mark.parametrize("problem", [PLANE, LOAD, PERIODIC], ids=["plane", "load", "periodic"])
@pytest.mark.parametrize("hardness", [math.inf, SOFT], ids=["elastic", "capped"])
def test_right_contacts_are_accepted(problem, hardness):
    found = verdict(problem, solved(problem, hardness), hardness)
    assert found.broken == ()
    assert found.residual <= 1e-10


def changed(solution: ContactSolution, field: str, node: tuple, value: float) -> ContactSolution:
    values = getattr(solution, field).copy()
    values[node] = value
    return replace(solution, **{field: values})


def test_wrong_contacts_are_rejected():
    """Each field of a right solution changed in turn; small changes are a hundred times the tolerance."""
    elastic, capped = solved(PLANE), solved(PLANE, SOFT)
    u_bar = PLANE.heights - PLANE.planes[0]
    pressed, open_ = (tuple(np.argwhere(mask)[0]) for mask in (elastic.contact, ~elastic.contact))
    between = tuple(np.argwhere(capped.contact & (capped.pressure < SOFT))[0])
    at_cap = tuple(np.argwhere(capped.plastic_displacement > 0)[0])
    small = 1e-8 * float(np.linalg.norm(np.maximum(u_bar, 0)))  # [m]
    p, rate = float(elastic.pressure[pressed]), float(Displacement(PLANE.grid, MODULUS, False).diagonal)
    wrong = {
        "the residual": (changed(elastic, "pressure", pressed, p + small / rate), math.inf),
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
        assert name in names(verdict(PLANE, solution, hardness)), name
    for grid, modulus in ((PLANE.grid, MODULUS * (1 + 1e-8)), (Grid(12, 9, 1e-6, 2e-6 * (1 + 1e-7)), MODULUS)):
        assert "the residual" in names(verdict(PLANE, solve(Influence(grid, modulus), u_bar)))


@pytest.mark.parametrize("problem", [LOAD, PERIODIC], ids=["free", "periodic"])
def test_wrong_contacts_under_a_load_are_rejected(problem):
    solution = solved(problem)
    assert names(verdict(replace(problem, load=(1 + 1e-11) * problem.load), solution)) == {"the load"}
    reach = float(np.linalg.norm(np.maximum(problem.heights - solution.plane, 0)))
    moved = names(verdict(problem, replace(solution, plane=solution.plane + 1e-8 * reach)))
    assert {"the residual", "gap = 0 where p > 0"} <= moved
