"""Statements of the paper and their readings: what is taken how, where the text suggests it, and the rule that judges.

Readings come from the text and from common practice, before their numbers. One is natural, with its reason. The
headline of a statement follows from the verdicts of all its readings, and their number stands next to it: of many
readings one may hold by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from roughslip.verdicts.finding import CONTRADICTED, CONTRADICTS, NOT_TESTED, REPRODUCED, UNDECIDED, Arrays, Finding
from roughslip.verdicts.turning import UNITLESS, Unit, in_unit, what_turns

VISIBLE = 0.1  # Kolmogorov distance that a reader sees between two curves in print, in every family
ANOTHER, UNDER_EVERY = "holds under another reading", "contradicted under every reading tried"
HEADLINES = (REPRODUCED, ANOTHER, UNDER_EVERY, UNDECIDED, NOT_TESTED)
NO_NUMBER = "the number does not exist in this scene: a fit was refused, or no run sticks again; the logs say why"


class PValue(NamedTuple):
    """A stored p-value that a note reports: its variable, the hypothesis, and the variable of the least it can be."""

    variable: str
    hypothesis: str
    minimum: str = "least_p_value"

    def __call__(self, arrays: Arrays) -> str:
        """`; no change: p at most 0.0025`, empty where it was not computed."""
        p = float(arrays[self.variable])
        if not np.isfinite(p):
            return ""
        at_floor = p <= float(arrays[self.minimum]) * (1 + 1e-9)
        return f"; {self.hypothesis}: p {'at most' if at_floor else '='} {p:.2g}"


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
    unit : of our number; p_value : of the note
    """

    id: str
    taken: str
    place: str
    rule: str
    judge: Callable[[Arrays], Finding | str]
    natural: str = ""
    chosen: str = ""
    unit: Unit = UNITLESS
    p_value: PValue | None = None


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
    note = finding.note + (reading.p_value(arrays) if reading.p_value else "")
    shown, low, high = (in_unit(reading.unit, number) for number in (finding.ours, *finding.interval))
    scaled = {name: finding.with_tolerance(factor) for name, factor in (("at_half", 0.5), ("at_twice", 2.0))}
    return {
        "ours": finding.ours,
        "interval": finding.interval,
        "shown": f"{shown} ({low} to {high})",
        "verdict": finding.verdict,
        "turns": what_turns(reading.unit, finding),
        **{name: scaled_finding.verdict if scaled_finding else None for name, scaled_finding in scaled.items()},
        "note": note,
    }
