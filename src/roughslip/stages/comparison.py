"""Stage comparison: Figure 3 of several scenes in one picture, and the numbers that it draws."""

from roughslip import store
from roughslip.atomic_write import replacing
from roughslip.errors import InputError
from roughslip.figures.figure3 import COMPARED, MOST, comparison
from roughslip.figures.style import save
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="comparison",
    reads="description",
    many={"scenes": "figure3"},
    result="comparison.nc",
    caption="Friction coefficient of several scenes against penetration, mean and standard deviation, from "
    "solved contact, from the expansion, and from both.",
    memory_mb=320,
)


def work(job: Job) -> None:
    """Write the picture, and every number in it under its name and that of its scene."""
    folders = job.arguments.scenes
    if len(folders) > MOST:
        raise InputError([f"{len(folders)} scenes are too many for one picture: compare at most {MOST}"])
    results = {folder.name: store.read(folder / "figure3.nc") for folder in folders}
    figure = comparison(results)
    for path in (job.arguments.png, job.arguments.svg):
        with replacing(path) as temporary:
            save(figure, temporary)
    numbers = {}
    for scene, result in results.items():
        for name in COMPARED:
            one = result.variable(name)
            dimensions = tuple(f"{dimension}_{scene}" for dimension in one.dimensions)
            numbers[f"{scene}_{name}"] = store.Variable(dimensions, one.values, one.units, one.long_name)
    store.write(job.arguments.output, numbers, job.key)
    job.usage.count(scenes=len(folders))


if __name__ == "__main__":
    execute(STAGE, work)
