"""Stage figure3_law: draw the law and the correlation of friction at all depths and write the numbers that it draws."""

from __future__ import annotations

from roughslip.figures.figure3 import DRAWN, law
from roughslip.stages.runtime.command import Job, execute
from roughslip.stages.runtime.drawing import draw_and_save


def work(job: Job) -> None:
    """Write figure3_law.png, figure3_law.svg and figure3_law.nc."""
    draw_and_save(job, law, DRAWN["figure3_law"])


if __name__ == "__main__":
    execute("figure3_law", work, files=("result",), outputs=("png", "svg"))
