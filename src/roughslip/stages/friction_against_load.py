"""Stage friction_against_load: real area, friction and windows without contact against the nominal pressure, drawn."""

import numpy as np

from roughslip import store
from roughslip.figures.friction_against_load import DRAWN, friction_against_load
from roughslip.friction.statistics import estimate_of, strip_weights
from roughslip.friction.under_load import CellBlocks, Estimates, pad_estimates
from roughslip.probability.estimate import columns_of
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.result_tables.pad_autocorrelation import correlated
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.drawing import save_with_numbers

STAGE = Stage(
    name="friction_against_load",
    reads="description seed material roughness strip.cell_m strip.width_m strip.window_m strip.window_spacing_m "
    "friction.mean_at_median load oscillator.windows_in_parallel",
    inputs={"contact": "contact_over_loads", "own": "contact_periodic"},
    optional={"scan": "scan"},
    result="friction_against_load.nc",
    outputs={"table": "friction_against_load.csv"},
    target="friction_against_load",
    caption="Friction against load: real area of contact, mean and coefficient of variation of the friction "
    "coefficient of the pad, and windows without contact, over two decades of nominal pressure. The shear strength is "
    "that which gives the pad its mean under the load of the scene, marked. Bands are 95 % intervals.",
)

REPLICATES = 200
TITLES = {
    "real_area": "contact area over the apparent area",
    "mean": "mean friction coefficient of the pad",
    "variation": "coefficient of variation of the friction coefficient of the pad",
    "no_contact": "share of the windows without contact",
}
HEAD = (
    "Friction of a pad against its load, a row a nominal pressure: contact of periodic cells of the surface",
    'Columns with _low and _high are the ends of the 95 % interval. Python: pandas.read_csv(file, comment="#")',
)


def work(job: Job) -> None:
    """Write figure, numbers and table."""
    scene, nominal = job.scene, job.scene.load.nominal_pressure_pa
    wanted = scene.load.mean_friction or scene.friction.mean_at_median
    with job.usage.core():
        pads = of_pads(job, nominal)
        own = pads[nominal][1]["ratio"].rows
        table = [at_pressure(pressure, *found, wanted / own) for pressure, found in pads.items()]
    variables = {
        "nominal_pressure": store.Variable(("load",), np.array(list(pads)), "Pa", "force over apparent area"),
        "own_pressure": store.Variable((), nominal, "Pa", "that of the load of the scene"),
    }
    for name, title in TITLES.items():
        variables |= store.with_interval(name, ("load",), columns_of([row[name] for row in table]), "1", title)
    drawn = {name: np.asarray(variables[name].values) for name in DRAWN[STAGE.name]}
    save_with_numbers(job, friction_against_load(drawn), variables)
    columns = [name for name in variables if name != "own_pressure"]
    rows = zip(*(drawn[name] for name in columns), strict=True)
    lines = [*(f"# {line}" for line in HEAD), ",".join(["nominal_pressure_pa", *columns[1:]])]
    lines += [",".join(f"{value:.6g}" for value in row) for row in rows]
    store.write_text(job.arguments.table, "\n".join(lines) + "\n")


def of_pads(job: Job, nominal_pa: float) -> dict[float, tuple[int, Estimates]]:
    """Number of cells and what they show of pads, by nominal pressure, from the lightest on."""
    scene, surface = job.scene, correlated(job.scene, job.arguments.scan)
    own, others = store.read(job.arguments.own), store.read(job.arguments.contact)
    sums = {nominal_pa: (own["block_area"], own["block_force"])}
    for size in range(sum(name.startswith("pressure_") for name in others)):
        columns = (others[f"{name}_{size}"] for name in ("pressure", "block_area", "block_force"))
        sums |= {float(pressure): (area, force) for pressure, area, force in zip(*columns, strict=True)}
    found: dict[float, tuple[int, Estimates]] = {}
    pad = scene.oscillator.windows_in_parallel, scene.load.pad_length_m
    for pressure in sorted(sums):
        blocks = CellBlocks(*sums[pressure], *geometry.block_sizes(scene))
        draws = np.random.default_rng([scene.seed, Stream.CELL, blocks.cells])
        weights = strip_weights(blocks.cells, REPLICATES, draws)
        found[pressure] = blocks.cells, pad_estimates(blocks, surface, weights, *pad)
    return found


def at_pressure(pressure_pa: float, cells: int, pads: Estimates, shear_pa: np.ndarray) -> Estimates:
    """A row of the table. shear_pa : (1 + R,) shear strength that gives the pad its mean under the load of the scene"""
    ratio = pads["ratio"].rows
    rows = {
        "real_area": ("mean", pressure_pa * ratio),
        "mean": ("mean", shear_pa * ratio),
        "variation": ("std", pads["load_std"].rows / ratio),
    }
    return pads | {name: estimate_of(kind, values, cells) for name, (kind, values) in rows.items()}
