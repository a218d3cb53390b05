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
    caption="How long stick-slip lasts near its limit. (a) How long it survives at the damping "
    "ratios named, by the estimate of Kaplan and Meier. (b) Mean lifetime of stick-slip, and of steady "
    "sliding until the mass sticks; exponential, censored at the end of the runs. (c) The damping ratio "
    "at which stick-slip has the probability of one half, and the band from 0.1 to 0.9, by how the runs "
    "begin. Where the two bands differ, both motions last longer than the runs. Bands around lines are "
    "95 % intervals.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure_lifetimes, drawn=DRAWN))
