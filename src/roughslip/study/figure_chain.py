"""Numbers of the picture of the chain from surface to limit cycle, with one contact solve for surface and pressure."""

from itertools import chain

import numpy as np

from roughslip import store
from roughslip.figures.figure5 import CYCLE
from roughslip.grid import Grid
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream, surface_model
from roughslip.study.from_scene.domain import Domain, own_cells
from roughslip.study.from_scene.machine import MEDIAN, friction_of, friction_paths
from roughslip.study.job import Job

SOLVED, SHOWN = 128, 96  # cells on an edge of the square
PATHS = 4
LENGTHS = 10  # correlation lengths of a path that are drawn


def surface_and_pressure(job: Job) -> dict[str, store.Variable]:
    """A piece of the surface, and the pressure on it.

    Of a square on the cells of the strips the middle, because the ends of a contact carry more pressure; of a periodic
    cell under its load what surrounds the highest summit.
    """
    scene, scan = job.scene, job.optional("scan")
    cell = scene.strip.cell_m
    if scene.load is not None:
        solved, pressed_by = own_cells(scene, scan), f"nominal pressure {1e-6 * scene.load.nominal_pressure_pa:.3g} MPa"
    else:
        grid, model = Grid(SOLVED, SOLVED, cell, cell), surface_model.surface_model(scene, scan)
        solved = Domain(scene, model, grid, (MEDIAN,), 1, model.sampler(grid), periodic=False)
        pressed_by = f"penetration {MEDIAN:g} %"
    heights = solved.heights(0)
    (solution,) = solved.solutions(heights)
    centre = np.unravel_index(heights.argmax(), heights.shape) if solved.periodic else [n // 2 for n in heights.shape]
    turned = (np.roll(part, [SHOWN // 2 - place for place in centre], (0, 1)) for part in (heights, solution.pressure))
    heights, pressure = (np.tile(part, [-(-SHOWN // n) for n in part.shape])[:SHOWN, :SHOWN] for part in turned)
    job.count(solves=1)
    place = cell * (np.arange(SHOWN) + 0.5)
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
