"""Stage figure2: draw Figure 2 and write the numbers that it draws."""

from __future__ import annotations

from roughslip.figures.figure2 import DRAWN, figure2
from roughslip.stages.runtime.command import Job, execute
from roughslip.stages.runtime.drawing import draw_and_save


def work(job: Job) -> None:
    """Write figure2.png, figure2.svg and figure2.nc."""
    draw_and_save(job, figure2, DRAWN)


if __name__ == "__main__":
    execute("figure2", work, files=("result",), outputs=("png", "svg"))
