"""Stage friction: statistics of the friction coefficient over penetration, or under a load and over loads about it."""

import numpy as np

from roughslip import store
from roughslip.friction.pad import Blocks
from roughslip.friction.table import WindowLayout, friction_table
from roughslip.friction.table_variables import missing_warnings, summary, table_variables
from roughslip.friction.windows import Windows
from roughslip.scene.types import Scene
from roughslip.study.from_scene import geometry
from roughslip.study.from_scene.streams import Stream
from roughslip.study.job import Job
from roughslip.study.result_tables import load_table
from roughslip.study.result_tables.pad_autocorrelation import correlation_variables
from roughslip.study.result_tables.under_load import load_results

REPLICATES = 400
MODELS = ("solved", "expansion")


def work(scene: Scene, job: Job) -> None:
    """Write every statistic with its interval, and summary.csv."""
    files = store.read_all(job.paths("blocks"))
    solved, expanded = ([file for file in files if file.attributes["model"] == model] for model in MODELS)
    if scene.load is None:
        variables, text = over_penetration(job, solved, expanded)
    else:
        (own,) = blocks_of(scene, solved)
        variables, text = load_results(job, own, over_loads(scene, solved), solved)
    store.write(job.output, variables, job.key)
    store.write_text(job.outputs["summary"], text)


def blocks_of(scene: Scene, batches: list[store.Result], size: str = "") -> list[Blocks]:
    """The blocks of all samples at each level. size : at the end of names"""
    area, force = (store.join(batches, name + size) for name in ("area", "force"))
    sizes, periodic = geometry.block_sizes(scene), scene.load is not None
    return [Blocks(area[:, level], force[:, level], *sizes, periodic) for level in range(area.shape[1])]


def over_loads(scene: Scene, solved: list[store.Result]) -> dict[float, Blocks]:
    """The blocks of cells under the pressures about the load, by pressure [Pa]."""
    found: dict[float, Blocks] = {}
    for size in (f"_{number}" for number in range(1, int(solved[0].attributes["sizes"]))):
        found |= dict(zip(solved[0][f"at{size}"].tolist(), blocks_of(scene, solved, size), strict=True))
    return found


def window_sums_of(levels: list[Blocks]) -> Windows:
    """Area [m2] and force [N] (levels, strips, windows)."""
    area, force = (np.stack(parts) for parts in zip(*(blocks.windows for blocks in levels), strict=True))
    return area, force


def over_penetration(
    job: Job, solved: list[store.Result], expanded: list[store.Result]
) -> tuple[dict[str, store.Variable], str]:
    """Calibrate the shear strength at the median; statistics of every penetration, and the text of summary.csv."""
    scene, strip, seed = job.scene, job.scene.strip, job.scene.seed
    blocks = blocks_of(scene, solved)
    sums, others = window_sums_of(blocks), window_sums_of(blocks_of(scene, expanded))
    percentiles = np.array(strip.penetration_percentiles, dtype=float)
    layout = WindowLayout(percentiles, strip.window_m, strip.window_spacing_m, sums[0].shape[2])
    least, draws, mean = geometry.least_contact_area(scene), [seed, Stream.BOOTSTRAP], scene.friction.mean
    table = friction_table(sums, others, least, layout, mean, REPLICATES, draws, job.progress)
    loads = load_table.load_table(job, blocks, table)
    job.warn(*missing_warnings(table.solved["missing_share"], percentiles))
    job.count(windows=sums[0][0].size, expanded_windows=others[0][0].size)
    variables = table_variables(table) | load_table.load_variables(loads)
    variables |= correlation_variables(scene, job.optional("scan"))
    return variables, summary(variables)
