"""Stage square_pilot: what the cells and the modes of the square leave in the distribution of the pressure.

Exact surfaces are solved at the centre on the cells of the scene, on cells of twice the edge, and with the modes of the
scene alone. The error of the mesh is first order in the cell, so that it is as large as the change on doubling it.
Without the error at edges it is second order, a third of that change. An accuracy that these two do not leave room for
is refused before anything else is solved. What few surfaces give by chance is taken off both changes.
"""

import math

import numpy as np

from roughslip import store
from roughslip.chaos.sampling import distance_beyond_chance
from roughslip.contact.at_nodes import solve_at
from roughslip.contact.influence import Influence
from roughslip.grid import Grid
from roughslip.probability.pilot import Pilot
from roughslip.scene.accuracy import KOLMOGOROV_95, SHARE
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import elastic, geometry
from roughslip.stages.from_scene.square import PRECISION, Square, square
from roughslip.stages.runtime.command import Job
from roughslip.surface.modes import heights

STAGE = Stage(
    name="square_pilot",
    reads="seed material roughness square.edge_m square.nodes square.penetration_percentile square.monte_carlo_samples "
    "numerics.contact_tolerance numerics.contact_area accuracy.pressure",
    inputs={"surface": "karhunen_loeve"},
    optional={"scan": "scan"},
    result="contact/square_pilot.nc",
    runs_if="accuracy.pressure",
)

SURFACES = 1000  # at least
PART = 1 / 3  # of the samples that the accuracy takes


def pressures(
    problem: Square, coarse: Influence, exact: np.ndarray, eigenvalues: np.ndarray, *, points: bool
) -> list[float]:
    """[Pa] at the centre of one surface, with all modes, on cells of twice the edge, with the modes of the scene.

    exact : (nx, ny) [m] the surface; eigenvalues : (M,) [m2] of the modes; points : as of `solve_at`
    """
    modes, centre = problem.modes, problem.grid.nx // 2
    first = centre % 2
    variables = np.einsum("kij,ij->k", modes, exact) / eigenvalues
    solves = (
        (problem.influence, exact, centre),
        (coarse, exact[first::2, first::2], centre // 2),
        (problem.influence, heights(modes, variables), centre),
    )
    values = []
    for influence, field, node in solves:
        rough = np.ascontiguousarray(problem.model.heights(field) - problem.plane_m)
        at = np.array([node]), np.array([node])
        solution = solve_at(
            influence, rough, at, PRECISION, problem.tolerance, hardness_pa=problem.hardness_pa, points=points
        )
        values.append(float(solution.pressure[0]))
    return values


def coarser(grid: Grid) -> Grid:
    """Cells of twice the edge, whose nodes are every other one of the mesh, its centre among them."""
    nx, ny = (len(range(n // 2 % 2, n, 2)) for n in grid.shape)
    return Grid(nx, ny, 2 * grid.dx, 2 * grid.dy)


def work(job: Job) -> None:
    """Write both errors. Raises IllPosedError where the accuracy asked is out of their reach."""
    scene, problem = job.scene, square(job)
    asked, samples = scene.accuracy.pressure, int(scene.square.monte_carlo_samples)
    points = elastic.counts_shares(scene)
    coarse = elastic.influence(scene, coarser(problem.grid))
    with job.usage.core():
        sample = problem.model.sampler(problem.grid)
        eigenvalues = np.einsum("kij,kij->k", problem.modes, problem.modes)
        count = max(SURFACES, round(PART * (KOLMOGOROV_95 / (SHARE * asked)) ** 2))
        seeds = ([scene.seed, geometry.STREAM_SQUARE_PILOT, number] for number in range(count))
        surfaces = (sample(np.random.default_rng(seed)) for seed in seeds)
        values = np.array([pressures(problem, coarse, exact, eigenvalues, points=points) for exact in surfaces])
        rng = np.random.default_rng([scene.seed, geometry.STREAM_SQUARE_PILOT])
        change, modes = (distance_beyond_chance(values[:, 0], values[:, other], rng) for other in (1, 2))
        mesh = change / 3 if points else change
    sampling = KOLMOGOROV_95 / math.sqrt(samples)
    expected = mesh + modes + sampling
    shown = {"asked": asked, "expected": expected, "from_cells": mesh, "from_modes": modes}
    job.usage.count(surfaces=count, **{f"pressure_{name}": round(value, 5) for name, value in shown.items()})
    Pilot(
        {"pressure": asked},
        lambda accuracy: samples if mesh + modes <= (1 - SHARE) * accuracy["pressure"] else None,
        lambda: (
            "take more square.nodes or square.modes, as cells leave "
            f"{mesh:.2g} of the distribution and missing modes {modes:.2g}"
        ),
        margin=1.1,
    ).numbers()
    titles = {
        "mesh": (mesh, "cells"),
        "modes": (modes, "modes that are left out"),
        "sampling": (sampling, "few samples"),
    }
    variables = {
        name: store.Variable((), value, "1", f"error of the distribution of the pressure from {source}")
        for name, (value, source) in titles.items()
    }
    store.write(job.arguments.output, variables, job.key)
