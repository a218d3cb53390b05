"""Stage contact_square: contact of a batch of samples of the square with the plane, at one penetration."""

import numpy as np

from roughslip import store
from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.square import (
    latin_hypercubes,
    pressures_at,
    solved,
    square,
    training_design,
    variables_of,
)
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_square",
    reads="seed material roughness square.edge_m square.nodes "
    "square.latin_hypercube_samples expansion.samples numerics.contact_tolerance "
    "numerics.contact_area",
    inputs={"surface": "karhunen_loeve"},
    optional={"scan": "scan"},
    result="contact/square-{design}-{first}-{last}.nc",
    batches=Batches(
        totals={
            "monte_carlo": "square.monte_carlo_samples",
            "latin_hypercube": "square.latin_hypercube_samples",
            "expansion": "expansion.samples",
        },
    ),
)


def work(job: Job) -> None:
    """Write the pressure around the centre of every sample, and of a design that trains the expansion the gap."""
    arguments, scene, numbers = job.arguments, job.scene, range(job.arguments.first, job.arguments.last)
    problem = square(job)
    modes, count = len(problem.modes), len(numbers)
    lengths = problem.model.lengths_m
    with job.usage.core():
        if arguments.design == "expansion":
            xi = training_design(scene, modes)[numbers]
            variables = solved(problem, xi, count, geometry.training_nodes(lengths, problem.grid), job)
        elif arguments.design == "latin_hypercube":
            xi = np.concatenate(list(latin_hypercubes(scene, modes)))[numbers]
            nodes = geometry.central_nodes(lengths, problem.grid)
            first = geometry.Nodes(*(part[:1] for part in nodes))  # a design is balanced at one node only
            variables = pressures_at(problem, xi, count, first, job)
        else:
            drawn = (variables_of(scene.seed, number, modes) for number in numbers)
            variables = pressures_at(problem, drawn, count, geometry.central_nodes(lengths, problem.grid), job)
    store.write(arguments.output, variables, job.key, {"first": arguments.first, "design": arguments.design})
