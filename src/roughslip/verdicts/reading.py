"""Statements of the paper and their readings: what is taken how, where the text suggests it, and the rule that judges.

Readings come from the text and from common practice, before their numbers. One is natural, with its reason. The
headline of a statement follows from the verdicts of all its readings, and their number stands next to it: of many
readings one may hold by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from roughslip.verdicts.finding import (
    CONTRADICTED,
    CONTRADICTS,
    NOT_TESTED,
    ON_THRESHOLD,
    REPRODUCED,
    UNDECIDED,
    VERDICTS,
    Arrays,
    Finding,
)

BEYOND = 1e-12  # step with which an interval passes a threshold; the smallest numbers judged are lengths in metres


class Unit(NamedTuple):
    """Unit of a number, the factor to the one that a reader uses, and how that is written after a number."""

    name: str
    scale: float
    after: str


UNITLESS, SHARE = Unit("1", 1.0, ""), Unit("1", 100.0, " %")


def in_unit(unit: Unit, number: float) -> str:
    """A number in the unit that a reader uses."""
    return f"{unit.scale * number:.3g}{unit.after}"


def what_turns(unit: Unit, finding: Finding) -> str:
    """What would turn the verdict: another interval of our number, else of the second number of the rule."""
    if finding.contradicts:
        return "another number in the paper"
    text = _turning(unit, finding)
    if (
        not text
        and finding.other
        and (text := _turning(UNITLESS, replace(finding.other, other=finding, combine=finding.combine)))
    ):
        text = f"{finding.other.note}: {text}"
    return text or "other numbers of the rule, or several at once"


def _turning(unit: Unit, finding: Finding) -> str:
    """The nearest interval of one number for which the rule says something else; empty without one.

    Of a decided verdict it moves with its number, of an undecided one it narrows around it. A width is asked for and
    not samples: part of it may not fall with those of the scene.
    """
    ours, (low, high), now = finding.ours, finding.interval, finding.holds(finding.interval)
    limits = [limit for limit in finding.thresholds if np.isfinite(limit) and (now or low <= limit <= high)]
    ends = [(end, limit) for limit in limits for end in (low, high)]
    if now:
        for size, move, limit in sorted((abs(limit - end), limit - end, limit) for end, limit in ends):
            if any(finding.holds((low + move + step, high + move + step)) != now for step in (-BEYOND, BEYOND)):
                far = in_unit(unit, size).replace("%", "percentage points")
                return f"an interval {far} {'higher' if move > 0 else 'lower'}, which reaches {in_unit(unit, limit)}"
        return ""
    if finding.near_threshold is not None:
        return f"nothing, it lies within {ON_THRESHOLD:.0%} of the threshold {in_unit(unit, finding.near_threshold)}"
    for times in sorted((end - ours) / (limit - ours) * (1 + BEYOND) for end, limit in ends):
        if times > 1 and (then := finding.holds((ours + (low - ours) / times, ours + (high - ours) / times))):
            return f"an interval {times:.3g} times as narrow around the same number, then {VERDICTS[then]}"
    return ""


VISIBLE = 0.1  # Kolmogorov distance that a reader sees between two curves in print, in every family
ANOTHER, UNDER_EVERY = "holds under another reading", "contradicted under every reading tried"
HEADLINES = (REPRODUCED, ANOTHER, UNDER_EVERY, UNDECIDED, NOT_TESTED)
NO_NUMBER = "the number does not exist in this scene: a fit was refused, or no run sticks again; the logs say why"


@dataclass(frozen=True)
class Reading:
    """One way to take a statement.

    id : of the reading, unique within its statement
    taken : what is taken how
    place : where in the paper or in common practice it comes from
    rule : what the 95 % interval of our number must satisfy, in words
    judge : our number with the rule, or the reason why there is none
    natural : why it is the natural reading; empty for the others
    chosen : what was chosen with its number known; that the reading holds is then no evidence for the headline
    unit : of our number
    """

    id: str
    taken: str
    place: str
    rule: str
    judge: Callable[[Arrays], Finding | str]
    natural: str = ""
    chosen: str = ""
    unit: Unit = UNITLESS


@dataclass(frozen=True)
class Statement:
    """What the paper states, its number, and the readings; one of them is natural."""

    id: str
    text: str
    paper: str
    readings: tuple[Reading, ...]

    @property
    def natural(self) -> Reading:
        """The natural reading."""
        (natural,) = (reading for reading in self.readings if reading.natural)
        return natural

    def claim(self, arrays: Arrays | None) -> dict[str, Any]:
        """What claims.json holds of the statement: the natural reading, the headline and all readings.

        arrays : results of the branch; None where the scene does not run it
        """
        judged = {reading.id: _judged(reading, arrays) for reading in self.readings}
        own = self.natural
        verdicts = [judgement["verdict"] for judgement in judged.values()]
        counted = [
            UNDECIDED if reading.chosen and verdict == REPRODUCED else verdict
            for reading, verdict in zip(self.readings, verdicts, strict=True)
        ]
        head = {"id": self.id, "statement": self.text, "paper": self.paper}
        readings = [
            {**head, "id": reading.id, "taken": reading.taken, "place": reading.place, "rule": reading.rule}
            | {"natural": bool(reading.natural), "why": reading.natural, "chosen": reading.chosen}
            | {"unit": reading.unit.name, **judged[reading.id]}
            for reading in self.readings
        ]
        of_statement = {
            "headline": headline(judged[own.id]["verdict"], counted),
            "unit": own.unit.name,
            **judged[own.id],
        }
        tried = sum(verdict != NOT_TESTED for verdict in verdicts)
        return {**head, **of_statement, "rule": own.rule, "tried": tried, "readings": readings}


def headline(natural: str, verdicts: Sequence[str]) -> str:
    """The headline of a statement from the verdict of its natural reading and those of all that are evidence."""
    if natural == REPRODUCED:
        return REPRODUCED
    if REPRODUCED in verdicts:
        return ANOTHER
    tested = [verdict for verdict in verdicts if verdict != NOT_TESTED]
    if not tested:
        return NOT_TESTED
    return UNDER_EVERY if set(tested) <= {CONTRADICTED, CONTRADICTS} else UNDECIDED


NO_STAGE = "the scene does not run this stage"


def _judged(reading: Reading, arrays: Arrays | None) -> dict[str, Any]:
    """The verdict of a reading with its number, or the reason why there is none."""
    finding = NO_STAGE if arrays is None else reading.judge(arrays)
    if arrays is None or isinstance(finding, str) or not np.isfinite([finding.ours, *finding.interval]).all():
        nothing: dict[str, Any] = dict.fromkeys(("ours", "interval", "shown", "turns", "at_half", "at_twice"))
        return nothing | {"verdict": NOT_TESTED, "note": finding if isinstance(finding, str) else NO_NUMBER}
    shown, low, high = (in_unit(reading.unit, number) for number in (finding.ours, *finding.interval))
    scaled = {name: finding.with_tolerance(factor) for name, factor in (("at_half", 0.5), ("at_twice", 2.0))}
    return {
        "ours": finding.ours,
        "interval": finding.interval,
        "shown": f"{shown} ({low} to {high})",
        "verdict": finding.verdict,
        "turns": what_turns(reading.unit, finding),
        **{name: scaled_finding.verdict if scaled_finding else None for name, scaled_finding in scaled.items()},
        "note": finding.note,
    }
