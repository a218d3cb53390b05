"""What the figure stages share: read a result, draw it, save the picture and the numbers in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from roughslip import store
from roughslip.figures import save
from roughslip.stages.command import Job


def draw_and_save(job: Job, draw: Callable[[Mapping[str, np.ndarray]], Any], drawn: Sequence[str]) -> None:
    """Draw a result and save it as PNG and SVG, with the variables `drawn` beside it."""
    result = store.read(job.arguments.result)
    figure = draw(result)
    for path in (job.arguments.png, job.arguments.svg):
        with store.replacing(path) as temporary:
            save(figure, temporary)
    store.write(job.arguments.output, {name: result.variable(name) for name in drawn}, job.key)
