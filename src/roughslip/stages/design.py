"""Stage design: designs that are drawn whole. Monte Carlo samples of the reference are drawn where they are used."""

import numpy as np

from roughslip import store
from roughslip.chaos.sampling import latin_hypercube
from roughslip.errors import InputError
from roughslip.limits import MOST_NUMBERS, designs_of
from roughslip.scene.declarations import Stage
from roughslip.scene.types import Scene
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="design",
    reads="seed square.latin_hypercube_samples expansion.samples",
    inputs={"surface": "karhunen_loeve"},
    result="surface/design.nc",
)

STREAMS = {"latin_hypercube": Stream.LATIN_HYPERCUBE, "expansion": Stream.EXPANSION_DESIGN}


def samples_of(scene: Scene, modes: int) -> dict[str, int]:
    """Samples by the name of the design.

    Raises InputError with a line for each design too large for memory. The rules of scenes cannot check this, because
    stage karhunen_loeve finds the number of modes that a share of the variance takes.
    """
    counts = {"latin_hypercube": scene.square.latin_hypercube_samples, "expansion": scene.expansion.samples}
    lines = []
    keys = {"latin_hypercube": "square.latin_hypercube_samples", "expansion": "expansion.samples"}
    for name, samples in counts.items():
        if samples * modes > MOST_NUMBERS:
            lines.append(
                f"{keys[name]}: {samples} is not allowed; samples times the {modes} modes of the square at most "
                f"{MOST_NUMBERS} (0.8 GB of memory): fewer samples, or a lower square.variance_share"
            )
    if lines:
        raise InputError(lines)
    return counts


def work(job: Job) -> None:
    """Write the designs of the paper's fits, one after another, and the smaller one of ours: a variable a mode."""
    modes = len(store.read(job.arguments.surface)["eigenvalue"])
    variables = {}
    with job.usage.core():
        for name, samples in samples_of(job.scene, modes).items():
            seed = [job.scene.seed, STREAMS[name]]
            parts = designs_of(samples) if name == "latin_hypercube" else [slice(0, samples)]
            seeds = [[*seed, number] if number else seed for number in range(len(parts))]  # the first as of one alone
            drawn = [
                latin_hypercube(np.random.default_rng(own), part.stop - part.start, modes)
                for own, part in zip(seeds, parts, strict=True)
            ]
            title = f"standard normal variables of the {name} design"
            variables[name] = store.Variable((f"{name}_sample", "mode"), np.concatenate(drawn), "1", title)
    store.write(job.arguments.output, variables, job.key)
