"""Stage figure_lifetimes: draw how long stick-slip lives near its limits and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure_lifetimes import DRAWN, figure_lifetimes
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_lifetimes",
    reads="description",
    many={"results": "lifetimes"},
    result="figure_lifetimes.nc",
    target="figure_lifetimes",
    caption="How long stick-slip lasts near its limit: its survival, mean lifetimes of stick-slip and of steady "
    "sliding, and the damping ratio at which stick-slip is as likely as not, by how the runs begin. Bands around "
    "lines are 95 % intervals.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure_lifetimes, drawn=DRAWN))
