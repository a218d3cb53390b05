"""Stage contact_square: contact of a batch of samples of the square with the plane, at one penetration."""

from roughslip import store
from roughslip.chaos.sampling import monte_carlo
from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.square import pressures_at, solved, square
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="contact_square",
    reads="seed material roughness square.edge_m square.nodes square.penetration_percentile numerics.contact_tolerance "
    "numerics.contact_area",
    inputs={"surface": "karhunen_loeve", "designs": "design"},
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
    arguments, numbers = job.arguments, range(job.arguments.first, job.arguments.last)
    problem = square(job)
    if arguments.design == "monte_carlo":
        seed = [job.scene.seed, Stream.MONTE_CARLO]
        xi = (monte_carlo([*seed, number], len(problem.modes)) for number in numbers)
    else:
        design = store.read(arguments.designs)[arguments.design]
        xi = (design[number] for number in numbers)
    lengths, count = problem.model.lengths_m, len(numbers)
    with job.usage.core():
        if arguments.design == "expansion":
            variables = solved(problem, xi, count, geometry.training_nodes(lengths, problem.grid), job)
        else:
            nodes = geometry.central_nodes(lengths, problem.grid)
            if arguments.design == "latin_hypercube":  # a design is balanced at one node only
                nodes = geometry.Nodes(*(part[:1] for part in nodes))
            variables = pressures_at(problem, xi, count, nodes, job)
    store.write(arguments.output, variables, job.key, {"first": arguments.first, "design": arguments.design})
