"""Stage reference: the small results that the repository keeps, copied from a full run."""

from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job
from roughslip.verdicts.kept_results import KEPT, keep

STAGE = Stage(
    name="reference",
    reads="description",
    many={"scenes": "report"},
)


def work(job: Job) -> None:
    """Copy the figures, claims, costs and summaries of each scene below the output folder."""
    for folder in job.arguments.scenes:
        keep(folder, job.arguments.output / folder.name)
    job.usage.count(files=len(KEPT) * len(job.arguments.scenes))
