"""Stage answer: whether the scene's oscillator stick-slips, where that ceases or begins, how it moves, what decides."""

from __future__ import annotations

from dataclasses import asdict

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.paths import path_sampler
from roughslip.limits import PATH_NODES
from roughslip.oscillator.answer_runs import Sampling, ScatteringFriction
from roughslip.oscillator.changed import PARAMETERS
from roughslip.oscillator.state_durations import states_of_answer
from roughslip.oscillator.stick_slip import Quantity, answer, check_has_answer
from roughslip.report.words import answer_summary
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import mass_on_belt, variation
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="answer",
    reads="seed oscillator",
    reads_if_given="answer.realisations answer.duration_periods ensemble.marginal friction.statistics friction.scatter",
    optional={"friction": "friction record"},
    result="answer.json",
    target="answer",
    comes_with="deterministic stick_slip_map",
    memory_mb=620,
)

VARIED = tuple(PARAMETERS)


def work(job: Job) -> None:
    """Write answer.json."""
    scene = job.scene
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    own = variation.system(scene, numbers)
    process = variation.process(scene, own, job.arguments.friction)
    length, count = process.correlation_length_m, scene.answer.realisations
    of_pad = mass_on_belt.pad_deviation(scene, numbers, job.arguments.friction, own.windows)
    scatter = of_pad / mass_on_belt.unit_of_scatter(scene, own.numbers)
    sampling = Sampling(count, scene.answer.duration_periods, (scene.seed, Stream.ANSWER))
    try:
        check_has_answer(own.belt, own.law)
    except IllPosedError as error:
        lines = [f"Stick-slip: no answer, because {error}."]
        store.write_json(job.arguments.output, {"given": False, "reason": str(error), "summary": lines})
        return
    with job.usage.core():
        paths = path_sampler(process, length / PATH_NODES)
        friction = ScatteringFriction(paths, length, scatter, process.autocorrelation)
        options = mass_on_belt.motion_options(scene)
        answered = answer(own.belt, own.law, friction, options, sampling, VARIED, job.usage.progress)
    job.usage.count(runs=answered.trials)
    job.usage.skip({skip_reasons.KEPT: answered.trials - count})
    shown_friction = {"mean": numbers.mean, "deviation": numbers.standard_deviation, "pad_deviation": of_pad}
    shown = {name: value for name, value in asdict(answered).items() if not name.startswith("durations")}
    result = {"given": True, **shown} | {
        **{f"friction_{name}": asdict(Quantity(value, None, "1")) for name, value in shown_friction.items()},
        "windows": asdict(Quantity(own.windows, None, "1")),
        "states": states_of_answer(
            answered.durations, answered.durations_by_theory, own.belt.natural_frequency_rad_per_s
        ),
    }
    store.write_json(job.arguments.output, result | {"summary": answer_summary(result)})
