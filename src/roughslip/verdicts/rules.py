"""Verdicts on the paper's statements, each from our number and its interval by the written rules of its readings.

A rule asks for an interval on one side of an effect size; no verdict is set by hand. A reading is `reproduced` where
the whole interval lies there, `contradicted` where it lies on the other side, `undecided` where it reaches both. One at
odds with another number of the paper `contradicts itself`. Without numbers it is `not tested`. The modules of the
families hold the text of the paper, the readings and the rules; the headline is in `reading.py`.
"""

from __future__ import annotations

from typing import Any

from roughslip.verdicts import (
    centre_pressure,
    friction_correlation,
    friction_distribution,
    friction_over_penetration,
    motion_on_the_belt,
)
from roughslip.verdicts.finding import Arrays

ON_FRICTION = (
    *friction_over_penetration.STATEMENTS,
    *friction_correlation.STATEMENTS,
    *friction_distribution.STATEMENTS,
)
BOUNDS = {**friction_over_penetration.BOUNDS, **friction_correlation.BOUNDS, **friction_distribution.BOUNDS}
"""By statement on friction the rule for which enough strips are counted."""
STATEMENTS = (
    *centre_pressure.STATEMENTS,
    *ON_FRICTION,
    *motion_on_the_belt.STATEMENTS,
    *motion_on_the_belt.OWN,
)


def claims(square: Arrays | None, friction: Arrays | None, oscillator: Arrays | None) -> list[dict[str, Any]]:
    """Every statement in the order of the paper and then our own, from the results of the branches that the scene runs.

    square, friction, oscillator : contents of chaos/square.nc, friction/statistics.nc, oscillator/statistics.nc

    Each is a mapping with id, statement, paper, headline, tried (number of readings with a verdict) and readings. It
    has the numbers of the natural reading: ours and interval (low, high) in the unit, and shown in that of a reader.
    Then come verdict, turns (what would turn it), at_half and at_twice (the verdict with so many times the tolerance),
    note and rule. A reading has the same, with taken, place, natural and why.
    """
    both = None if friction is None or oscillator is None else {**friction, **oscillator}
    branches = (
        (square, centre_pressure.STATEMENTS),
        (friction, ON_FRICTION),
        (oscillator, motion_on_the_belt.STATEMENTS),
        (both, motion_on_the_belt.OWN),
    )
    return [statement.claim(arrays) for arrays, statements in branches for statement in statements]
