"""Stage figure3: draw Figure 3 and write the numbers that it draws."""

from __future__ import annotations

from roughslip.figures.figure3 import DRAWN, figure3
from roughslip.stages.runtime.command import Job, execute
from roughslip.stages.runtime.drawing import draw_and_save


def work(job: Job) -> None:
    """Write figure3.png, figure3.svg and figure3.nc."""
    draw_and_save(job, figure3, DRAWN["figure3"])


if __name__ == "__main__":
    execute("figure3", work, files=("result",), outputs=("png", "svg"))
