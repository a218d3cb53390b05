"""Stage reference: the small results that the repository keeps, copied from a full run."""

from roughslip.scene.types import Scene
from roughslip.study.job import Job
from roughslip.verdicts.kept_results import KEPT, keep


def work(scene: Scene, job: Job) -> None:
    """Copy the figures, claims, costs and summaries of each scene below the output folder."""
    for folder in job.paths("scenes"):
        keep(folder, job.output / folder.name)
    job.count(files=len(KEPT) * len(job.paths("scenes")))
