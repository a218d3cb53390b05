"""Stage budget: how sure stick-slip and its limits are, and the part of each uncertain number of the scene."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import InputError
from roughslip.oscillator.budget import Budget, uncertainty_budget
from roughslip.oscillator.machine import PARAMETERS
from roughslip.report.words import budget_summary
from roughslip.scene.types import Scene
from roughslip.study.from_scene.streams import Stream
from roughslip.study.from_scene.uncertain_inputs import uncertain_inputs
from roughslip.study.job import Job

SAMPLES = 128  # the 95 % intervals of the indices then reach some 0.1 to 0.2 either way


def work(scene: Scene, job: Job) -> None:
    """Write the budget, and in budget.json its summary too, with what to measure next."""
    answer = store.read_json(job.path("answer"))
    if not answer["given"]:
        raise InputError(f"figure_budget: {answer['summary'][0]}")
    inputs = uncertain_inputs(scene, job.optional("friction"), job.optional("scan"))
    seed = (scene.seed, Stream.BUDGET)
    found = uncertainty_budget(
        inputs.machine,
        inputs.sources,
        band_of(answer),
        with_rates=True,
        samples=SAMPLES,
        seed=seed,
    )
    job.count(machines=SAMPLES * (len(inputs.sources) + 2) if inputs.sources else 1)
    result = {
        **asdict(found),
        "answer": answer["probability"],
        "units": {name: PARAMETERS[name].unit for name in found.limits},
    }
    store.write_json(job.outputs["text"], result | {"summary": budget_summary(result)})
    store.write(job.output, variables(found), job.key)


def band_of(answer: Mapping[str, Any]) -> tuple[float, float] | None:
    """Damping ratios of 95 % and of 5 % stick-slip, between which it ends as damping grows; None without both."""
    ends = []
    for label in ("0.95", "0.05"):
        for side, change in (("above", "falls below"), ("below", "rises above")):
            one = answer["limits"]["damping"][side][label]
            ends += [float(one["value"])] if one is not None and one["change"] == change else []
    return (ends[0], ends[1]) if len(ends) == 2 and ends[0] < ends[1] else None


def variables(found: Budget) -> dict[str, store.Variable]:
    """The budget as arrays over results and sources."""
    results = {"probability": found.probability, **found.limits, **found.rates}
    source, both = ("source",), ("result", "source")
    names = list(found.probability.first)
    shares = [found.outcome[name] for name in names]
    stored = {
        "source_name": store.Variable(source, np.array(names or [""]), "1", "sources of uncertainty"),
        "result_name": store.Variable(
            ("result",), np.array(list(results)), "1", "results; limits are of the cycle, rates of its end and begin"
        ),
        "outcome": store.Variable(source, np.array(shares or [0.0]), "1", "share of the variance of the outcome"),
        "outcome_scatter": store.Variable((), found.scatter, "1", "the same, of the scatter of friction"),
        "averaged_probability": store.Variable((), found.probability.mean, "1", "over all that is uncertain"),
    }
    for name, title in (("first", "first Sobol' index"), ("total", "total Sobol' index")):
        parts = [list(getattr(one, name).values()) or [(0.0, 0.0, 0.0)] for one in results.values()]
        stored |= store.with_interval(name, both, np.moveaxis(np.array(parts), -1, 0), "1", title)
    return stored
