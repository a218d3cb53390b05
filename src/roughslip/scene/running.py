"""Sections `numerics` and `batches` of a scene."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.declarations import declarations
from roughslip.scene.fields import Section, integer, number, section
from roughslip.scene.mistakes import Mistake, Values, given, refused


@section
class Numerics(Section):
    """Tolerances of the solvers."""

    contact_tolerance: float = number(
        "Relative residual to which a contact problem is solved", at_least=1e-14, at_most=0.001, default=None
    )
    oscillator_tolerance: float = number(
        "Relative error allowed in the slip motion per unit of omega t", at_least=1e-13, at_most=0.001, default=None
    )


@section
class Batches(Section):
    """Number of samples that a job takes; no result depends on it."""

    square_samples: int = integer("Squares solved in a job", at_least=1, at_most=100_000_000, default=None)
    strip_samples: int = integer("Strips solved in a job", at_least=1, at_most=100_000_000, default=None)
    expansion_samples: int = integer(
        "Strips on which a job evaluates the expansion", at_least=1, at_most=100_000_000, default=None
    )
    realisations: int = integer("Realisations integrated in a job", at_least=1, at_most=100_000_000, default=None)


MOST_JOBS = 2000  # of one total: Snakemake plans each of them, and each takes a second or two to start


def mistakes(scene: Values) -> Iterator[Mistake]:
    """Batches so small that a stage has too many jobs."""
    for batches in (stage.batches for stage in declarations().values() if stage.batches):
        size = given(scene, batches.size)
        for total in batches.totals.values():
            count = given(scene, total)
            if size is not None and isinstance(count, int) and count > MOST_JOBS * size:
                allowed = f"enough that {total} = {count} takes at most {MOST_JOBS} jobs"
                yield refused(size, allowed, batches.size, total)
