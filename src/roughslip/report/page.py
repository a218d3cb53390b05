"""One page, readable without a network, of what scenes found: figures, verdicts, costs and how to repeat the run.

The joint page also shows the kept benchmarks and stress campaigns, which a run of the study does not repeat.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from roughslip.report.drawing import element, plots, thumbnail
from roughslip.report.sections import (
    MARKS,
    SECTIONS,
    answers,
    by_chance,
    holding,
    in_brackets,
    our_number,
    rows,
    section,
)
from roughslip.report.words import (
    amount,
    bars,
    change_rows,
    decision,
    digits,
    ends,
    facts,
    friction_curve,
    percent,
    verdict,
)

OPEN = ("figure_record", "figure_map", "friction_against_load")  # figures that the page of a machine does not fold
READINGS = ("paper", "resolved")  # scenes that read the paper
# Statements on numbers that the paper gives for its own surfaces, or on numbers that follow from them alone.
OF_ITS_NUMBERS = ("mu-correlation-250um", "mu-leptokurtic", "mu-beta-2.1-5", "mu-beta-any-depth")
MEASURED = {
    "surface": "Surfaces: error of the covariance of samples against time.",
    "contact": "Contact: error of the pressure against time, and time at equal independent residual by mesh.",
    "chaos": "Pressure at the centre: distance of the distribution from its Monte Carlo reference against contact "
    "solves.",
    "oscillator": "Oscillator: error of the point where the mass sticks again against the time of a cycle.",
}


@dataclass(frozen=True)
class Evidence:
    """Kept benchmarks and stress campaigns.

    pictures : SVG or PNG bytes by benchmark
    stress : rows with stage, problems, outcomes, worst residual over tolerance
    machine : on which the benchmarks ran, by benchmark
    """

    pictures: Mapping[str, bytes] = field(default_factory=dict)
    stress: Sequence[Mapping[str, Any]] = ()
    machine: Mapping[str, str] = field(default_factory=dict)

    @property
    def measured(self) -> dict[str, bytes]:
        """Pictures of the benchmarks, in their order on the page."""
        return {name: self.pictures[name] for name in MEASURED if name in self.pictures}

    def caption(self, name: str) -> str:
        """Caption of the picture of a benchmark."""
        machine = f" Measured on: {self.machine[name]}." if name in self.machine else ""
        return f"{MEASURED[name]}{machine} To repeat it: make benchmark."


@dataclass(frozen=True)
class SceneReport:
    """What the page shows of a scene.

    name, description : of the scene
    figures : bytes of a PNG, or of an SVG that drawing.reduced made, by the name of the figure
    captions : by the name of the figure
    surfaces : how the surface behind a figure is represented and why, in sentences, by the name of the figure
    claims, costs : contents of claims.json and costs.json
    configuration : what the stages read of the scene
    answer, budget : contents of answer.json and budget.json; None where no such stage runs
    folder : of its files, from the folder of the page: empty, or ending in a slash
    file : the scene file, from the folder of the page; empty for a scene without one
    """

    name: str
    description: str
    figures: Mapping[str, bytes]
    captions: Mapping[str, str]
    surfaces: Mapping[str, Sequence[str]]
    claims: Sequence[Mapping[str, Any]]
    costs: Sequence[Mapping[str, Any]]
    configuration: str
    answer: Mapping[str, Any] | None = None
    budget: Mapping[str, Any] | None = None
    folder: str = ""
    file: str = ""

    @property
    def is_reading(self) -> bool:
        """Whether the scene is one of the two readings of the paper, on which every statement appears."""
        return self.name in READINGS

    @property
    def has_answer(self) -> bool:
        """Whether it could be told if the scene stick-slips."""
        return self.answer is not None and bool(self.answer["given"])

    @property
    def is_machine(self) -> bool:
        """Whether the scene has an answer and is no reading of the paper: its page shows the machine first."""
        return not self.is_reading and self.has_answer

    @property
    def shown_claims(self) -> list[Mapping[str, Any]]:
        """All statements on a reading of the paper; elsewhere those that are tested and not on the paper's numbers."""
        return [
            claim
            for claim in self.claims
            if self.is_reading or (claim["verdict"] != "not tested" and claim["id"] not in OF_ITS_NUMBERS)
        ]

    @property
    def warnings(self) -> Sequence[str]:
        """On the scene and of its stages; the last row of the costs holds them."""
        return self.costs[-1].get("warnings", ()) if self.costs else ()

    @property
    def curve_warnings(self) -> list[str]:
        """Those on a friction curve or a spring of another scene, which decide the answer."""
        return [text for text in self.warnings if text.startswith("oscillator.")]

    @property
    def other_warnings(self) -> list[str]:
        """All others."""
        return [text for text in self.warnings if not text.startswith("oscillator.")]


def page(scenes: Sequence[SceneReport], versions: Mapping[str, str], evidence: Evidence | None = None) -> str:
    """The page as HTML, with its pictures inside.

    versions : of the packages that made the results
    evidence : benchmarks and stress campaigns, on the joint page
    """
    readings = {scene.name: scene.claims for scene in scenes if scene.is_reading}
    shown = {name for scene in scenes for name in scene.figures}
    shown |= {"figure2", "figure3", "figure3_law", "figure5"} if readings else set()
    sections = [name for name in dict.fromkeys([*SECTIONS, *sorted(shown)]) if name in shown]
    is_machine = len(scenes) == 1 and scenes[0].is_machine
    opened = [name for name in sections if name in OPEN or not is_machine]
    template = environment().get_template("page.html.j2")
    return template.render(
        scenes=scenes,
        readings=readings,
        own=scenes[0] if is_machine else None,
        opened=opened,
        folded=[name for name in sections if name not in opened],
        answers=answers(readings),
        marks=MARKS,
        versions=versions,
        evidence=evidence or Evidence(),
    )


@cache
def environment() -> Environment:
    """The templates with their filters, compiled once in a process."""
    environment = Environment(
        loader=PackageLoader("roughslip.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {
        "digits": digits,
        "share": lambda row, costs: f"{100 * row['cpu_seconds'] / max(costs[-1]['cpu_seconds'], 1e-9):.3g}",
        "amount": amount,
        "bars": bars,
        "ends": lambda number, like: "" if None in number["interval"] else ends(number, like),
        "change_rows": change_rows,
        "curve": lambda scene: friction_curve(json.loads(scene.configuration)),
        "decision": decision,
        "facts": facts,
        "percent": percent,
        "plots": plots,
        "verdict": verdict,
        "counts": _counts,
        "verdicts": lambda claims: Counter(claim["verdict"] for claim in claims).most_common(),
        "stages_by_reason": _stages_by_reason,
        "section": section,
        "in_brackets": in_brackets,
        "number": our_number,
        "holding": holding,
        "by_chance": by_chance,
        "rows": rows,
        "element": element,
        "thumbnail": thumbnail,
    }
    return environment


def _counts(counts: Mapping[str, int]) -> str:
    """`80,400 convolutions, 3 field fits`, without zeros."""
    return ", ".join(f"{count:,} {name.replace('_', ' ')}" for name, count in counts.items() if count)


def _stages_by_reason(costs: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Stages that did not run, by the reason; the last row of the costs holds them."""
    reasons: dict[str, list[str]] = {}
    for stage, reason in (costs[-1].get("not_needed", {}) if costs else {}).items():
        reasons.setdefault(reason, []).append(stage)
    return reasons
