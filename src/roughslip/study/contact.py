"""Stage contact: area and force of the blocks of a batch of strips or periodic cells, at every level.

Levels are penetrations of strips, or with a load its nominal pressure and those about it. Cells of another size than
those of the load stand in variables with the number of their size at the end.
"""

import numpy as np

from roughslip import store
from roughslip.scene.part import Scene
from roughslip.study.from_scene import geometry
from roughslip.study.from_scene.domain import Domain, domains, index_of
from roughslip.study.from_scene.surface_model import gaussian_model
from roughslip.study.job import Job


def work(scene: Scene, job: Job) -> None:
    """Solve every sample of the batch at every level."""
    variables: dict[str, store.Variable] = {}
    solving = domains(job)
    for size, domain in enumerate(solving):
        variables |= solved(job, domain, f"_{size}" if size else "")
    attributes: dict[str, str | int] = {"first": job.numbers.start, "model": "solved", "sizes": len(solving)}
    store.write(job.output, variables, job.key, attributes)


def solved(job: Job, domain: Domain, size: str) -> dict[str, store.Variable]:
    """What the solves of a domain leave. size : at the end of names"""
    scene, numbers = job.scene, domain.numbers(job.numbers.start, job.numbers.stop)
    count, levels = len(numbers), len(domain.levels)
    blocks = domain.blocks(np.zeros(domain.grid.shape)).shape
    area, force = np.zeros((2, count, levels, *blocks))
    residual, of_nodes, yielded = np.zeros((3, count, levels))
    columns = np.arange(0) if domain.periodic else geometry.training_columns(domain.middle())
    trained = 0 if domain.periodic else max(0, min(scene.strip.training_samples, numbers.stop) - numbers.start)
    pressure, gap = np.zeros((2, trained, levels, len(columns), domain.grid.ny))
    products = 0
    for row, number in enumerate(numbers):
        for level, solution in enumerate(domain.solutions(domain.heights(number))):
            area[row, level] = domain.blocks(domain.touched(solution))
            force[row, level] = domain.blocks(solution.pressure)
            of_nodes[row, level] = domain.blocks(solution.contact).sum()
            residual[row, level], yielded[row, level] = solution.residual, solution.yielded_share
            products += solution.work
            if row < trained:
                pressure[row, level], gap[row, level] = solution.pressure[columns], solution.signed_gap[columns]
        job.progress(row + 1, count)
    job.count(solves=levels * count, convolutions=products)
    of_sample, of_level = f"sample{size}", f"level{size}"
    of_blocks = (of_sample, of_level, f"along{size}", f"across{size}")
    unit, what = ("Pa", "nominal pressure") if domain.periodic else ("percent", "share of heights above the plane")
    variables = {
        f"number{size}": store.Variable((of_sample,), np.array(numbers), "1", "number of the strip or cell"),
        f"at{size}": store.Variable((of_level,), np.array(domain.levels), unit, what),
        f"area{size}": store.Variable(of_blocks, area, "m2", "contact area of a block"),
        f"force{size}": store.Variable(of_blocks, force, "N", "normal force on it"),
        f"residual{size}": store.Variable(
            (of_sample, of_level), residual, "1", "largest residual of the complementarity"
        ),
        f"area_of_nodes{size}": store.Variable(
            (of_sample, of_level), of_nodes, "m2", "area of the nodes in contact, all blocks"
        ),
    }
    if domain.periodic:
        title = "share of the real area that bears the hardness"
        variables[f"yielded{size}"] = store.Variable((of_sample, of_level), yielded, "1", title)
        index = index_of(scene, gaussian_model(scene, job.optional("scan")))
        variables["plasticity_index"] = store.Variable((), index, "1", "E* h' / H, zero in elastic contact")
    if trained:
        columns_of = ("training_sample", of_level, "column", "y")
        variables["pressure"] = store.Variable(columns_of, pressure, "Pa", "contact pressure on the training columns")
        variables["gap"] = store.Variable(columns_of, gap, "m", "gap there, below zero the plastic displacement")
    return variables
