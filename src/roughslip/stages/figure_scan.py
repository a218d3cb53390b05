"""Stage figure_scan: draw a scan and surfaces sampled from its models, and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure_scan import DRAWN, figure_scan
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_scan",
    reads="description",
    many={"results": "synthetic_surfaces"},
    result="figure_scan.nc",
    target="figure_scan",
    comes_with="scan",
    caption="A scan, and surfaces sampled from the models fitted to it: map of the scan and of one sampled surface, "
    "density of heights, autocorrelation, radially averaged power spectrum. Bands around the scan are 95 % "
    "intervals, bands of the sampled surfaces reach from the least to the largest of them.",
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure_scan, drawn=DRAWN))
