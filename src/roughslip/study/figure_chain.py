"""Numbers of the picture of the chain from surface to limit cycle, with one contact solve for surface and pressure."""

from itertools import chain

import numpy as np

from roughslip import store
from roughslip.contact.solve import solve
from roughslip.figures.figure5 import CYCLE
from roughslip.grid import Grid
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream, elastic, surface_model
from roughslip.study.from_scene.domain import own_cells
from roughslip.study.from_scene.machine import MEDIAN, friction_of, friction_paths
from roughslip.study.job import Job

SOLVED, SHOWN = 128, 96  # cells on an edge of the square
PATHS = 4
LENGTHS = 10  # correlation lengths of a path that are drawn


def under_a_plane(job: Job) -> tuple[np.ndarray, np.ndarray]:
    """Heights [m] and pressure [Pa] of the middle of a square of the surface, on the cells of the strips."""
    scene, cell = job.scene, job.scene.strip.cell_m
    grid, model = Grid(SOLVED, SOLVED, cell, cell), surface_model.surface_model(scene, job.optional("scan"))
    heights = model.heights(model.sampler(grid)(np.random.default_rng([scene.seed, Stream.STRIP, 0])))
    tolerance, hardness = scene.numerics.contact_tolerance, elastic.hardness_pa(scene)
    rough = heights - float(model.plane_height(np.array([MEDIAN]))[0])
    solution = solve(elastic.influence(scene, grid), rough, tolerance, hardness_pa=hardness)
    middle = slice((SOLVED - SHOWN) // 2, (SOLVED + SHOWN) // 2)  # the ends of a contact carry more pressure
    return heights[middle, middle], solution.pressure[middle, middle]


def under_the_load(job: Job) -> tuple[np.ndarray, np.ndarray]:
    """The same around the highest summit of a periodic cell under its load."""
    cells = own_cells(job.scene, job.optional("scan"))
    heights = cells.heights(0)
    (solution,) = cells.solutions(heights)
    summit = np.unravel_index(heights.argmax(), heights.shape)
    turned = (np.roll(part, [SHOWN // 2 - place for place in summit], (0, 1)) for part in (heights, solution.pressure))
    heights, pressure = (np.tile(part, [-(-SHOWN // n) for n in part.shape])[:SHOWN, :SHOWN] for part in turned)
    return heights, pressure


def surface_and_pressure(job: Job) -> dict[str, store.Variable]:
    """A piece of the surface, and the pressure on it."""
    if job.scene.load is not None:
        heights, pressure = under_the_load(job)
        pressed_by = f"nominal pressure {1e-6 * job.scene.load.nominal_pressure_pa:.3g} MPa"
    else:
        heights, pressure = under_a_plane(job)
        pressed_by = f"penetration {MEDIAN:g} %"
    job.count(solves=1)
    place = job.scene.strip.cell_m * (np.arange(SHOWN) + 0.5)
    return {
        "pressed_by": store.Variable((), pressed_by, "1", "what presses the surface"),
        "x": store.Variable(("x",), place, "m", "place along the path"),
        "y": store.Variable(("y",), place, "m", "place across the path"),
        "height": store.Variable(("x", "y"), heights, "m", "height of the surface"),
        "pressure": store.Variable(("x", "y"), pressure, "Pa", "contact pressure"),
    }


def friction_along_paths(job: Job) -> dict[str, store.Variable]:
    """The friction coefficient along the paths of the first runs, from their beginning."""
    scene, friction = job.scene, job.optional("friction")
    own, count = friction_of(scene, friction), LENGTHS * scene.ensemble.nodes_per_correlation_length + 1
    paths = friction_paths(scene, own)
    seeds = ([scene.seed, Stream.PROCESS, number] for number in range(PATHS))
    drawn = np.stack([np.fromiter(chain.from_iterable(paths.realisation(seed)), float, count) for seed in seeds])
    place = paths.spacing * np.arange(drawn.shape[1])
    return {
        "path": store.Variable(("path",), place, "m", "slipped distance"),
        "friction": store.Variable(
            ("run", "path"), own.mean + own.unit * drawn, "1", "friction coefficient of the runs"
        ),
        "friction_mean": store.Variable((), own.mean, "1", "its mean"),
    }


def numbers(scene: Scene, job: Job) -> dict[str, store.Variable]:
    """Return what the picture shows of surface, pressure, friction and cycles."""
    cycles = store.read(job.path("cycles"))
    shown = {name: cycles.variable(name) for name in CYCLE}
    return surface_and_pressure(job) | friction_along_paths(job) | shown
