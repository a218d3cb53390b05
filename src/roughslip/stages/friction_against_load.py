"""Stage friction_against_load: real area, friction and windows without contact against the nominal pressure, drawn."""

import numpy as np

from roughslip import store
from roughslip.figures.friction_against_load import DRAWN, friction_against_load
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.drawing import save_with_numbers

STAGE = Stage(
    name="friction_against_load",
    reads="description",
    inputs={"curve": "contact_over_loads", "own": "friction_under_load"},
    result="friction_against_load.nc",
    outputs={"table": "friction_against_load.csv"},
    target="friction_against_load",
    caption="Friction against load: real area of contact, mean and coefficient of variation of the friction "
    "coefficient of the pad, and windows without contact, over two decades of nominal pressure. The shear strength is "
    "that which gives the pad its mean under the load of the scene, marked. Bands are 95 % intervals.",
    memory_mb=320,
)

HEAD = (
    "Friction of a pad against its load, a row a nominal pressure: contact of periodic cells of the surface",
    'Columns with _low and _high are the ends of the 95 % interval. Python: pandas.read_csv(file, comment="#")',
)
ENDS = ("", "_low", "_high")


def work(job: Job) -> None:
    """Write figure, numbers and table."""
    curve, own = store.read(job.arguments.curve), store.read(job.arguments.own)
    mean = float(own["load_mean"])
    variables = {name: curve.variable(name) for name in curve}
    for end in ENDS:
        title = "mean friction coefficient of the pad"
        variables[f"mean{end}"] = store.Variable(("load",), mean * curve[f"relative_mean{end}"], "1", title)
        variables.pop(f"relative_mean{end}")
    own_load = {"own_pressure": "nominal_pressure", "own_mean": "load_mean", "own_real_area": "real_area"}
    variables |= {name: own.variable(other) for name, other in own_load.items()}
    drawn = {name: np.asarray(variables[name].values) for name in DRAWN[STAGE.name]}
    save_with_numbers(job, friction_against_load(drawn), variables)
    columns = [
        "nominal_pressure",
        *(name + end for name in ("real_area", "mean", "variation", "no_contact") for end in ENDS),
    ]
    rows = zip(*(np.asarray(variables[name].values) for name in columns), strict=True)
    lines = [*(f"# {line}" for line in HEAD), ",".join(["nominal_pressure_pa", *columns[1:]])]
    lines += [",".join(f"{value:.6g}" for value in row) for row in rows]
    store.write_text(job.arguments.table, "\n".join(lines) + "\n")
