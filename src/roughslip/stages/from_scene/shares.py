"""Which samples a job takes: those of its batch or its share of those that an accuracy takes."""

from collections.abc import Callable

from roughslip import store
from roughslip.limits import SHARES
from roughslip.scene.fields import Auto
from roughslip.stages.runtime.command import Job


def sample_range(job: Job, name: str, start: int = 0) -> range:
    """Numbers of the samples of a job.

    name : in the allocation, of the number of samples that all jobs of the stage take
    start : first sample that is shared out
    """
    first, last = job.arguments.first, job.arguments.last
    if job.arguments.allocation is None:
        return range(first, last)
    count = int(store.read(job.arguments.allocation)[name]) - start
    return range(start + count * first // SHARES, start + count * last // SHARES)


def given_or_found(job: Job, given: Callable[[], Auto[int]], name: str) -> int:
    """A number of the scene, or where there is an allocation that of this name in it.

    given : the number of the scene, a key that a stage with an allocation need not read
    """
    allocation = job.arguments.allocation
    return int(given() if allocation is None else store.read(allocation)[name])


def solved_strips(job: Job) -> int:
    """Number of strips that are solved."""
    return given_or_found(job, lambda: job.scene.strip.samples, "strips")
