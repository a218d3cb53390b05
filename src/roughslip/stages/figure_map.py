"""Stage figure_map: draw where stick-slip occurs and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure_map import DRAWN, figure_map
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_map",
    reads="description",
    many={"results": "stick_slip_map"},
    result="figure_map.nc",
    target="figure_map",
    caption="Where stick-slip occurs: its probability over two parameters, with dots at the points that were run. "
    "Lines without scatter, where one axis is damping: the cycle exists left of the solid one, steady sliding is "
    "unstable left of the dashed one.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure_map, drawn=DRAWN))
