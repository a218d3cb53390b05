"""Which samples a job takes: those of its batch or its share of those that an accuracy takes."""

from roughslip import store
from roughslip.limits import SHARES
from roughslip.stages.runtime.command import Job


def numbers_of(job: Job, name: str, start: int = 0) -> range:
    """Numbers of the samples of a job.

    name : in the allocation, of the number of samples that all jobs of the stage take
    start : first sample that is shared out
    """
    first, last = job.arguments.first, job.arguments.last
    if job.arguments.allocation is None:
        return range(first, last)
    count = int(store.read(job.arguments.allocation)[name]) - start
    return range(start + count * first // SHARES, start + count * last // SHARES)


def solved_strips(job: Job) -> int:
    """Number of strips that are solved, as the scene says or as allotted."""
    allocation = job.arguments.allocation
    return int(job.scene.strip.samples if allocation is None else store.read(allocation)["strips"])
