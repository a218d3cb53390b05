"""Stage adaptive_training: as many solves as the error asked of the distribution at the centre of the square takes."""

import sys

import numpy as np

from roughslip import store
from roughslip.chaos.enrichment import enrich
from roughslip.chaos.local import LocalExpansion, Samples, fit_local
from roughslip.chaos.sampling import sobol
from roughslip.limits import MOST_NUMBERS
from roughslip.scene.accuracy import EXPANSION_SHARE
from roughslip.scene.declarations import Stage
from roughslip.scene.expansion import terms
from roughslip.stages.from_scene import expansion, geometry
from roughslip.stages.from_scene.square import solved, square
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="adaptive_training",
    reads="seed material roughness square.edge_m square.nodes square.penetration_percentile numerics.contact_tolerance "
    "expansion.variables expansion.degree expansion.target expansion.samples",
    reads_if_given="accuracy.pressure",
    inputs={"surface": "karhunen_loeve"},
    optional={"scan": "scan"},
    result="contact/training.nc",
    runs_if="expansion.samples = auto",
)

LEAST = 128  # solves to begin with: six in each of the groups that are left out
MOST = 2**14  # sixteen times what an error of 0.005 takes on the resolved square


def solve_limits(count: int, nodes: int, modes: int) -> tuple[int, int]:
    """Solves to begin with, more than so many terms, and solves never to exceed; powers of two."""
    room = MOST_NUMBERS // max(count * nodes, modes)
    return max(LEAST, 2 ** count.bit_length()), min(MOST, 2 ** (room.bit_length() - 1))


def work(job: Job) -> None:
    """Solve, fit and solve more; write what stage contact_square writes of a design, and the design."""
    asked, accuracy = job.scene.expansion, job.scene.accuracy.pressure
    seed = [job.scene.seed, geometry.STREAM_EXPANSION_DESIGN]
    problem = square(job)
    nodes = geometry.training_nodes(problem.model.lengths_m, problem.grid)
    batches: list[dict[str, store.Variable]] = []
    with job.usage.core():
        local = expansion.variables_of(job.scene, problem.model, problem.grid, problem.modes, nodes)
        target = expansion.target(job.scene, problem.model, problem.grid)

        def solve(first: int, last: int) -> Samples:
            xi = sobol(np.random.default_rng(seed), last, len(problem.modes))[first:]  # it can be extended
            solves = solved(problem, xi, last - first, nodes, job)
            title = "standard normal variables of the samples"
            batches.append({**solves, "xi": store.Variable(("sample", "mode"), xi, "1", title)})
            return local.samples(xi, solves["pressure"].values, solves["gap"].values)

        def fit(samples: Samples) -> tuple[LocalExpansion, Samples]:
            return fit_local(samples, asked.degree, target), samples

        least, most = solve_limits(terms(asked.variables, asked.degree), len(nodes.x), len(problem.modes))
        drawing = [job.scene.seed, geometry.STREAM_ENRICHMENT]
        enriched = enrich(solve, fit, accuracy, EXPANSION_SHARE, least=least, most=most, seed=drawing)
    for count, error in enriched.history:
        print(f"adaptive_training: {count} solves, estimated error of the distribution {error:.3g}", file=sys.stderr)
    reached = enriched.error
    job.usage.count(
        fits=len(enriched.history), cdf_error_asked=EXPANSION_SHARE * accuracy, cdf_error=round(reached.total, 6)
    )
    job.usage.skip({skip_reasons.ENOUGH_SOLVES: most - enriched.history[-1][0]})
    variables = {
        name: variable._replace(values=np.concatenate([batch[name].values for batch in batches]))
        for name, variable in batches[0].items()
    }
    titles = {"scatter": "from the scatter of its samples, with 95 %", "bias": "beyond what the scatter explains"}
    for name, title in titles.items():
        value = getattr(reached, name)
        variables[f"cdf_error_{name}"] = store.Variable((), value, "1", f"estimated error of the distribution {title}")
    store.write(job.arguments.output, variables, job.key, {"first": 0, "design": "expansion"})
