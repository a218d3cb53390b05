"""Which strips a job takes: those of its batch or, where an accuracy is asked, its share of those that are allotted."""

from roughslip import store
from roughslip.limits import STRIP_SHARES
from roughslip.stages.runtime.command import Job


def numbers_of(job: Job, name: str, start: int = 0) -> range:
    """Numbers of the strips of a job.

    name : in the allocation, of the number of strips that all jobs of the stage take
    start : first strip that is shared out
    """
    first, last = job.arguments.first, job.arguments.last
    if job.arguments.allocation is None:
        return range(first, last)
    count = int(store.read(job.arguments.allocation)[name]) - start
    return range(start + count * first // STRIP_SHARES, start + count * last // STRIP_SHARES)


def solved_strips(job: Job) -> int:
    """Number of strips that are solved, as the scene says or as allotted."""
    allocation = job.arguments.allocation
    return int(job.scene.strip.samples if allocation is None else store.read(allocation)["strips"])
