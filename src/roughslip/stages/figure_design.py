"""Stage figure_design: draw the cheapest change that keeps stick-slip rare and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure_design import DRAWN, figure_design
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_design",
    reads="description",
    many={"results": "cheapest_change"},
    result="figure_design.nc",
    target="figure_design",
    caption="The cheapest change of the parameters that keeps the probability of stick-slip below the limit. Beyond "
    "the line changes are acceptable; at the cheapest point the upper end of the 95 % interval is at the limit.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure_design, drawn=DRAWN))
