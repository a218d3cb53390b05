"""Stage figure5: draw Figure 5 and write the numbers that it draws."""

from __future__ import annotations

from roughslip.figures.figure5 import DRAWN, figure5
from roughslip.stages.runtime.command import Job, execute
from roughslip.stages.runtime.drawing import draw_and_save


def work(job: Job) -> None:
    """Write figure5.png, figure5.svg and figure5.nc."""
    draw_and_save(job, figure5, DRAWN)


if __name__ == "__main__":
    execute("figure5", work, files=("result",), outputs=("png", "svg"))
