"""Stage claims: the verdict on each statement of the paper, from what the scene found, and its sensitivity."""

import json
from typing import Any

from roughslip import store
from roughslip.report.sensitivity_table import unit_of
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job, execute
from roughslip.verdicts.finding import CONTRADICTS, NOT_TESTED
from roughslip.verdicts.rules import claims
from roughslip.verdicts.sensitivity import of_friction, of_the_square, with_sensitivity
from roughslip.verdicts.sensitivity_oscillator import of_the_oscillator
from roughslip.verdicts.strips import strips_that_decide

STAGE = Stage(
    name="claims",
    reads="description targets",
    reads_if_given="material.hardness_pa",
    collects={
        "square": "chaos_square",
        "friction": "friction",
        "oscillator": "cycles",
        "deterministic": "deterministic",
    },
    result="claims.json",
    target="every scene",
)

BRANCHES = ("square", "friction", "oscillator")


def with_strips(claim: dict[str, Any], strips: int | None) -> dict[str, Any]:
    """The claim on an undecided statement with the number of strips that would decide it, if any would."""
    if strips is None:
        return claim
    number = f"about {float(f'{strips:.2g}'):,.0f} strips would decide it if its number stayed"
    return claim | {"turns": f"{claim['turns']}; {number}"}


def work(job: Job) -> None:
    """Write claims.json."""
    paths = {name: getattr(job.arguments, name) for name in (*BRANCHES, "deterministic")}
    results = {name: store.read(path) for name, path in paths.items() if path is not None}
    scenes = {name: json.loads(result.attributes["configuration"]) for name, result in results.items()}
    scenes["claims"] = job.key.configuration
    if "friction" in results and "strips" in results["friction"].attributes:  # found from the accuracy asked
        scenes["friction"]["strip"]["samples"] = int(results["friction"].attributes["strips"])
    with job.usage.core():
        found = claims(*(results.get(name) for name in BRANCHES))
        if "friction" in results:
            deciding = strips_that_decide(results["friction"], scenes["friction"]["strip"]["samples"])
            found = [with_strips(claim, deciding.get(claim["id"])) for claim in found]
        verdicts = {claim["id"]: claim["verdict"] for claim in found}
        tested = {name: verdict for name, verdict in verdicts.items() if verdict not in (NOT_TESTED, CONTRADICTS)}
        sensitivities = of_the_square(tested, scenes) if "square" in results else {}
        if "friction" in results:
            sensitivities |= of_friction(tested, results["friction"], scenes)
        if "oscillator" in results:
            sensitivities |= of_the_oscillator(tested, results["oscillator"], results["deterministic"], scenes)
    job.usage.count(claims=len(found))
    whole = with_sensitivity(found, sensitivities)
    for one in (one for claim in whole if claim["stands"] for one in claim["stands"]["ranges"]):
        one["unit"] = unit_of(one["input"])
    store.write_json(job.arguments.output, whole)


if __name__ == "__main__":
    execute(STAGE, work)
