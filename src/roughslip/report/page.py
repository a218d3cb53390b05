"""One page, readable without a network, of what scenes found: figures, verdicts, costs and how to repeat the run."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from roughslip.report.evidence import Evidence
from roughslip.report.sensitivity_table import legend, sensitivity_line


@dataclass(frozen=True)
class SceneReport:
    """What the page shows of a scene.

    name, description : of the scene
    figures : PNG bytes by the name of the figure
    captions : by the name of the figure
    surfaces : how the surface behind a figure is represented and why, in sentences, by the name of the figure
    claims, costs : contents of claims.json and costs.json
    configuration : what the stages read of the scene
    """

    name: str
    description: str
    figures: Mapping[str, bytes]
    captions: Mapping[str, str]
    surfaces: Mapping[str, Sequence[str]]
    claims: Sequence[Mapping[str, Any]]
    costs: Sequence[Mapping[str, Any]]
    configuration: str

    def caption(self, figure: str) -> str:
        """Caption of a figure, with the representation of its surface."""
        return " ".join((self.captions[figure], *self.surfaces.get(figure, ())))


def page(scenes: Sequence[SceneReport], versions: Mapping[str, str], evidence: Evidence | None = None) -> str:
    """The page as HTML, with its pictures inside.

    versions : of the packages that made the results
    evidence : benchmarks and stress campaigns, on the joint page
    """
    environment = Environment(
        loader=PackageLoader("roughslip.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {
        "base64": lambda content: base64.b64encode(content).decode(),
        "digits": lambda number, digits: f"{number:.{digits}g}",
        "grouped": lambda number: f"{number:,.3g}",
        "counts": _counts,
        "verdicts": lambda claims: Counter(claim["verdict"] for claim in claims).most_common(),
        "stages_by_reason": _stages_by_reason,
        "sensitivity_legend": legend,
        "sensitivity_line": sensitivity_line,
    }
    template = environment.get_template("page.html.j2")
    return template.render(scenes=scenes, versions=versions, evidence=evidence or Evidence())


def _counts(counts: Mapping[str, int]) -> str:
    """`80,400 convolutions, 3 field fits`, without zeros."""
    return ", ".join(f"{count:,} {name.replace('_', ' ')}" for name, count in counts.items() if count)


def _stages_by_reason(costs: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Stages that did not run, by the reason; the last row of the costs holds them."""
    reasons: dict[str, list[str]] = {}
    for stage, reason in (costs[-1].get("not_needed", {}) if costs else {}).items():
        reasons.setdefault(reason, []).append(stage)
    return reasons
