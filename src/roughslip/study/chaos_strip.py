"""Stage chaos_strip: the expansion of the pressure along the strip, from the training columns of the solved strips."""

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
from roughslip.errors import IllPosedError
from roughslip.scene.part import Scene
from roughslip.study.from_scene import elastic, expansion, geometry, surface_model
from roughslip.study.job import Job


def work(scene: Scene, job: Job) -> None:
    """Write whitening and coefficients of the expansion for every row and penetration, and what it says.

    Where the training strips cannot determine it, the reason is written in their place: friction takes the solves.
    """
    grid, model = geometry.strip_grid(scene), surface_model.surface_model(scene, job.optional("scan"))
    batches = [batch for batch in store.read_all(job.paths("contact")) if "pressure" in batch]
    pressure, gap = store.join(batches, "pressure"), store.join(batches, "gap")
    lattice, degree = geometry.lattice(scene), scene.expansion.degree
    target, stencil = expansion.target(scene, model, grid), expansion.stencil(model, lattice.grid)
    columns = geometry.training_columns(geometry.middle(scene))
    fields = map(surface_model.strip_fields(scene, model, grid), range(len(pressure)))
    functionals = np.concatenate([_functionals(field, columns, lattice.spacing, stencil) for field in fields])
    values = target.values(pressure, gap).transpose(0, 2, 3, 1).reshape(-1, grid.ny, pressure.shape[1])
    training, values = turned_to_half(functionals, values)
    strip = np.tile(np.repeat(np.arange(len(pressure)), len(columns)), 2)
    mirrored = MIRRORED[:, :1] if model.mirror_symmetric else NO_SYMMETRY  # along its length, which keeps every row
    levels = pressure.shape[1]
    try:
        half, missed, predicted = fit_strip(training, values, degree, stencil, target, strip, mirrored)
        means = conditional_means(predicted.reshape(levels, -1), values.transpose(2, 0, 1).reshape(levels, -1), target)
    except IllPosedError as error:
        job.warn(f"no expansion of the strips, and friction is that of the solved strips alone: {error.in_scene}")
        store.write(job.output, {"missed": store.Variable((), 1, "1", "1: no expansion")}, job.key)
        return
    fitted = on_all_rows(half, grid.ny)
    job.count(fits=missed.size)
    row = np.minimum(np.arange(grid.ny), np.arange(grid.ny)[::-1])  # of the half that each row goes by
    force = grid.cell_area * grid.ny * pressure.mean(axis=(0, 2, 3))
    title = "mean force on a column of the training strips"
    variables = _of_fit(fitted, means, _covered(scene, batches, levels))
    variables["column_force"] = store.Variable(("level",), force, "N", title)
    title = "share of the variance of the target that predictions of left-out strips miss"
    variables["leave_one_out"] = store.Variable(("y", "level"), missed[row], "1", title)
    store.write(job.output, variables, job.key)


def _covered(scene: Scene, batches: list[store.Result], levels: int) -> np.ndarray:
    """(levels,) contact area over that of the nodes in contact, whose share the tables hold at training nodes."""
    if not elastic.counts_shares(scene):
        return np.ones(levels)
    trained = sum(len(batch["pressure"]) for batch in batches)
    area, of_nodes = (store.join(batches, name)[:trained] for name in ("area", "area_of_nodes"))
    return np.asarray(area.sum(axis=(0, 2, 3)) / of_nodes.sum(axis=0))


def _of_fit(fitted: StripExpansion, means: ConditionalMeans, covered: np.ndarray) -> dict[str, store.Variable]:
    """The expansion on all rows, and what is expected at a predicted target."""
    unit, level, table = "Pa" if fitted.target.kind == "trial_pressure" else "Pa2", ("level",), ("level", "place")
    contact, pressure = covered[:, None] * means.expected[..., 0], means.expected[..., 1]
    whitened = "from local functionals to variables of unit variance"
    scatter = "root mean square of the target around what is expected of it"
    return {
        "coefficients": store.Variable(("y", "term", "level"), fitted.coefficients, unit, "coefficients of the target"),
        "indices": store.Variable(("term", "variable"), fitted.indices, "1", "exponents of the terms"),
        "whiten": store.Variable(("y", "variable", "functional"), fitted.whiten, "m-1", whitened),
        "table_low": store.Variable(level, means.low, unit, "first predicted target of the tables"),
        "table_step": store.Variable(level, means.step, unit, "distance of two predicted targets of the tables"),
        "scatter": store.Variable(level, means.scatter, unit, scatter),
        "contact": store.Variable(table, contact, "1", "contact probability given the predicted target"),
        "mean_pressure": store.Variable(table, pressure, "Pa", "mean pressure given the predicted target"),
    }


def _functionals(field: np.ndarray, columns: np.ndarray, spacing: int, stencil: Stencil) -> np.ndarray:
    """Local functionals (columns, ny, 8) [m] of a field at columns, each on the lattice of columns that it lies on."""
    functionals = np.empty((len(columns), field.shape[1], len(NAMES)))
    for phase in np.unique(columns % spacing):
        lies = columns % spacing == phase
        on_lattice = local_functionals(field[phase::spacing], stencil)
        functionals[lies] = on_lattice[:, columns[lies] // spacing].transpose(1, 2, 0)
    return functionals
