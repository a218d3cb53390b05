"""Stage surface: the Karhunen-Loeve modes of the square."""

from __future__ import annotations

import sys

from roughslip import store
from roughslip.stages import geometry, surfaces
from roughslip.stages.command import Job, execute
from roughslip.surface.karhunen_loeve import karhunen_loeve

WELL_CAPTURED = 0.9  # share of the variance below which the log warns


def work(job: Job) -> None:
    """Write the scaled modes, their eigenvalues and the variance that they carry."""
    model = surfaces.gaussian_model(job.configuration, job.arguments.scan)
    grid = geometry.square_grid(job.configuration)
    with job.usage.core():
        expansion = karhunen_loeve(model.covariance, grid, job.configuration["square"]["modes"])
    if expansion.captured_variance < WELL_CAPTURED:
        print(
            f"surface: {len(expansion.modes)} modes carry {expansion.captured_variance:.0%} of the variance of the "
            "square: take more of them, or a longer correlation length",
            file=sys.stderr,
        )
    job.usage.count(modes=len(expansion.modes))
    variables = {
        "modes": store.Variable(("mode", "x", "y"), expansion.modes, "m", "modes times the root of their eigenvalues"),
        "eigenvalue": store.Variable(("mode",), expansion.eigenvalues, "m2", "eigenvalues of the covariance matrix"),
        "variance": store.Variable(("x", "y"), expansion.variance(), "m2", "variance of the truncated expansion"),
        "captured_variance": store.Variable((), expansion.captured_variance, "1", "share of the variance captured"),
    }
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute("surface", work, optional=("scan",))
