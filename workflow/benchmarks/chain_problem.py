"""What the error budget of the chain shares: a change of a number, paired over samples, with its standard error.

One source at a time is varied with common random numbers: the same surfaces, strips or paths, solved once as the scene
does and once better. The change is then known far better than the number itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from workflow.benchmarks.measure import Row, case, row

GROUPS = 20  # of samples, left out in turn
FIRST_ORDER = 2.0  # error over the change on halving a cell, for an error in proportion to the cell

Numbers = Mapping[str, float]
Statistic = Callable[[np.ndarray], Numbers]  # from the places of the samples that count to numbers


class Change(NamedTuple):
    """Relative change of a number and its standard error, both as shares of the number."""

    value: float
    shift: float
    error: float


def jackknifed(samples: int, rough: Statistic, better: Statistic) -> dict[str, Change]:
    """How the numbers of `rough` differ from those of `better`, over the latter.

    samples : of both, the same ones

    Method: delete-a-group jackknife of the ratio (Kott, J. Off. Stat. 17 (2001) 521).
    """
    everyone = np.arange(samples)
    group = everyone % min(GROUPS, samples)
    whole = _ratios(everyone, rough, better)
    without = [_ratios(everyone[group != number], rough, better) for number in range(group.max() + 1)]
    reference, found = better(everyone), {}
    for name, ratio in whole.items():
        scatter = np.array([one[name] for one in without])
        error = float(np.sqrt((len(scatter) - 1) * np.mean((scatter - scatter.mean()) ** 2)))
        found[name] = Change(reference[name], ratio - 1.0, error)
    return found


def _ratios(chosen: np.ndarray, rough: Statistic, better: Statistic) -> dict[str, float]:
    of_rough, of_better = rough(chosen), better(chosen)
    return {name: of_rough[name] / value for name, value in of_better.items()}


def rows(
    scene: str,
    source: str,
    changes: Mapping[str, Change],
    seconds: Sequence[float],
    work: int,
    *,
    factor: float = 1.0,
    **more: object,
) -> list[Row]:
    """A row a number: its error from a source, the change times `factor`, told with the standard error of that."""
    return [
        row(
            case(scene=scene, number=name),
            source,
            factor * abs(change.shift),
            seconds,
            work,
            value=change.value,
            shift=factor * change.shift,
            standard_error=factor * change.error,
            **more,
        )
        for name, change in changes.items()
    ]
