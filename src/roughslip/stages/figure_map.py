"""Stage figure_map: draw where stick-slip lives and write the numbers that it draws."""

from __future__ import annotations

from roughslip.figures.figure_map import DRAWN, figure_map
from roughslip.stages.runtime.command import Job, execute
from roughslip.stages.runtime.drawing import draw_and_save


def work(job: Job) -> None:
    """Write figure_map.png, figure_map.svg and figure_map.nc."""
    draw_and_save(job, figure_map, DRAWN, ("map", "survival"))


if __name__ == "__main__":
    execute("figure_map", work, files=("map", "survival"), outputs=("png", "svg"))
