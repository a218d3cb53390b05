"""Stage comparison: the figures of several scenes in one picture, and the numbers that it draws."""

from roughslip import store
from roughslip.errors import InputError
from roughslip.figures.comparison import MOST, comparison, drawn
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.drawing import save_with_numbers

STAGE = Stage(
    name="comparison",
    reads="description",
    many={"results": "figure2 figure3 figure3_law figure5 figure_map figure_scan"},
    result="comparison.nc",
    caption="Scenes in comparison, with 95 % intervals: pressure at the centre over its mean; friction against "
    "penetration; limit cycle without scatter, reattachment point, cycles lost to the scatter; where stick-slip is as "
    "likely as not; scans.",
)


def work(job: Job) -> None:
    """Write the picture, and every number in it under its name and those of its figure and scene."""
    scenes = job.key.configuration["scenes"]  # of each file
    if len(set(scenes)) > MOST:
        raise InputError([f"{len(set(scenes))} scenes are too many for one picture: compare at most {MOST}"])
    results: dict[str, dict[str, store.Result]] = {}
    numbers = {}
    for scene, file in zip(scenes, job.arguments.results, strict=True):
        figure = file.stem
        result = results.setdefault(figure, {})[scene] = store.read(file)
        for name in drawn(figure):
            variable = result.variable(name)
            dimensions = tuple(f"{dimension}_{figure}_{scene}" for dimension in variable.dimensions)
            numbers[f"{scene}_{figure}_{name}"] = variable._replace(dimensions=dimensions)
    save_with_numbers(job, comparison(results), numbers)
    job.usage.count(scenes=len(set(scenes)))
