"""Stage cycles: the ensemble summed up, cycle counts against damping and the distribution of the reattachment point."""

import numpy as np

from roughslip import store
from roughslip.scene.types import Scene
from roughslip.study.from_scene.streams import Stream
from roughslip.study.job import Job
from roughslip.study.result_tables import ensemble_table

HISTOGRAM_BINS = 48


def _unsaid(*texts: str) -> None:
    """Says nothing."""


def work(scene: Scene, job: Job) -> None:
    """Write M_d - E[M_S], micro-slips, moments and histogram of the reattachment point, and what is drawn."""
    plain, duration = store.read(job.path("deterministic")), scene.ensemble.duration_periods
    batches = store.read_all(job.paths("ensemble"))
    generator = np.random.default_rng([scene.seed, Stream.BOOTSTRAP])
    runs = ensemble_table.Runs(*(store.join(batches, name) for name in ensemble_table.STORED))
    nominal = scene.oscillator.damping_ratio
    warn = job.warn if runs.place.size else _unsaid  # without a cycle there is nothing to have statistics of
    variables = ensemble_table.ensemble_variables(plain, runs, (duration, nominal), generator, warn)
    events, edges = np.histogram(runs.place, HISTOGRAM_BINS)
    cut = store.join(batches, "negative_friction") > 0
    if cut.any():
        job.warn(
            f"friction would be negative in {np.count_nonzero(cut)} of {cut.size} runs and is cut to zero there: its "
            "mean is then higher and its scatter smaller than asked"
        )
    density = events / max(events.sum(), 1) / np.diff(edges)
    variables["histogram"] = store.Variable(("bin",), density, "m-1", "density of the reattachment point")
    variables["histogram_edge"] = store.Variable(("edge",), edges, "m", "edges of its bins")
    variables["time"] = plain.variable("time")
    for name in ("position", "velocity"):
        drawn = store.join([batch for batch in batches if name in batch], name)
        variables[name] = store.Variable(("drawn", "time"), drawn, "m", f"{name} of the runs that are drawn")
    for name in ("position", "velocity", "reattachment", "departure"):
        variable = plain.variable(name)
        variables[f"deterministic_{name}"] = variable._replace(long_name=f"{name} without scatter")
    responses = [f"load_response_{kind}" for kind in ("additive", "multiplicative")]
    of_friction = ("friction_scatter", "friction_percentile", *responses)
    variables |= {name: plain.variable(name) for name in of_friction if name in plain}
    job.count(events=len(runs.place))
    store.write(job.output, variables, job.key)
