"""Judges of surfaces and contacts accept right answers and reject wrong ones."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve
from roughslip.grid import Grid
from roughslip.probability import FamilyDistribution, translate
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.surface.embedding import embed
from roughslip.surface.karhunen_loeve import karhunen_loeve
from roughslip.surface.lanczos import leading_modes
from roughslip.surface.models import covariance_of
from workflow.stress import contact, kernels, surface, surface_fit, surface_heights
from workflow.stress.contact import Displacement
from workflow.stress.contact_problem import ContactProblem
from workflow.stress.runner import Verdict, verdict_of
from workflow.stress.surface_problem import FieldProblem

GRID = Grid(6, 5, 1e-6, 2e-6)
FIELD = covariance_of("matern", 1e-7, 4e-6, 2e-6, 0.4, smoothness=1.5)
EXPANSION = FieldProblem(0, "expansion", GRID, FIELD, 12, None)
EMBEDDING = FieldProblem(3, "embedding", GRID, FIELD, None, None)


def names(found: Verdict) -> set[str]:
    return {line.split(":")[0] for line in found.broken}


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


def test_wrong_embeddings_are_rejected():
    """A root that is too large, and a correlation that is a millionth too long."""
    found = embed(FIELD, GRID)
    longer = embed(replace(FIELD, correlation_length_m=4e-6 * (1 + 1e-6)), GRID)
    assert surface.judge_embedding(EMBEDDING, found).broken == ()
    assert "the covariance" in names(surface.judge_embedding(EMBEDDING, replace(found, root=found.root * (1 + 1e-9))))
    assert names(surface.judge_embedding(EMBEDDING, longer)) == {"the covariance"}


BETA = FamilyDistribution("beta", 1e-7, (2.1, 5.0))
HEIGHTS = surface_heights.HeightProblem(1, "translation", BETA)


def test_wrong_translations_are_rejected():
    found = translate(BETA)
    assert surface_heights.judge_translation(HEIGHTS, found).broken == ()
    assert surface_heights.judge_torus(HEIGHTS, found).broken == ()
    shares = found.shares.copy()
    shares[:2] += (-1e-6, 1e-6)
    assert "the correlation" in names(surface_heights.judge_translation(HEIGHTS, replace(found, shares=shares)))
    moved = replace(found, values=found.values + 1e-3 * BETA.standard_deviation)
    assert names(surface_heights.judge_translation(HEIGHTS, moved)) == {"heights of the table"}


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


MODULUS = 2e11
SOFT = 5e9  # [Pa] a hardness that a third of the pressed nodes reach


def contact_problem(control: str, load: float | None = None) -> ContactProblem:
    """Return a rough surface of 12 x 9 nodes, with the plane at its median or under a load."""
    heights = 1e-7 * np.random.default_rng(8).standard_normal((12, 9))
    planes, grid = () if load else (float(np.median(heights)),), Grid(12, 9, 1e-6, 2e-6)
    return ContactProblem(0, grid, MODULUS, heights, "white", control, planes, load, math.inf, 1e-10, {})


PLANE = contact_problem("plane")
LOAD, PERIODIC = contact_problem("load", 1e9), contact_problem("periodic-load", 1e9)


def solved(problem: ContactProblem, hardness: float = math.inf) -> ContactSolution:
    influence = Influence(problem.grid, problem.modulus, problem.periodic)
    return next(contact.solve_planes(problem, influence, problem.tolerance, hardness))


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
