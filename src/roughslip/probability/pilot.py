"""From an accuracy asked to numbers of samples: the error budget that friction, pressure and cycles share.

Half widths w of 95 % intervals have parts that samples do not reduce, and one that falls with their numbers n::

    w(n) = fixed + sampled(n) <= asked

- fixed: by the mesh, by missing modes, or by the nodes of friction paths
- sampled: by the scatter of n samples, larger than a pilot shows by the margin of its own few samples

A pilot estimates the parts. The cheapest n with w(n) <= asked are taken. Where no n within the limits of cost and
memory have that, the accuracy is refused before anything else is computed, and the nearest one is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from roughslip.errors import IllPosedError
from roughslip.limits import LARGEST_ACCURACY

Accuracy = Mapping[str, float]
"""Largest half widths, by the key of section `accuracy` of a scene."""

Numbers = TypeVar("Numbers")


@dataclass(frozen=True)
class Pilot(Generic[Numbers]):
    """The numbers of samples that an accuracy takes, or the nearest accuracy that is reached.

    asked : the accuracy
    cheapest : numbers of samples that keep given half widths at the least cost; None where none within the limits do
    advice : what else to do than to ask for the nearest accuracy
    margin : factor on the nearest accuracy, where its own pilot has other samples
    """

    asked: Accuracy
    cheapest: Callable[[Accuracy], Numbers | None]
    advice: Callable[[], str]
    margin: float = 1.0

    def numbers(self) -> Numbers:
        """The cheapest numbers. Raises IllPosedError with the nearest accuracy where none reach the one asked."""
        numbers = self.cheapest(self.asked)
        if numbers is None:
            raise IllPosedError(refusal(self.asked, self.nearest(), self.advice()))
        return numbers

    def nearest(self) -> dict[str, float] | None:
        """The half widths nearest to those asked that are reached, all in the same ratio, to 1 %.

        None where not even the largest that a scene may ask for are.
        """
        margin = 1.005 * self.margin  # three digits round by at most half of 1 %
        low, high = 1.0, min(LARGEST_ACCURACY[name] / width for name, width in self.asked.items()) / margin
        if self.cheapest(widened(self.asked, high)) is None:
            return None
        while high > 1.002 * low:
            factor = math.sqrt(low * high)
            low, high = (factor, high) if self.cheapest(widened(self.asked, factor)) is None else (low, factor)
        return widened(self.asked, margin * high)


def widened(accuracy: Accuracy, factor: float) -> dict[str, float]:
    """An accuracy of so many times the half widths, in three digits."""
    return {name: float(f"{factor * width:.3g}") for name, width in accuracy.items()}


def refusal(asked: Accuracy, nearest: Accuracy | None, advice: str) -> str:
    """The message on an accuracy out of reach. Both accuracies are written as in a scene file."""
    wanted, reached = (
        "{" + ", ".join(f"{name}: {width:g}" for name, width in (accuracy or {}).items()) + "}"
        for accuracy in (asked, nearest)
    )
    if nearest is None:
        return f"accuracy: {wanted} is not reached, nor is any other; {advice}"
    return f"accuracy: {wanted} is not reached; nearest is {reached}; ask for that, or {advice}"
