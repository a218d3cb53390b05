"""Statements of the paper and their readings: what is taken how, where the text suggests it, and the rule that judges.

A rule asks for the 95 % interval of our number on one side of an effect size; no verdict is set by hand. A reading is
`reproduced` where the whole interval lies there, `contradicted` where it lies on the other side, `undecided` where it
reaches both. Without a number it is `not tested`. Readings come from the text and from common practice, before their
numbers. The headline of a statement is the verdict of its natural reading, and then what the others give.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from roughslip.verdicts.found import Arrays, Judge

REPRODUCED, CONTRADICTED, UNDECIDED, NOT_TESTED = "reproduced", "contradicted", "undecided", "not tested"
VERDICTS = {1: REPRODUCED, -1: CONTRADICTED, 0: UNDECIDED}
NO_STAGE = "the scene does not run this stage"
NO_NUMBER = "the number does not exist in this scene: a fit was refused, or no run sticks again; the logs say why"


class Unit(NamedTuple):
    """Unit of a number, the factor to the one that a reader uses, and how that is written after a number."""

    name: str
    scale: float
    after: str

    def shown(self, number: float) -> str:
        """A number in the unit that a reader uses."""
        return f"{self.scale * number:.3g}{self.after}"


UNITLESS, SHARE = Unit("1", 1.0, ""), Unit("1", 100.0, " %")
MICROMETRES, DECADES = Unit("m", 1e6, " µm"), Unit("decades", 1.0, " decades")


@dataclass(frozen=True)
class Reading:
    """One way to take a statement.

    id : of the reading, unique within its statement
    rule : what is taken how, and what the 95 % interval of our number must satisfy, in words
    place : where in the paper or in common practice it comes from
    judge : our number and what the rule says of it, or the reason why there is none
    unit : of our number
    natural : why it is the natural reading; when : of another one, the condition behind "holds if"
    apart : why it is a trap, or was chosen with its number known; it is shown and supports no headline
    """

    id: str
    rule: str
    place: str
    judge: Judge
    unit: Unit = UNITLESS
    natural: str = ""
    when: str = ""
    apart: str = ""


@dataclass(frozen=True)
class Statement:
    """What the paper states, and its readings.

    id, text : of the statement; paper : its number or word; number : what our number is, in words
    readings : one of them natural, at most two others, and those that stand apart
    """

    id: str
    text: str
    paper: str
    number: str
    readings: tuple[Reading, ...]

    def claim(self, arrays: Arrays | None) -> dict[str, Any]:
        """What claims.json holds of the statement: the natural reading, the headline and all readings.

        arrays : results of the branch; None where the scene does not run it
        """
        judged = [_judged(reading, arrays) for reading in self.readings]
        head = {"id": self.id, "statement": self.text, "paper": self.paper}
        readings: list[dict[str, Any]] = [
            {**head, "id": one.id, "rule": one.rule, "place": one.place, "natural": bool(one.natural)}
            | {"why": one.natural, "apart": one.apart, "unit": one.unit.name, **found}
            for one, found in zip(self.readings, judged, strict=True)
        ]
        (own,) = (reading for reading in readings if reading["natural"])
        counted = [reading["verdict"] for reading in readings if not reading["apart"]]
        others = {one.when: found["verdict"] for one, found in zip(self.readings, judged, strict=True) if one.when}
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


def headline(natural: str, others: Mapping[str, str]) -> str:
    """The verdict of the natural reading, and what others give: `contradicted; holds if every return counts`.

    others : verdicts by the condition of each
    """
    for verdict, word in ((REPRODUCED, "holds"), (CONTRADICTED, "contradicted")):
        conditions = [condition for condition, given in others.items() if given == verdict]
        if conditions and natural != verdict:
            return f"{natural}; {word} if {' or '.join(conditions)}"
    return f"{natural}; others open" if natural != UNDECIDED and UNDECIDED in others.values() else natural


def _judged(reading: Reading, arrays: Arrays | None) -> dict[str, Any]:
    """The verdict of a reading with its number, or the reason why there is none."""
    found = NO_STAGE if arrays is None else reading.judge(arrays)
    if isinstance(found, str) or not np.isfinite([found.ours, *found.interval]).all():
        note = found if isinstance(found, str) else NO_NUMBER
        return {"ours": None, "interval": None, "shown": None, "verdict": NOT_TESTED, "note": note}
    shown, low, high = map(reading.unit.shown, (found.ours, *found.interval))
    return {
        "ours": found.ours,
        "interval": found.interval,
        "shown": f"{shown} ({low} to {high})",
        "verdict": VERDICTS[found.says],
        "note": found.note,
    }
