"""Stage expansion_strip: block sums of strips from an expansion of the pressure instead of contact solves.

The expansion is fitted to the training columns of the solved strips. Strips are numbered as in stage contact and drawn
from the same streams. The first are the solved strips, for which the expansion is a control variate; the others are
new. Area and force are what the expansion expects of them given its prediction (`chaos/scatter.py`), at a plane that
far contacts move (`contact/influence.py`).
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from roughslip import store
from roughslip.chaos.strip import (
    ConditionalMeans,
    StripExpansion,
    conditional_means,
    fit_strip,
    on_all_rows,
    turned_to_half,
)
from roughslip.chaos.variables import MIRRORED, NAMES, NO_SYMMETRY, Stencil, local_functionals
from roughslip.contact.influence import at_displaced_planes, column_influence, displacement
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.scene.part import Scene
from roughslip.study.from_scene import elastic, expansion, geometry, surface_model
from roughslip.study.job import Job

FAR = 1.4  # correlation lengths beyond which contacts act by their force alone; measured, docs/notebook/friction.md


class Fitted(NamedTuple):
    """What the training strips say: the expansion on all rows, and what is expected at a predicted target.

    force : (levels,) [N] mean on a column of the training strips
    missed : (ny, levels) [-] share of the variance of the target that predictions of left-out strips miss
    """

    expansion: StripExpansion
    means: ConditionalMeans
    force: np.ndarray
    missed: np.ndarray


def work(scene: Scene, job: Job) -> None:
    """Write contact area and normal force of every block.

    Of no strip where the training strips cannot determine the expansion: friction then takes the solves alone.
    """
    grid, model = geometry.strip_grid(scene), surface_model.surface_model(scene, job.optional("scan"))
    lattice, strips = geometry.lattice(scene), scene.strip.expansion_samples
    try:
        fitted = fit(job, model, grid, lattice)
    except IllPosedError as error:
        job.warn(f"no expansion of the strips, and friction is that of the solved strips alone: {error.in_scene}")
        none = store.Variable(("sample",), np.empty(0), "1", "number of the strip")
        store.write(job.output, {"number": none}, job.key, {"first": 0, "model": "none"})
        return
    percentiles = np.array(scene.strip.penetration_percentiles, dtype=float)
    planes = model.plane_height(percentiles)
    reach = 1 + math.floor(FAR * model.lengths_m[0] / lattice.grid.dx)
    kernel = column_influence(elastic.influence(scene, grid), lattice.spacing, reach)
    mean_force = lattice.spacing * fitted.force[:, None]
    columns_of_block = geometry.block_nodes(scene)[0] // lattice.spacing
    blocks = (lattice.middle.stop - lattice.middle.start) // columns_of_block
    draw = sampler(scene, model, grid, lattice)
    sums = np.empty((2, strips, len(planes), blocks, 1))
    for number in range(strips):
        predicted = fitted.expansion.predicted(draw(number), lattice.middle)
        columns = lattice.grid.cell_area * fitted.means.summed(predicted)
        lifted = displacement(kernel, columns[1] - mean_force)
        columns = at_displaced_planes(columns, planes, lifted)[..., : blocks * columns_of_block]
        sums[:, number, :, :, 0] = columns.reshape(2, len(planes), blocks, columns_of_block).sum(axis=3)
        job.progress(number + 1, strips)
    job.count(fits=fitted.missed.size, expansions=strips * len(planes))
    of_blocks, title = ("sample", "level", "along", "across"), "share of the variance that left-out strips miss"
    variables = {
        "number": store.Variable(("sample",), np.arange(strips), "1", "number of the strip"),
        "at": store.Variable(("level",), percentiles, "percent", "share of heights above the plane"),
        "area": store.Variable(of_blocks, sums[0], "m2", "contact area of a block"),
        "force": store.Variable(of_blocks, sums[1], "N", "normal force on it"),
        "leave_one_out": store.Variable(("y", "level"), fitted.missed, "1", title),
    }
    store.write(job.output, variables, job.key, {"first": 0, "model": "expansion"})


def fit(job: Job, model: surface_model.SurfaceModel, grid: Grid, lattice: geometry.Lattice) -> Fitted:
    """The expansion for every row and penetration. Raises IllPosedError where training strips do not determine it."""
    scene, degree = job.scene, job.scene.expansion.degree
    batches = [batch for batch in store.read_all(job.paths("contact")) if "pressure" in batch]
    pressure, gap = store.join(batches, "pressure"), store.join(batches, "gap")
    target, stencil = expansion.target(scene, model, grid), expansion.stencil(model, lattice.grid)
    columns = geometry.training_columns(geometry.middle(scene))
    fields = map(surface_model.strip_fields(scene, model, grid), range(len(pressure)))
    functionals = np.concatenate([_functionals(field, columns, lattice.spacing, stencil) for field in fields])
    values = target.values(pressure, gap).transpose(0, 2, 3, 1).reshape(-1, grid.ny, pressure.shape[1])
    training, values = turned_to_half(functionals, values)
    strip = np.tile(np.repeat(np.arange(len(pressure)), len(columns)), 2)
    mirrored = MIRRORED[:, :1] if model.mirror_symmetric else NO_SYMMETRY  # along its length, which keeps every row
    levels = pressure.shape[1]
    half, missed, predicted = fit_strip(training, values, degree, stencil, target, strip, mirrored)
    means = conditional_means(predicted.reshape(levels, -1), values.transpose(2, 0, 1).reshape(levels, -1), target)
    expected = means.expected.copy()
    expected[..., 0] *= _covered(scene, batches, levels)[:, None]
    row = np.minimum(np.arange(grid.ny), np.arange(grid.ny)[::-1])  # of the half that each row goes by
    force = grid.cell_area * grid.ny * pressure.mean(axis=(0, 2, 3))
    return Fitted(on_all_rows(half, grid.ny), replace(means, expected=expected), force, missed[row])


def _covered(scene: Scene, batches: list[store.Result], levels: int) -> np.ndarray:
    """(levels,) contact area over that of the nodes in contact, whose share the tables hold at training nodes."""
    if not elastic.counts_shares(scene):
        return np.ones(levels)
    trained = sum(len(batch["pressure"]) for batch in batches)
    area, of_nodes = (store.join(batches, name)[:trained] for name in ("area", "area_of_nodes"))
    return np.asarray(area.sum(axis=(0, 2, 3)) / of_nodes.sum(axis=0))


def _functionals(field: np.ndarray, columns: np.ndarray, spacing: int, stencil: Stencil) -> np.ndarray:
    """Local functionals (columns, ny, 8) [m] of a field at columns, each on the lattice of columns that it lies on."""
    functionals = np.empty((len(columns), field.shape[1], len(NAMES)))
    for phase in np.unique(columns % spacing):
        lies = columns % spacing == phase
        on_lattice = local_functionals(field[phase::spacing], stencil)
        functionals[lies] = on_lattice[:, columns[lies] // spacing].transpose(1, 2, 0)
    return functionals


def sampler(
    scene: Scene, model: surface_model.SurfaceModel, grid: Grid, lattice: geometry.Lattice
) -> Callable[[int], np.ndarray]:
    """A function that gives the field (nx, ny) [m] of a strip on the lattice by its number.

    Of a solved strip these are columns of the whole field, of any other the lattice alone is drawn, of the same law.
    """
    whole, alone = (surface_model.strip_fields(scene, model, mesh) for mesh in (grid, lattice.grid))
    return lambda number: lattice.of(whole(number)) if number < scene.strip.samples else alone(number)
