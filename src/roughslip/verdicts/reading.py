"""Statements of the paper and their readings: what is taken how, where the text suggests it, and the rule that judges.

A rule asks for the 95 % interval of our number on one side of an effect size; no verdict is set by hand. A reading is
`reproduced` where the whole interval lies there, `contradicted` where it lies on the other side, `undecided` where it
reaches both. Without a number it is `not tested`. Readings come from the text and from common practice, before their
numbers. The headline of a statement is the verdict of its natural reading, and then what the others give.

Two distributions are alike where their Kolmogorov distance is below half of that of the nearer of normal and uniform,
of equal mean and deviation, from the reference distribution. So every rule on a distribution rejects these two.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from roughslip.friction.marginal import NORMAL_DISTANCE

Arrays = Mapping[str, np.ndarray]
Interval = tuple[float, float]
Stored = tuple[float, Interval]
Place = tuple[str, object]
"""A coordinate and its value."""
LIKE_BETA = NORMAL_DISTANCE / 2.0  # below which a distribution is like Beta(2.1, 5), of which the normal is the nearer
REPRODUCED, CONTRADICTED, UNDECIDED, NOT_TESTED = "reproduced", "contradicted", "undecided", "not tested"
VERDICTS = {1: REPRODUCED, -1: CONTRADICTED, 0: UNDECIDED}
NO_STAGE = "the scene does not run this stage"
NO_NUMBER = "the number does not exist in this scene: a fit was refused, or no run sticks again; the logs say why"


class Found(NamedTuple):
    """Our number with its 95 % interval, what the rule says of it (1, 0 or -1, as `inside`), and a note."""

    ours: float
    interval: Interval
    says: int
    note: str


Judge = Callable[[Arrays], Found | str]
"""Our number and what the rule says of it, or the reason why there is none."""


class Rule(NamedTuple):
    """What the 95 % interval of our number must satisfy, in words, and the function that judges it."""

    text: str
    judge: Judge


def rule(text: str) -> Callable[[Judge], Rule]:
    """The rule of these words that a function judges."""
    return lambda judge: Rule(text, judge)


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


def number(arrays: Arrays, name: str, place: Place | int | None = None) -> Stored:
    """A stored number with its interval, at a value of a coordinate or at its number."""
    index = () if place is None else place if isinstance(place, int) else row_of(arrays, place)
    value, low, high = (float(arrays[name + end][index]) for end in ("", "_low", "_high"))
    return value, (low, high)


def shown(stored: Stored, digits: int = 2) -> str:
    """`0.12 (0.10 to 0.14)`."""
    value, (low, high) = stored
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def lies(stored: Stored, note: str, low: float = -np.inf, high: float = np.inf) -> Found:
    """What the rule says that wants the interval of a number between low and high."""
    return Found(*stored, inside(stored[1], low, high), note)


def within(text: str, name: str, note: Callable[[Arrays], str], place: Place | None = None, **ends: float) -> Rule:
    """The rule that wants the same of one stored number, at a value of a coordinate. ends : low or high"""
    return Rule(text, lambda arrays: lies(number(arrays, name, place), note(arrays), **ends))


class Unit(NamedTuple):
    """Unit of a number, the factor to the one that a reader uses, and how that is written after a number."""

    name: str
    scale: float
    after: str


UNITLESS, SHARE = Unit("1", 1.0, ""), Unit("1", 100.0, " %")
MICROMETRES, DECADES = Unit("m", 1e6, " µm"), Unit("decades", 1.0, " decades")


@dataclass(frozen=True)
class Reading:
    """One way to take a statement.

    id : of the reading, unique within its statement
    rule : what is taken how, and what the 95 % interval of our number must satisfy
    place : where in the paper or in common practice it comes from
    natural : why it is the natural reading; when : of another one, the condition behind "holds if"
    apart : why it is a trap, or was chosen with its number known; it is shown and supports no headline
    """

    id: str
    rule: Rule
    place: str
    natural: str = ""
    when: str = ""
    apart: str = ""


@dataclass(frozen=True)
class Statement:
    """What the paper states, and its readings.

    id, text : of the statement; paper : its number or word; number, unit : what our number is
    readings : one of them natural, at most two others, and those that stand apart
    """

    id: str
    text: str
    paper: str
    number: str
    unit: Unit
    readings: tuple[Reading, ...]

    def claim(self, arrays: Arrays | None) -> dict[str, Any]:
        """What claims.json holds of the statement: the natural reading, the headline and all readings.

        arrays : results of the branch; None where the scene does not run it
        """
        head = {"id": self.id, "statement": self.text, "paper": self.paper}
        readings: list[dict[str, Any]] = [
            {**head, "id": one.id, "rule": one.rule.text, "place": one.place, "natural": bool(one.natural)}
            | {"why": one.natural, "apart": one.apart, "unit": self.unit.name, **self._judged(one.rule, arrays)}
            for one in self.readings
        ]
        (own,) = (reading for reading in readings if reading["natural"])
        counted = [reading["verdict"] for reading in readings if not reading["apart"]]
        others = {one.when: of["verdict"] for one, of in zip(self.readings, readings, strict=True) if one.when}
        natural = {name: own[name] for name in ("unit", "ours", "interval", "shown", "verdict", "note", "rule")}
        return {
            **head,
            "number": self.number,
            "headline": headline(own["verdict"], others),
            **natural,
            "tried": len(counted) - counted.count(NOT_TESTED),
            "hold": counted.count(REPRODUCED),
            "readings": readings,
        }

    def _judged(self, rule: Rule, arrays: Arrays | None) -> dict[str, Any]:
        """The verdict by a rule with its number, or the reason why there is none."""
        found = NO_STAGE if arrays is None else rule.judge(arrays)
        if isinstance(found, str) or not np.isfinite([found.ours, *found.interval]).all():
            note = found if isinstance(found, str) else NO_NUMBER
            return {"ours": None, "interval": None, "shown": None, "verdict": NOT_TESTED, "note": note}
        value, low, high = (f"{self.unit.scale * one:.3g}{self.unit.after}" for one in (found.ours, *found.interval))
        return {
            "ours": found.ours,
            "interval": found.interval,
            "shown": f"{value} ({low} to {high})",
            "verdict": VERDICTS[found.says],
            "note": found.note,
        }


def statement(id: str, text: str, paper: str, number: str, unit: Unit, *readings: Reading) -> Statement:
    """A statement with its readings behind it."""
    return Statement(id, text, paper, number, unit, readings)


def headline(natural: str, others: Mapping[str, str]) -> str:
    """The verdict of the natural reading, and what others give: `contradicted; holds if every return counts`.

    others : verdicts by the condition of each
    """
    for verdict, word in ((REPRODUCED, "holds"), (CONTRADICTED, "contradicted")):
        conditions = [condition for condition, given in others.items() if given == verdict]
        if conditions and natural != verdict:
            return f"{natural}; {word} if {' or '.join(conditions)}"
    return f"{natural}; others open" if natural != UNDECIDED and UNDECIDED in others.values() else natural
