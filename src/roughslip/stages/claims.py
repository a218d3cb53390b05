"""Stage claims: the verdict on each statement of the paper under each of its readings, from what the scene found."""

import json
from typing import Any

from roughslip import store
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job
from roughslip.verdicts.finding import strips_that_decide
from roughslip.verdicts.rules import BOUNDS, claims

STAGE = Stage(
    name="claims",
    reads="description targets",
    collects={"square": "chaos_square", "friction": "friction", "oscillator": "cycles"},
    result="claims.json",
    target="every scene",
)


def with_strips(claim: dict[str, Any], strips: int | None) -> dict[str, Any]:
    """The claim on an undecided statement with the number of strips that would decide it, if any would."""
    if strips is None:
        return claim
    number = f"about {float(f'{strips:.2g}'):,.0f} strips would decide it if its number stayed"
    return claim | {"turns": f"{claim['turns']}; {number}"}


def work(job: Job) -> None:
    """Write claims.json."""
    paths = {name: getattr(job.arguments, name) for name in STAGE.options}
    results = {name: store.read(path) for name, path in paths.items() if path is not None}
    friction, oscillator = results.get("friction"), results.get("oscillator")
    with job.usage.core():
        judged = claims(results.get("square"), friction, oscillator)
        if friction is not None:
            strip = json.loads(friction.attributes["configuration"])["strip"]
            strips = int(friction.attributes.get("strips", strip["samples"]))  # or found from the accuracy asked
            deciding = strips_that_decide(friction, strips, BOUNDS)
            judged = [with_strips(claim, deciding.get(claim["id"])) for claim in judged]
    job.usage.count(claims=len(judged))
    store.write_json(job.arguments.output, judged)
