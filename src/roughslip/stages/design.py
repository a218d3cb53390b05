"""Stage design: Latin hypercube designs, which are drawn whole. Monte Carlo samples are drawn where they are used."""

from __future__ import annotations

import numpy as np

from roughslip import store
from roughslip.chaos.designs import latin_hypercube
from roughslip.stages import geometry
from roughslip.stages.command import Job, execute


def work(job: Job) -> None:
    """Write the design of the paper's fits and the smaller one of ours."""
    seed, modes = job.configuration["seed"], job.configuration["square"]["modes"]
    sizes = {
        "latin_hypercube": (job.configuration["square"]["latin_hypercube_samples"], geometry.STREAM_LATIN_HYPERCUBE),
        "expansion": (job.configuration["expansion"]["samples"], geometry.STREAM_EXPANSION_DESIGN),
    }
    variables = {}
    with job.usage.core():
        for name, (samples, stream) in sizes.items():
            xi = latin_hypercube(np.random.default_rng([seed, stream]), samples, modes)
            title = f"standard normal variables of the {name} design"
            variables[name] = store.Variable((f"{name}_sample", "mode"), xi, "1", title)
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute("design", work)
