"""Stage answer: whether the scene's oscillator stick-slips, where that ceases or begins, how it moves, what decides."""

from __future__ import annotations

from dataclasses import asdict

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.oscillator.answer_runs import Sampling
from roughslip.oscillator.answers import Quantity, answer, check_has_answer
from roughslip.oscillator.machine import OF_OSCILLATOR
from roughslip.oscillator.state_durations import states_of_answer
from roughslip.report.words import answer_summary
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene.machine import friction_of, machine_of
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

VARIED = OF_OSCILLATOR


def work(job: Job) -> None:
    """Write answer.json."""
    scene = job.scene
    friction, machine = friction_of(scene, job.arguments.friction), machine_of(scene, job.arguments.friction)
    sampling = Sampling(scene.answer.realisations, scene.answer.duration_periods, (scene.seed, Stream.ANSWER))
    try:
        check_has_answer(machine)
    except IllPosedError as error:
        lines = [f"Stick-slip: no answer, because {error}."]
        store.write_json(job.arguments.output, {"given": False, "reason": str(error), "summary": lines})
        return
    with job.usage.core():
        answered = answer(machine, sampling, VARIED, job.usage.progress)
    job.usage.count(runs=answered.trials)
    job.usage.skip({skip_reasons.KEPT: answered.trials - sampling.realisations})
    shown_friction = {
        "friction_mean": friction.mean,
        "friction_deviation": friction.deviation,
        "friction_pad_deviation": friction.pad_deviation,
        "windows": friction.windows,
    }
    shown = {name: value for name, value in asdict(answered).items() if not name.startswith("durations")}
    omega = machine.oscillator.natural_frequency_rad_per_s
    result = {"given": True, **shown} | {
        **{name: asdict(Quantity(value, None, "1")) for name, value in shown_friction.items()},
        "states": states_of_answer(answered.durations, answered.durations_by_theory, omega),
    }
    store.write_json(job.arguments.output, result | {"summary": answer_summary(result)})
