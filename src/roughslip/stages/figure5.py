"""Stage figure5: draw Figure 5 and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure5 import DRAWN, figure5
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure5",
    reads="description",
    many={"results": "cycles"},
    collects={"readings": "belt_readings"},
    result="figure5.nc",
    target="figure5",
    caption="Figure 5. As in the paper (a) the limit cycle, (b) the point where the mass sticks again, and (c) the "
    "cycles lost to the scatter against damping, also where the friction lies nearest to the paper's Beta if the scene "
    "has readings; (d) the cycles themselves. The paper's dimensionless numbers are ours "
    "in metres.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure5, drawn=DRAWN))
