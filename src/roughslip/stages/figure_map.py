"""Stage figure_map: draw where stick-slip lives and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure_map import DRAWN, figure_map
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_map",
    reads="description",
    many={"results": "stick_slip_map lifetimes"},
    result="figure_map.nc",
    target="figure_map",
    caption="Where stick-slip occurs. (a) Its probability, the share of stick-slip in the second half of runs "
    "from rest on the belt, with the deterministic limits. (b) How long it survives at the damping "
    "ratios named, by the estimate of Kaplan and Meier. (c) Mean lifetime of stick-slip, and of steady "
    "sliding until the mass sticks; exponential, censored at the end of the runs. (d) The damping ratio "
    "at which stick-slip has the probability of one half, and the band from 0.1 to 0.9, by how the runs "
    "begin. Where the two bands differ, both motions last longer than the runs. Bands around lines are "
    "95 % intervals.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure_map, drawn=DRAWN))
