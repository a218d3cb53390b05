"""The judges of the benchmarks find known errors, and public solvers solve the problem that they are given."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.surface import models
from roughslip.surface.embedding import embed
from roughslip.surface.modes import karhunen_loeve
from workflow.benchmarks import contact_peers, contact_problem, oscillator, surface
from workflow.benchmarks.chaos import MonteCarloReference, Square
from workflow.benchmarks.runner import OURS
from workflow.benchmarks.surface import covariance_of, residual

# Contact.


def test_the_judge_of_contact_convolves_as_a_direct_sum():
    """To rounding: 108 terms of similar size, and transforms of 432 nodes."""
    grid = Grid(12, 9, 1e-6, 2e-6)
    convolution = contact_problem.Convolution(grid, 2e11)
    pressure = np.random.default_rng(5).random(grid.shape)
    i, j = (np.abs(np.subtract.outer(np.arange(n), np.arange(n))) for n in grid.shape)
    matrix = convolution.coefficients[i[:, :, None, None], j[None, None, :, :]]
    assert convolution(pressure) == pytest.approx(np.einsum("ikjm,km->ij", matrix, pressure), rel=1e-14)
    assert convolution(pressure) == pytest.approx(Influence(grid, 2e11).apply(pressure), rel=1e-13)


def test_the_residual_is_zero_at_the_solution_and_one_without_pressure():
    """One node above the plane: its pressure is u_bar / B_00."""
    grid = contact_problem.square(8)
    heights = np.full(grid.shape, -1e-6)
    heights[3, 4] = 1e-9
    problem, judge = contact_problem.Problem(grid, heights, 0.0), contact_problem.Judge(grid)
    pressure = np.maximum(heights, 0.0) / judge.convolution.coefficients[0, 0]
    assert judge.residual(problem, np.zeros(grid.shape)) == 1.0
    assert judge.residual(problem, pressure) < 1e-14
    assert judge.residual(problem, 1.5 * pressure) == pytest.approx(0.5)
    pressure[0, 0] = pressure[3, 4]  # pressure without contact: |min(gap, B_00 p)| = B_00 p
    assert judge.residual(problem, pressure) == pytest.approx(1.0, rel=0.01)


def test_planes_are_at_their_percentile_or_area():
    grid = contact_problem.square(32)
    influence = Influence(grid, contact_problem.MODULUS)
    heights = contact_problem.surface("gauss", grid)
    for level in ("5", "50", "95"):
        plane = contact_problem.plane_height(level, heights, influence)
        assert 100 * np.mean(heights > plane) == pytest.approx(float(level), abs=100 / grid.size)
    plane = contact_problem.plane_height("contact90", heights, influence)
    assert solve(influence, heights - plane).area_fraction == pytest.approx(0.9, abs=0.003)


class Scripted:
    """A peer and a judge in one, whose residual is a function of the setting."""

    def __init__(self, residual_at):
        self.residual_at, self.found = residual_at, []

    def solve(self, problem, load, setting, counting=False):
        self.found.append(self.residual_at(setting))
        return self.found[-1], 7

    def residual(self, problem, pressure):
        return pressure


@pytest.mark.parametrize("factor", [1e-4, 1.0, 30.0])
@pytest.mark.parametrize("first", [1e-7, 1e-9, 1e-12])
def test_a_peer_is_tuned_to_the_loosest_setting_that_meets_the_tolerance(factor, first):
    """To 1e-10, wherever the search starts."""
    peer = Scripted(lambda setting: factor * setting)
    trial = contact_peers.tune(peer, None, 0.0, 1e-10, first, peer)
    assert 1e-10 / contact_peers.STEP <= trial.residual <= 1e-10
    assert trial.setting == pytest.approx(trial.residual / factor)


@pytest.mark.parametrize("stalls", [lambda setting: max(setting, 2e-8), lambda setting: 2e-8 + 1e-20 / setting])
def test_a_peer_that_cannot_meet_the_tolerance_gets_its_least_residual(stalls):
    """The second one becomes worse where its setting is too tight."""
    peer = Scripted(stalls)
    trial = contact_peers.tune(peer, None, 0.0, 1e-10, 1e-9, peer)
    assert trial.residual == min(peer.found) == pytest.approx(2e-8, rel=1e-2)


def products_to_our_solution(peer, kind, level):
    """The products with B that a peer takes to the pressure of ours, to 1e-8 of its maximum."""
    grid = contact_problem.square(24)
    influence = Influence(grid, contact_problem.MODULUS)
    heights = contact_problem.surface(kind, grid)
    problem = contact_problem.Problem(grid, heights, contact_problem.plane_height(level, heights, influence))
    ours = solve(influence, problem.interference, 1e-12)
    pressure, work = peer(grid).solve(problem, ours.mean_pressure, 1e-11, counting=True)
    assert pressure == pytest.approx(ours.pressure, abs=1e-8 * ours.pressure.max())
    return work


def test_polonsky_keer_finds_our_solution():
    """In 32 and 118 products with B; steepest descent would take 52 and 650."""
    assert products_to_our_solution(contact_peers.PolonskyKeer, "gauss", "5") < 40
    assert products_to_our_solution(contact_peers.PolonskyKeer, "gauss", "contact90") < 150


@pytest.mark.parametrize("name", [name for name in contact_peers.PEERS if "/" in name])
def test_public_solvers_find_our_solution(name):
    pytest.importorskip("tamaas" if name.startswith("tamaas") else "ContactMechanics")
    assert products_to_our_solution(contact_peers.PEERS[name], "gauss", "50") > 20  # counted: at least ten steps
    assert products_to_our_solution(contact_peers.PEERS[name], "exp", "contact90") > 20


# Surfaces.


def test_the_residual_of_modes_is_that_of_the_worst():
    """An eigenvalue wrong by a part of the first leaves this part. A lay makes C(x, -y) differ from C(x, y)."""
    grid = Grid(9, 7, 0.1, 0.12)
    covariance = covariance_of("rotated", grid)
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    values, vectors = np.linalg.eigh(covariance(x[:, None] - x, y[:, None] - y))
    found = karhunen_loeve(covariance, grid, 6)
    exact = replace(found, eigenvalues=values[:-7:-1], modes=vectors.T[:-7:-1].reshape(6, *grid.shape))
    assert max(residual(covariance, found), residual(covariance, exact)) < 1e-13
    eigenvalues = found.eigenvalues.copy()
    eigenvalues[4] += 1e-3 * eigenvalues[0]
    assert residual(covariance, replace(found, eigenvalues=eigenvalues)) == pytest.approx(1e-3)


def test_the_covariance_of_a_sample_is_the_mean_over_pairs():
    grid = Grid(12, 9, 0.1, 0.2)
    z, (i, j) = np.random.default_rng(2).standard_normal(grid.shape), surface.lags_of(grid)
    pairs = zip(i.ravel().tolist(), j.ravel().tolist(), strict=True)
    found = dict(zip(pairs, surface.sample_covariance(z, i, j).ravel(), strict=True))
    assert len(found) == 4 * 5  # 0 ... 3 by -2 ... 2
    assert found[0, 0] == pytest.approx(np.mean(z**2))
    assert found[3, 2] == pytest.approx(np.mean(z[:-3, :-2] * z[3:, 2:]))
    assert found[1, -2] == pytest.approx(np.mean(z[:-1, 2:] * z[1:, :-2]))


def test_the_error_of_an_ensemble_is_what_its_torus_adds():
    """A covariance that is larger by 1 % of Sq^2 at all lags differs by 1 % everywhere. A lay shows mirrored lags."""
    grid = surface.square(24)
    covariance = models.covariance_of("exponential", 1.0, 0.2, 0.1, 0.5)
    embedding = embed(covariance, grid)
    assert surface.ensemble_error(covariance, embedding) < 1e-14
    root = embedding.root.copy()
    root[0, 0] = math.sqrt(root[0, 0] ** 2 + 0.01 * math.prod(embedding.torus))
    assert surface.ensemble_error(covariance, replace(embedding, root=root)) == pytest.approx(0.01)


@pytest.mark.parametrize("name", ["gaussian", "exponential"])
def test_gstools_samples_have_the_covariance_of_the_model(name):
    """The mean of 300 samples, within three times the scatter of exact ones, because few waves scatter more.

    The Fourier method is systematically off, by what its few waves leave out.
    """
    pytest.importorskip("gstools")
    grid = surface.square(24)
    covariance, (i, j), r = covariance_of(name, grid), surface.lags_of(grid), np.linspace(0.0, 1.0, 50)
    field = surface.gstools_field(covariance, generator="RandMeth", mode_no=30)
    assert field.model.covariance(r) == pytest.approx(covariance(r, 0 * r), abs=1e-12)
    errors = {}
    for method, waves in ((OURS, 0), ("gstools/randomization", 30), ("gstools/fourier", 16)):
        sampler = surface.PEERS.get(method, surface.set_up_embedding)(covariance, grid, waves)
        mean = np.mean([surface.sample_covariance(sampler(number), i, j) for number in range(300)], axis=0)
        errors[method] = math.sqrt(np.mean((mean - covariance(i * grid.dx, j * grid.dy)) ** 2))
    assert errors["gstools/randomization"] < 3 * errors[OURS]
    assert errors["gstools/fourier"] < 0.2


# The pressure at the centre.


def linear_reference(error: float) -> MonteCarloReference:
    """Contact with probability 0.1, then a pressure uniform on (0, 1)."""
    kept = {"level": [[0.0, 1.0]], "cumulative": [[0.9, 1.0]], "cumulative_standard_error": [[error, error]]}
    return MonteCarloReference({name: np.array(value) for name, value in kept.items()}, 0)


def test_the_distance_is_the_largest_of_both_sides_of_every_step():
    """Ten pressures in a hundred at 0.3: the step is 0.03 below and 0.07 above the reference."""
    pressure = np.repeat([0.0, 0.3], [90, 10])
    assert linear_reference(0.0).distance(pressure) == pytest.approx(0.07)
    assert linear_reference(0.0).distance(np.repeat([0.0, 0.8], [90, 10])) == pytest.approx(0.08)  # below the step
    often = np.concatenate([np.zeros(70), np.linspace(0.01, 0.99, 30)])
    assert linear_reference(0.0).distance(often) == pytest.approx(0.201)  # the atom at zero, and up to 0.01
    assert linear_reference(0.042).distance(pressure) == pytest.approx(math.sqrt(0.07**2 - 0.042**2))
    assert linear_reference(0.08).distance(pressure) == 0


def test_designs_and_solves_are_those_of_the_study():
    """The pool of a Monte Carlo design is the sequence of smaller ones, and solves keep the nodes of the scene."""
    paper = Square("paper")
    pool = paper.design("monte_carlo", 20, 0)
    assert np.array_equal(paper.design("monte_carlo", 10, 1), pool[10:])
    solved = paper.solve(pool[:3])
    expected = solve(paper.influence, paper.surface(solved.xi[2]) - paper.planes[1], 1e-10).pressure
    assert paper.central == 4
    np.testing.assert_allclose(solved.pressure[2, 1], expected[paper.nodes.x, paper.nodes.y], rtol=1e-5, atol=1e2)
    assert np.all(paper.nodes.distance2[: paper.central] < 1e-12)


# Motion.


@pytest.mark.slow
def test_all_methods_find_one_reattachment_point():
    """At 1e-11; scipy steps over the nodes of the path, where its error control leaves about 1e-8."""
    for slip, tolerance in zip(oscillator.choose_slips(8), (1e-8, 1e-5), strict=True):
        exact = oscillator.exact_place(slip)
        assert oscillator.slip_by_roughslip(slip, "fehlberg45", 1e-11)[0] == pytest.approx(exact, rel=1e-9)
        assert oscillator.slip_by_scipy(slip, "DOP853", 1e-11)[0] == pytest.approx(exact, rel=tolerance)


@pytest.mark.parametrize("solver", oscillator.SOLVERS)
def test_diffrax_finds_the_same_point(solver):
    """Without scatter, at 1e-9."""
    pytest.importorskip("diffrax", reason="diffrax is not installed: make benchmark PEERS=1 installs it")
    slip, _ = oscillator.choose_slips(8)
    exact = oscillator.exact_place(slip)
    place, evaluations, count = oscillator.slip_by_diffrax(slip, solver, 3)(1e-9)
    assert place == pytest.approx(exact, rel=1e-7)
    assert count == 3
    assert evaluations > 3 * 100
