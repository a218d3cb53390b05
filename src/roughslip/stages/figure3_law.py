"""Stage figure3_law: draw distribution and correlation of friction at all penetrations; write the numbers drawn."""

from functools import partial

from roughslip.figures.figure3 import DRAWN, figure3_law
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure3_law",
    reads="description",
    many={"results": "friction"},
    result="figure3_law.nc",
    target="figure3",
    caption="The distribution of the friction coefficient. Autocorrelation, with that of windows of white "
    "pressure measured the same way, which is the window's own part. Exponential lengths. The "
    "standardised distribution at median penetration. Distances of the windows from families of "
    "distributions; skewness and excess kurtosis.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure3_law, drawn=DRAWN["figure3_law"]))
