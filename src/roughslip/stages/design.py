"""Stage design: designs that are drawn whole. Monte Carlo samples of the reference are drawn where they are used."""

from __future__ import annotations

from roughslip import store
from roughslip.chaos.designs import design
from roughslip.errors import InputError
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="design",
    reads="seed square.latin_hypercube_samples expansion.samples",
    reads_if_given="expansion.design",
    inputs={"surface": "surface"},
    result="surface/design.nc",
    memory_doubles={"square_modes": 2.5, "design_numbers": 3},
)

# By the name of a design: the scene's key of its samples, and its random stream.
DESIGNS = {
    "latin_hypercube": ("square.latin_hypercube_samples", geometry.STREAM_LATIN_HYPERCUBE),
    "expansion": ("expansion.samples", geometry.STREAM_EXPANSION_DESIGN),
}
MOST_NUMBERS = 100_000_000  # in one design: 0.8 GB


def samples_of(configuration: geometry.Configuration, modes: int) -> dict[str, int]:
    """Samples by the name of the design.

    Raises InputError with a line for each design too large for memory: how many modes a share of the variance takes is
    not known before stage surface, so the rules of scenes cannot tell.
    """
    found, lines = {}, []
    for name, (key, _) in DESIGNS.items():
        section, _, last = key.partition(".")
        if configuration[section][last] == "auto":  # drawn by stage training_square, as far as it needs them
            continue
        found[name] = configuration[section][last]
        if found[name] * modes > MOST_NUMBERS:
            lines.append(
                f"{key}: {found[name]} is not allowed; samples times the {modes} modes of the square at most "
                f"{MOST_NUMBERS} (0.8 GB of memory): fewer samples, or a lower square.variance_share"
            )
    if lines:
        raise InputError(lines)
    return found


def work(job: Job) -> None:
    """Write the design of the paper's fits and the smaller one of ours: a variable a mode of the square."""
    modes = len(store.read(job.arguments.surface)["eigenvalue"])
    expansion = job.configuration["expansion"]
    variables = {}
    with job.usage.core():
        for name, samples in samples_of(job.configuration, modes).items():
            kind = "latin_hypercube" if name == "latin_hypercube" else expansion.get("design", "latin_hypercube")
            xi = design(kind, [job.configuration["seed"], DESIGNS[name][1]], samples, modes)
            title = f"standard normal variables of the {name} design"
            variables[name] = store.Variable((f"{name}_sample", "mode"), xi, "1", title)
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute(STAGE, work)
