"""Stage figure_field: draw the pressure at every node of the square and write the numbers that it draws."""

from __future__ import annotations

from roughslip.figures.figure_field import DRAWN, figure_field
from roughslip.stages.runtime.command import Job, execute
from roughslip.stages.runtime.drawing import draw_and_save


def work(job: Job) -> None:
    """Write figure_field.png, figure_field.svg and figure_field.nc."""
    draw_and_save(job, figure_field, DRAWN)


if __name__ == "__main__":
    execute("figure_field", work, files=("result",), outputs=("png", "svg"))
