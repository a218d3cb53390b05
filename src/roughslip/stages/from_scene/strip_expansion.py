"""Block sums of strips from the pressure expansion instead of contact solves.

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
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic, expansion, geometry, surface_model
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

FAR = 1.4  # correlation lengths beyond which contacts act by their force alone; measured, docs/notebook/friction.md


def expand_strips(job: Job, numbers: range, solved: int) -> tuple[np.ndarray, np.ndarray]:
    """Contact area [m2] and normal force [N] (strips, levels, blocks) of the strips of these numbers.

    solved : number of strips that are solved, the first ones; of the others the lattice alone is drawn
    """
    scene, arguments = job.scene, job.arguments
    grid, model = geometry.strip_grid(scene), surface_model.surface_model(scene, arguments.scan)
    stored, target = store.read(arguments.expansion), expansion.target(scene, model, grid)
    lattice = geometry.lattice(scene)
    stencil = expansion.stencil(model, lattice.grid)
    fitted = StripExpansion(stored["indices"], stored["whiten"], stored["coefficients"], stencil, target)
    tables = (stored[name] for name in ("table_low", "table_step", "scatter", "contact", "mean_pressure"))
    means = ConditionalMeans(target, *tables)
    planes = model.plane_height(np.array(scene.strip.penetration_percentiles, dtype=float))
    reach = 1 + math.floor(FAR * model.lengths_m[0] / lattice.grid.dx)
    kernel = column_influence(elastic.influence(scene, grid), lattice.spacing, reach)
    mean_force = lattice.spacing * stored["column_force"][:, None]
    columns_of_block = geometry.block_nodes(scene)[0] // lattice.spacing
    draw = sampler(scene, model, grid, lattice, solved)
    count, levels = len(numbers), len(planes)
    blocks = (lattice.middle.stop - lattice.middle.start) // columns_of_block
    area, force = np.empty((2, count, levels, blocks))
    with job.usage.core():
        for row, number in enumerate(numbers):
            columns = lattice.grid.cell_area * np.stack(
                [field.sum(axis=2) for field in means.at(fitted.predicted(draw(number), lattice.middle))]
            )
            lifted = displacement(kernel, columns[1] - mean_force)
            columns = at_displaced_planes(columns, planes, lifted)[..., : blocks * columns_of_block]
            area[row], force[row] = columns.reshape(2, levels, blocks, columns_of_block).sum(axis=3)
            job.usage.progress(row + 1, count)
    job.usage.count(expansions=count * levels)
    job.usage.skip({skip_reasons.SMOOTH: count * (grid.nx - lattice.grid.nx)})
    return area, force


def sampler(
    scene: Scene, model: surface_model.SurfaceModel, grid: Grid, lattice: geometry.Lattice, solved: int
) -> Callable[[int], np.ndarray]:
    """A function that gives the field (nx, ny) [m] of a strip on the lattice by its number.

    Of a solved strip these are columns of the whole field, of any other the lattice alone is drawn, of the same law.
    """
    whole, alone = (surface_model.strip_fields(scene, model, mesh) for mesh in (grid, lattice.grid))
    return lambda number: lattice.of(whole(number)) if number < solved else alone(number)
