"""A number of ours with its 95 % interval, and what a rule says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

Arrays = Mapping[str, np.ndarray]
Interval = tuple[float, float]
Place = tuple[str, object]
"""A coordinate and its value."""
VISIBLE = 0.1  # Kolmogorov distance that a reader sees between two curves in print, in every family


class Found(NamedTuple):
    """Our number with its 95 % interval, what the rule says of it (1, 0 or -1, as `inside`), and a note."""

    ours: float
    interval: Interval
    says: int
    note: str


Judge = Callable[[Arrays], Found | str]
"""A rule: our number and what the rule says of it, or the reason why there is none."""


def inside(interval: Interval, low: float = -np.inf, high: float = np.inf) -> int:
    """1 for an interval inside [low, high], -1 for one outside, 0 for one that reaches both sides and decides nothing.

    The least of several such numbers is their conjunction, the largest their disjunction (Kleene's logic).
    """
    if low < interval[0] and interval[1] < high:
        return 1
    return -1 if interval[1] <= low or high <= interval[0] else 0


def row_of(arrays: Arrays, place: Place) -> int:
    """The number of a value of a coordinate."""
    return [str(value) for value in arrays[place[0]]].index(str(place[1]))


def number(arrays: Arrays, name: str, place: Place | int | None = None) -> tuple[float, Interval]:
    """A stored number with its interval, at a value of a coordinate or at its number."""
    index = () if place is None else place if isinstance(place, int) else row_of(arrays, place)
    value, low, high = (float(arrays[name + end][index]) for end in ("", "_low", "_high"))
    return value, (low, high)


def shown(stored: tuple[float, Interval], digits: int = 2) -> str:
    """`0.12 (0.10 to 0.14)`."""
    value, (low, high) = stored
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def lies(stored: tuple[float, Interval], note: str, low: float = -np.inf, high: float = np.inf) -> Found:
    """The rule that wants the interval of a number between low and high."""
    return Found(*stored, inside(stored[1], low, high), note)


def within(
    name: str,
    note: str | Callable[[Arrays], str],
    place: Place | None = None,
    low: float = -np.inf,
    high: float = np.inf,
) -> Judge:
    """The same of one stored number, at a value of a coordinate."""
    return lambda arrays: lies(number(arrays, name, place), note if isinstance(note, str) else note(arrays), low, high)
