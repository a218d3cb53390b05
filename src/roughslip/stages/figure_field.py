"""Stage figure_field: draw the pressure at every node of the square and write the numbers that it draws."""

from functools import partial

from roughslip.figures.figure_field import DRAWN, figure_field
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_field",
    reads="description",
    many={"results": "field_square"},
    result="figure_field.nc",
    target="figure_field",
    caption="The pressure at every node of the square: contact probability, mean and standard deviation, with the "
    "median standard error in the titles, and what the expansion gains and explains. Below: a solved field, its "
    "expectation by an expansion fitted without it, and a field drawn with the residual scatter.",
    memory_mb=320,
)

if __name__ == "__main__":
    execute(STAGE, partial(draw_and_save, draw=figure_field, drawn=DRAWN))
