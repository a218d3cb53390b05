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
    caption="The distribution of the friction coefficient: its autocorrelation next to that of white pressure in the "
    "same windows, exponential lengths, and the marginal at median penetration. Below: distances from families of "
    "distributions, skewness and excess kurtosis.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure3_law, drawn=DRAWN["figure3_law"]))
