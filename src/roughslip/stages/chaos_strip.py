"""Stage chaos_strip: the expansion of the pressure along the strip, from the training columns of the solved strips."""

from __future__ import annotations

import numpy as np

from roughslip import store
from roughslip.chaos.functionals import local_functionals
from roughslip.chaos.strip import fit_strip
from roughslip.stages import expansion, geometry, surfaces
from roughslip.stages.command import Job, execute
from roughslip.stages.training import training_columns


def work(job: Job) -> None:
    """Write whitening, coefficients and quality of the expansion for every row and penetration."""
    configuration = job.configuration
    grid, model = geometry.strip_grid(configuration), surfaces.surface_model(configuration, job.arguments.scan)
    batches = [batch for batch in store.read_all(job.arguments.contact) if "pressure" in batch]
    pressure, gap = store.join(batches, "pressure"), store.join(batches, "gap")
    target, stencil = expansion.strip_target(configuration, model, grid), expansion.stencil(model, grid)
    sample = model.sampler(grid)
    columns = training_columns(geometry.middle(configuration))
    with job.usage.core():
        functionals = []
        for number in range(len(pressure)):
            field = sample(np.random.default_rng([configuration["seed"], geometry.STREAM_STRIP, number]))
            functionals.append(local_functionals(field, stencil)[:, columns].transpose(1, 2, 0))
        values = target.values(pressure, gap).transpose(0, 2, 3, 1).reshape(-1, grid.ny, pressure.shape[1])
        degree = configuration["expansion"]["degree"]
        fitted, quality = fit_strip(np.concatenate(functionals), values, degree, stencil, target)
    job.usage.count(fits=quality["leave_one_out"].size)
    shape = ("y", "level")
    titles = {
        "leave_one_out": "share of the variance of the target that leave-one-out residuals keep",
        "condition_number": "condition number of the weighted basis",
        "effective_samples": "effective number of weighted samples, neighbours counted as independent",
    }
    variables = {name: store.Variable(shape, quality[name], "1", title) for name, title in titles.items()}
    unit = "Pa" if target.kind == "trial_pressure" else "Pa2"
    variables["coefficients"] = store.Variable(
        ("y", "term", "level"), fitted.coefficients, unit, "coefficients of the target"
    )
    variables["indices"] = store.Variable(("term", "variable"), fitted.indices, "1", "exponents of the terms")
    variables["whiten"] = store.Variable(
        ("y", "variable", "functional"), fitted.whiten, "m-1", "from local functionals to variables of unit variance"
    )
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute("chaos_strip", work, batches=("contact",), optional=("scan",))
