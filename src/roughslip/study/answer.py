"""Stage answer: whether the scene's oscillator stick-slips, where that ceases or begins, how it moves, what decides."""

from dataclasses import asdict

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.oscillator.answer_parts import Quantity
from roughslip.oscillator.answers import answer, check_has_answer
from roughslip.oscillator.machine import OF_MEMORY, OF_OSCILLATOR
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.states import states_of_answer
from roughslip.report.words import answer_summary
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream
from roughslip.study.from_scene.machine import friction_of, machine_of
from roughslip.study.job import Job

VARIED = OF_OSCILLATOR


def work(scene: Scene, job: Job) -> None:
    """Write answer.json."""
    friction, machine = friction_of(scene, job.optional("friction")), machine_of(scene, job.optional("friction"))
    runs, periods, seed = scene.answer.realisations, scene.answer.duration_periods, (scene.seed, Stream.ANSWER)
    given, remembers = scene.oscillator.static_friction, isinstance(machine.law, MemoryLaw)
    if given is not None and not remembers and machine.law.static > given:
        job.warn(
            f"oscillator.static_friction = {given:g} is less than friction in slip, {machine.law.static:.4g}, taken as "
            "the limit of stick: raise it"
        )
    try:
        check_has_answer(machine)
    except IllPosedError as error:
        lines = [f"Stick-slip: no answer, because {error.in_scene}."]
        store.write_json(job.output, {"given": False, "reason": error.in_scene, "summary": lines})
        return
    asked = scene.answer.can_change
    ranges = None if asked is None else {name: ends for name, ends in vars(asked).items() if ends is not None}
    varied = (*VARIED, *OF_MEMORY) if remembers else VARIED
    answered = answer(machine, runs, periods, varied, seed, job.progress, ranges)
    job.count(runs=answered.trials)
    shown_friction = {
        "friction_mean": friction.mean,
        "friction_deviation": friction.deviation,
        "friction_pad_deviation": friction.pad_deviation,
        "windows": friction.windows,
    }
    shown = {name: value for name, value in asdict(answered).items() if not name.startswith("durations")}
    omega = machine.oscillator.natural_frequency_rad_per_s
    over_load = None if machine.over_load is None else asdict(machine.over_load)
    result = {"given": True, "friction_over_load": over_load, **shown} | {
        **{name: asdict(Quantity(value, None, "1")) for name, value in shown_friction.items()},
        "can_change": ranges,
        "states": states_of_answer(answered.durations, answered.durations_by_theory, omega),
    }
    store.write_json(job.output, result | {"summary": answer_summary(result)})
