"""Stage cycles: the motion without scatter, an ensemble of friction paths, and what that sums up to."""

import numpy as np

from roughslip import store
from roughslip.scene.types import Scene
from roughslip.study.deterministic import without_scatter
from roughslip.study.from_scene.streams import Stream
from roughslip.study.job import Job
from roughslip.study.oscillator import with_scatter
from roughslip.study.result_tables import ensemble_table

HISTOGRAM_BINS = 48
Variables = dict[str, store.Variable]


def _unsaid(*texts: str) -> None:
    """Says nothing."""


def work(scene: Scene, job: Job) -> None:
    """Write all three."""
    plain = without_scatter(scene, job)
    ensemble = with_scatter(scene, job, range(scene.ensemble.realisations))
    store.write(job.outputs["deterministic"], plain, job.key)
    store.write(job.outputs["ensemble"], ensemble, job.key)
    store.write(job.output, summed_up(scene, job, plain, ensemble), job.key)


def summed_up(scene: Scene, job: Job, plain: Variables, ensemble: Variables) -> Variables:
    """Return M_d - E[M_S], micro-slips, moments and histogram of the reattachment point, and what is drawn."""
    generator = np.random.default_rng([scene.seed, Stream.BOOTSTRAP])
    runs = ensemble_table.Runs(*(ensemble[name].values for name in ensemble_table.STORED))
    known = {name: variable.values for name, variable in plain.items()}
    nominal = scene.ensemble.duration_periods, scene.oscillator.damping_ratio
    warn = job.warn if runs.place.size else _unsaid  # without a cycle there is nothing to have statistics of
    variables = ensemble_table.ensemble_variables(known, runs, nominal, generator, warn)
    events, edges = np.histogram(runs.place, HISTOGRAM_BINS)
    cut = ensemble["negative_friction"].values > 0
    if cut.any():
        job.warn(
            f"friction would be negative in {np.count_nonzero(cut)} of {cut.size} runs and is cut to zero there: its "
            "mean is then higher and its scatter smaller than asked"
        )
    density = events / max(events.sum(), 1) / np.diff(edges)
    variables["histogram"] = store.Variable(("bin",), density, "m-1", "density of the reattachment point")
    variables["histogram_edge"] = store.Variable(("edge",), edges, "m", "edges of its bins")
    variables["time"] = plain["time"]
    for name in ("position", "velocity"):
        variables[name] = ensemble[name]._replace(long_name=f"{name} of the runs that are drawn")
    for name in ("position", "velocity", "reattachment", "departure"):
        variables[f"deterministic_{name}"] = plain[name]._replace(long_name=f"{name} without scatter")
    responses = [f"load_response_{kind}" for kind in ("additive", "multiplicative")]
    of_friction = ("friction_scatter", "friction_percentile", *responses)
    variables |= {name: plain[name] for name in of_friction if name in plain}
    job.count(events=len(runs.place))
    return variables
