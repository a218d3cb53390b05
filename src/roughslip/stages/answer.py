"""Stage answer: whether the scene's oscillator stick-slips, where that ceases or begins, how it moves, what decides."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.paths import path_sampler
from roughslip.friction.process import FrictionProcess
from roughslip.oscillator.changed import PARAMETERS
from roughslip.oscillator.durations import Residence, states_of_answer, theory_or_nan
from roughslip.oscillator.stick_slip import Quantity, answer
from roughslip.report.answer import summary
from roughslip.scene.declarations import Stage
from roughslip.scene.fields import unless_auto
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry, mass_on_belt, variation
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="answer",
    reads="seed oscillator",
    reads_if_given="answer.realisations answer.duration_periods ensemble.marginal friction.statistics friction.scatter",
    optional={"friction": "friction friction_under_load record"},
    result="answer.json",
    target="answer",
    comes_with="deterministic stick_slip_map",
    memory_mb=620,
)

NODES = 4  # per correlation length, as in the map
VARIED = tuple(PARAMETERS)


def work(job: Job) -> None:
    """Write answer.json."""
    scene = job.scene
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    own = variation.system(scene, numbers)
    process = variation.process(scene, own, job.arguments.friction)
    length, count = process.correlation_length_m, scene.answer.realisations
    try:
        with job.usage.core():
            found = answer(
                own.belt,
                own.law,
                path_sampler(process, length / NODES),
                length,
                mass_on_belt.motion_options(scene),
                count,
                unless_auto(scene.answer.duration_periods),
                (scene.seed, geometry.STREAM_ANSWER),
                VARIED,
                job.usage.progress,
            )
    except IllPosedError as error:
        lines = [f"Stick-slip: no answer, because {error}."]
        store.write_json(job.arguments.output, {"given": False, "reason": str(error), "summary": lines})
        return
    job.usage.count(runs=found.trials)
    job.usage.skip({skip_reasons.KEPT: found.trials - count})
    of_pad = mass_on_belt.pad_deviation(scene, numbers, job.arguments.friction, own.windows)
    friction = {"mean": numbers.mean, "deviation": numbers.standard_deviation, "pad_deviation": of_pad}
    shown = {name: value for name, value in asdict(found).items() if name != "residence"}
    result = {"given": True, **shown} | {
        **{f"friction_{name}": asdict(Quantity(value, None, "1")) for name, value in friction.items()},
        "windows": asdict(Quantity(own.windows, None, "1")),
        "states": states(job.scene, own, of_pad, process, found.residence),
    }
    store.write_json(job.arguments.output, result | {"summary": summary(result)})


def states(
    scene: Scene, own: variation.System, deviation: float, process: FrictionProcess, measured: Residence
) -> dict[str, Any]:
    """Time in each state, by the runs and by the chain of troughs. deviation : of the friction of all windows"""
    scatter = deviation / mass_on_belt.unit_of_scatter(scene, own.numbers)
    options, length = mass_on_belt.motion_options(scene), process.correlation_length_m
    theory = theory_or_nan(own.belt, own.law, scatter, length, process.autocorrelation, options)
    return states_of_answer(measured, theory, own.belt.natural_frequency_rad_per_s)
