"""Stage figure3: draw Figure 3 and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure3 import DRAWN, figure3
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure3",
    reads="description",
    many={"results": "friction"},
    result="figure3.nc",
    target="figure3",
    caption="Figure 3. Friction coefficient of the test surface against penetration: as in the paper (a) mean and "
    "(b) standard deviation, and (c) their ratio. Combined: solved contact with the expansion as control variate, and "
    "the curve through it is the mean friction coefficient that the oscillator takes.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure3, drawn=DRAWN["figure3"]))
