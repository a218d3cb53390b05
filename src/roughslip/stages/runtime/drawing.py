"""What the figure stages share: read a result, draw it, save the picture and the numbers in it."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from roughslip import store
from roughslip.atomic_write import replacing
from roughslip.figures.style import save
from roughslip.stages.runtime.command import Job


def draw_and_save(
    job: Job,
    draw: Callable[[Mapping[str, np.ndarray]], Any],
    drawn: Sequence[str],
) -> None:
    """Draw the results of a figure stage as PNG and SVG, and write the variables `drawn` with their coordinates.

    No name is in two results, but for coordinates. Names that no result holds are left out.
    """
    results = [store.read(path) for path in job.arguments.results]
    owner = {name: result for result in results for name in result}
    figure = draw({name: result[name] for name, result in owner.items()})
    kept = {name: owner[name].variable(name) for name in drawn if name in owner}
    for name in {dimension for variable in kept.values() for dimension in variable.dimensions}.intersection(owner):
        if owner[name].variable(name).dimensions == (name,):
            kept.setdefault(name, owner[name].variable(name))
    save_with_numbers(job, figure, kept)


def save_with_numbers(job: Job, figure: Any, numbers: Mapping[str, store.Variable]) -> None:
    """Write a figure as PNG and SVG, and the numbers in it."""
    for path in (job.arguments.png, job.arguments.svg):
        with replacing(path) as temporary:
            save(figure, temporary)
    store.write(job.arguments.output, numbers, job.key)
