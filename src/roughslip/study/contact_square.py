"""Stage contact_square: contact of a batch of samples of the square with the plane, at one penetration."""

import numpy as np

from roughslip import store
from roughslip.scene.types import Scene
from roughslip.study.from_scene import geometry
from roughslip.study.from_scene.square import (
    latin_hypercubes,
    pressures_at,
    solved,
    square,
    training_design,
    variables_of,
)
from roughslip.study.job import Job


def work(scene: Scene, job: Job) -> None:
    """Write the pressure around the centre of every sample, and of a design that trains the expansion the gap."""
    scene, numbers = scene, job.numbers
    problem = square(job)
    modes, count = len(problem.modes), len(numbers)
    lengths = problem.model.lengths_m
    if job.design == "expansion":
        xi = training_design(scene, modes)[numbers]
        variables = solved(problem, xi, count, geometry.training_nodes(lengths, problem.grid), job)
    elif job.design == "latin_hypercube":
        xi = np.concatenate(list(latin_hypercubes(scene, modes)))[numbers]
        nodes = geometry.central_nodes(lengths, problem.grid)
        first = geometry.Nodes(*(part[:1] for part in nodes))  # a design is balanced at one node only
        variables = pressures_at(problem, xi, count, first, job)
    else:
        drawn = (variables_of(scene.seed, number, modes) for number in numbers)
        variables = pressures_at(problem, drawn, count, geometry.central_nodes(lengths, problem.grid), job)
    store.write(job.output, variables, job.key, {"first": job.numbers.start, "design": job.design})
