"""Stage figures: draw all figures of a scene, and write the numbers in each.

The code of the stage is this module with those that draw the figures of the scene.
"""

from collections.abc import Iterable
from importlib import import_module

from roughslip import store
from roughslip.atomic_write import replacing
from roughslip.figures.style import Shown, save
from roughslip.scene.part import Scene
from roughslip.study.graph import STAGES
from roughslip.study.job import Job


def with_coordinates(variables: dict[str, store.Variable], drawn: Iterable[str]) -> dict[str, store.Variable]:
    """The variables that a figure takes, and the coordinates of their dimensions."""
    kept = {name: variables[name] for name in drawn}
    dimensions = {dimension for variable in kept.values() for dimension in variable.dimensions}
    found = {name: variables[name] for name in dimensions if name in variables}
    return kept | {name: found[name] for name in sorted(found) if found[name].dimensions == (name,)}


def work(scene: Scene, job: Job) -> None:
    """Draw each figure by the function of its name, as PNG and SVG."""
    for name in job.key.configuration["figures"]:
        row = STAGES[name]
        drawing = import_module(f"roughslip.figures.{row.draws}")
        if row.module:
            variables = import_module(f"roughslip.study.{row.module}").numbers(scene, job)
        else:
            results = (store.read(path) for maker in row.makers for path in job.paths(maker))
            variables = {name: result.variable(name) for result in results for name in result}
        shown = Shown(store.dataset(variables, {}))
        picture = getattr(drawing, name)(shown)
        for kind in ("png", "svg"):
            with replacing(job.outputs[f"{name}.{kind}"]) as temporary:
                save(picture, temporary)
        store.write(job.outputs[f"{name}.nc"], with_coordinates(variables, shown.taken), job.key)
    job.count(figures=len(job.key.configuration["figures"]))
