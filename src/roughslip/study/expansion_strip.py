"""Stage expansion_strip: block sums of strips from the pressure expansion instead of contact solves.

Strips are numbered as in stage contact and drawn from the same streams. The first are the solved strips, for
which the expansion is a control variate; the others are new. Area and force are what the expansion expects of them
given its prediction (`chaos/scatter.py`), at a plane that far contacts move (`contact/influence.py`).
"""

import math
from collections.abc import Callable

import numpy as np

from roughslip import store
from roughslip.chaos.strip import ConditionalMeans, StripExpansion
from roughslip.contact.influence import at_displaced_planes, column_influence, displacement
from roughslip.grid import Grid
from roughslip.scene.part import Scene
from roughslip.study.from_scene import elastic, expansion, geometry, surface_model
from roughslip.study.job import Job

FAR = 1.4  # correlation lengths beyond which contacts act by their force alone; measured, docs/notebook/friction.md


def work(scene: Scene, job: Job) -> None:
    """Write contact area and normal force of every block; of no strip where the expansion is missing."""
    stored, strips = store.read(job.path("expansion")), scene.strip.expansion_samples
    if "missed" in stored:
        none = store.Variable(("sample",), np.empty(0), "1", "number of the strip")
        store.write(job.output, {"number": none}, job.key, {"first": 0, "model": "none"})
        return
    grid, model = geometry.strip_grid(scene), surface_model.surface_model(scene, job.optional("scan"))
    target = expansion.target(scene, model, grid)
    lattice = geometry.lattice(scene)
    stencil = expansion.stencil(model, lattice.grid)
    fitted = StripExpansion(stored["indices"], stored["whiten"], stored["coefficients"], stencil, target)
    expected = np.stack([stored["contact"], stored["mean_pressure"]], axis=2)
    means = ConditionalMeans(target, stored["table_low"], stored["table_step"], stored["scatter"], expected)
    percentiles = np.array(scene.strip.penetration_percentiles, dtype=float)
    planes = model.plane_height(percentiles)
    reach = 1 + math.floor(FAR * model.lengths_m[0] / lattice.grid.dx)
    kernel = column_influence(elastic.influence(scene, grid), lattice.spacing, reach)
    mean_force = lattice.spacing * stored["column_force"][:, None]
    columns_of_block = geometry.block_nodes(scene)[0] // lattice.spacing
    blocks = (lattice.middle.stop - lattice.middle.start) // columns_of_block
    draw = sampler(scene, model, grid, lattice)
    sums = np.empty((2, strips, len(planes), blocks, 1))
    for number in range(strips):
        columns = lattice.grid.cell_area * means.summed(fitted.predicted(draw(number), lattice.middle))
        lifted = displacement(kernel, columns[1] - mean_force)
        columns = at_displaced_planes(columns, planes, lifted)[..., : blocks * columns_of_block]
        sums[:, number, :, :, 0] = columns.reshape(2, len(planes), blocks, columns_of_block).sum(axis=3)
        job.progress(number + 1, strips)
    job.count(expansions=strips * len(planes))
    of_blocks = ("sample", "level", "along", "across")
    variables = {
        "number": store.Variable(("sample",), np.arange(strips), "1", "number of the strip"),
        "at": store.Variable(("level",), percentiles, "percent", "share of heights above the plane"),
        "area": store.Variable(of_blocks, sums[0], "m2", "contact area of a block"),
        "force": store.Variable(of_blocks, sums[1], "N", "normal force on it"),
    }
    store.write(job.output, variables, job.key, {"first": 0, "model": "expansion"})


def sampler(
    scene: Scene, model: surface_model.SurfaceModel, grid: Grid, lattice: geometry.Lattice
) -> Callable[[int], np.ndarray]:
    """A function that gives the field (nx, ny) [m] of a strip on the lattice by its number.

    Of a solved strip these are columns of the whole field, of any other the lattice alone is drawn, of the same law.
    """
    whole, alone = (surface_model.strip_fields(scene, model, mesh) for mesh in (grid, lattice.grid))
    return lambda number: lattice.of(whole(number)) if number < scene.strip.samples else alone(number)
