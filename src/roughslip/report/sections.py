"""Sections of the page: what a figure and the paper show, why results differ, and which statements belong there.

All numbers on the page are those of claims.json; the texts here hold no number of ours.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Claim = Mapping[str, Any]
MARKS = {"reproduced": "✓", "contradicted": "✗", "undecided": "?", "not tested": "–"}
BY_CHANCE = 0.025  # of verdicts by one end of a 95 % interval


@dataclass(frozen=True)
class Section:
    """A section of the page.

    title : its heading; paper : what the paper shows; why : where a difference comes from
    """

    title: str
    paper: str = ""
    why: str = ""


SECTIONS = {
    "figure_chain": Section("From the rough surface to stick-slip"),
    "figure_scan": Section("The scan and its models"),
    "figure_record": Section("The friction record, its curve and its scatter"),
    "figure2": Section(
        "Figure 2: pressure at the centre",
        "Monte Carlo, Latin hypercube and both polynomial chaos variants, eqs. (8) and (9), lie on one curve.",
        "Eqs. (8) and (9) stand for the pressure when contact occurs, so they are evaluated at surfaces in contact. "
        "Few samples in contact remain for 165 terms, and most of the error is at low probabilities.",
    ),
    "figure3": Section(
        "Figure 3: friction against penetration",
        "Mean, standard deviation and coefficient of variation of the friction coefficient fall with penetration.",
        "The paper's text gives no material, no roughness height and no values of the figure. So only the trends are "
        "compared. The shear strength is set for a mean of 0.3 at median penetration.",
    ),
    "figure3_law": Section(
        "Distribution and correlation of friction",
        "The friction coefficient is correlated exponentially over 250 µm, right skewed and leptokurtic. Scaled to "
        "(0, 1) it follows Beta(2.1, 5) at every penetration.",
        "Friction is an average over a window of 600 µm. The average alone makes a triangular autocorrelation of "
        "white noise, and draws the distribution towards the normal one. Beta(2.1, 5) has negative excess kurtosis.",
    ),
    "friction_against_load": Section("Friction against load"),
    "figure5": Section(
        "Figure 5: the mass on the belt",
        "With and without scatter the mass moves on a stick-slip limit cycle. Without scatter the cycle ceases at a "
        "sharp limit of damping, and with scatter there is a range where the mass can still move on it.",
        "With scatter the mass changes between stick-slip and sliding, on both sides of the limit. How much of the "
        "time it spends in stick-slip follows from the scatter of friction, which the paper does not give.",
    ),
    "figure_map": Section("Where stick-slip occurs"),
    "figure_budget": Section("What is worth measuring"),
}

# The statements that answer the question of the study, in words that need no context.
ASKED = {
    "fig2-pc-lhs": "Polynomial chaos, fitted as in the paper, gives the distribution of the pressure given contact",
    "fig3-std-decreases": "Friction scatters less in deeper contact",
    "mu-correlation-250um": "Along the path friction is correlated over 250 µm",
    "fig5-range-beyond-limit": "With scatter stick-slip still occurs at a damping where there is none without",
}


def section(figure: str) -> Section:
    """The section of a figure; one without texts has the name of the figure as its title."""
    return SECTIONS.get(figure, Section(figure.replace("_", " ")))


def in_brackets(shown: str | None) -> str:
    """`323 µm (294 µm to 362 µm)` as `323 µm [294, 362]`, and empty for no number."""
    return re.sub(r"^(\S+?)((?: \D*)?) \((\S+?)\2 to (\S+?)\2\)$", r"\1\2 [\3, \4]", shown or "")


def our_number(claim: Claim) -> str:
    """What our number is, and the number with its interval: `skewness 0.34 [0.28, 0.39]`."""
    return f"{claim['number']} {in_brackets(claim['shown'])}" if claim["shown"] else ""


def rows(readings: Mapping[str, Sequence[Claim]], figure: str = "", ids: Iterable[str] = ()) -> list[dict[str, Claim]]:
    """A row for each statement, the claims by scene: those of a figure, those of some ids, or all.

    readings : claims by scene
    """
    by_id: dict[str, dict[str, Claim]] = {}
    for scene, claims in readings.items():
        for claim in claims:
            if claim["id"] in ids or (not ids and figure in ("", claim["figure"])):
                by_id.setdefault(claim["id"], {})[scene] = claim
    return list(by_id.values())


def holding(claim: Claim) -> str:
    """How many readings hold, of those tried: `2 of 3`."""
    return f"{claim['hold']} of {claim['tried']}" if claim["tried"] else ""


def by_chance(claims: Sequence[Claim]) -> str:
    """How many of the verdicts of a scene would be wrong by chance."""
    decided = sum(
        reading["verdict"] in ("reproduced", "contradicted") for claim in claims for reading in claim["readings"]
    )
    return (
        f"{decided} verdicts on readings are decided by 95 % intervals: if every number lay on its threshold, about "
        f"{BY_CHANCE * decided:.1f} of them would be wrong by chance"
    )


def answers(readings: Mapping[str, Sequence[Claim]]) -> list[str]:
    """The answer of the study in at most five sentences. readings : claims by scene"""
    if not readings:
        return []
    parts = []
    for scene, claims in readings.items():
        verdicts = [claim["verdict"] for claim in claims if not claim["id"].startswith("own-")]
        counts = [f"{verdicts.count(verdict)} {verdict}" for verdict in MARKS if verdict in verdicts]
        parts.append(f"{', '.join(counts)} in scene {scene}")
    sentences = [f"The paper's statements: {'; '.join(parts)}."]
    for name, lead in ASKED.items():
        for row in rows(readings, ids=(name,)):
            tested = {scene: claim for scene, claim in row.items() if claim["shown"]}
            verdicts = [f"{claim['verdict']} in {scene}" for scene, claim in tested.items()]
            numbers = [in_brackets(claim["shown"]) for claim in tested.values()]
            if tested:
                sentences.append(
                    f"{lead}: {', '.join(verdicts)} ({next(iter(row.values()))['number']} {' and '.join(numbers)})."
                )
    return sentences
