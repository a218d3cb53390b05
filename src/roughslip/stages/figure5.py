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
    result="figure5.nc",
    target="figure5",
    caption="Figure 5. Stick-slip limit cycle with and without scatter, the point where the mass sticks again, "
    "and the cycles lost to the scatter against damping.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure5, drawn=DRAWN))
