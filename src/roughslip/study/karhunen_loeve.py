"""Stage karhunen_loeve: the Karhunen-Loeve modes of the square."""

from roughslip import store
from roughslip.scene.part import Scene
from roughslip.study.from_scene import geometry, surface_model
from roughslip.study.job import Job
from roughslip.surface.modes import karhunen_loeve

WELL_CAPTURED = 0.9  # share of the variance below which a warning says so


def work(scene: Scene, job: Job) -> None:
    """Write the scaled modes, their eigenvalues and the variance that they carry."""
    model = surface_model.gaussian_model(scene, job.optional("scan"))
    grid = geometry.square_grid(scene)
    expansion = karhunen_loeve(model.covariance, grid, scene.square.modes)
    if expansion.captured_variance < WELL_CAPTURED:
        job.warn(
            f"{len(expansion.modes)} modes carry {expansion.captured_variance:.0%} of the variance of the square: take "
            "more of them, or a longer correlation length"
        )
    job.count(modes=len(expansion.modes))
    variables = store.variables_of(expansion) | {
        "x": store.Variable(("x",), grid.x(), "m", "node along the belt"),
        "y": store.Variable(("y",), grid.y(), "m", "node across the belt"),
    }
    for name, node in (("centre", grid.centre), ("corner", (0, 0))):
        title = f"share of the variance that the modes carry, at the {name}"
        variables[f"captured_at_{name}"] = store.Variable((), expansion.captured_at(node), "1", title)
    store.write(job.output, variables, job.key)
