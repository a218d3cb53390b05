"""Stage figure_scan: draw a scan beside its sampled twins and write the numbers that it draws."""

from __future__ import annotations

from roughslip.figures.figure_scan import DRAWN, figure_scan
from roughslip.stages.runtime.command import Job, execute
from roughslip.stages.runtime.drawing import draw_and_save


def work(job: Job) -> None:
    """Write figure_scan.png, figure_scan.svg and figure_scan.nc."""
    draw_and_save(job, figure_scan, DRAWN)


if __name__ == "__main__":
    execute("figure_scan", work, files=("result",), outputs=("png", "svg"))
