"""Stage claims: the verdict on each statement of the paper, from what the scene found."""

from __future__ import annotations

from roughslip import store
from roughslip.claims import claims
from roughslip.stages.command import Job, execute


def work(job: Job) -> None:
    """Write claims.json."""
    paths = {name: getattr(job.arguments, name) for name in ("square", "friction", "oscillator")}
    results = {name: None if path is None else store.read(path) for name, path in paths.items()}
    with job.usage.core():
        found = claims(**results)
    job.usage.count(claims=len(found))
    store.write_json(job.arguments.output, found)


if __name__ == "__main__":
    execute("claims", work, optional=("square", "friction", "oscillator"))
