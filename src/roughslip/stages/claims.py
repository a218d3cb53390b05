"""Stage claims: the verdict on each statement of the paper under each of its readings, from what the scene found."""

from roughslip import store
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job
from roughslip.verdicts.statements import claims

STAGE = Stage(
    name="claims",
    reads="description targets",
    collects={"square": "chaos_square", "friction": "friction", "oscillator": "cycles"},
    result="claims.json",
    target="every scene",
)


def work(job: Job) -> None:
    """Write claims.json."""
    paths = {name: getattr(job.arguments, name) for name in STAGE.options}
    results = {name: store.read(path) if path is not None else None for name, path in paths.items()}
    if results["friction"] and "load_mean" in results["friction"]:  # the paper has no load
        results["friction"] = None
    with job.usage.core():
        judged = claims(results["square"], results["friction"], results["oscillator"])
    job.usage.count(claims=len(judged))
    store.write_json(job.arguments.output, judged)
