"""Stage figure2: draw Figure 2 and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure2 import DRAWN, figure2
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure2",
    reads="description",
    many={"results": "chaos_square"},
    result="figure2.nc",
    target="figure2",
    caption="Figure 2. Pressure at the centre of the square, given contact: (a) as in the paper, (b) at low "
    "probabilities, and (c) the probability of contact. Both expansions (PC) are fitted to one Latin hypercube design "
    "(LHS) and evaluated at solved surfaces in contact that no fit has seen, with bands over all designs.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure2, drawn=DRAWN["figure2"]))
