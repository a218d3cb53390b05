"""Stage figure2_traps: draw the expansions of Figure 2 over all surfaces, and write the numbers drawn."""

from functools import partial

from roughslip.figures.figure2 import DRAWN, figure2_traps
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure2_traps",
    reads="description",
    many={"results": "chaos_square"},
    result="figure2_traps.nc",
    target="figure2",
    caption="A trap of Figure 2. (a) and (b): the fits of both variants at variables drawn over all surfaces, of "
    "which pressures above zero count, and our own expansion of all samples. (c): the variables of surfaces in "
    "contact, to which the fits belong, next to those drawn.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure2_traps, drawn=DRAWN["figure2_traps"]))
