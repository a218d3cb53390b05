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

CAPTIONS = {
    "figure_scan": "A scan, and surfaces sampled from the models fitted to it: map of the scan and of one sampled "
    "surface, density of heights, autocorrelation, radially averaged power spectrum. Numbers are in units of the half "
    "width of the scan's 95 % intervals. Bands around the scan are those intervals. Bands of the sampled surfaces "
    "reach from the least to the largest of them.",
    "figure_field": "The pressure at every node of the square. Contact probability, mean and standard deviation are "
    "those of solved surfaces with the expansion as control variate: what it misses widens their errors and biases "
    "nothing. In the titles: their standard error, as the median over the nodes. Gain: variance of the mean pressure "
    "from the solves alone, divided by that with the expansion. Modes: their Sobol' indices for the expected pressure, "
    "all nodes together, with two standard errors. Below: a solved field, the expectation at the same variables by an "
    "expansion fitted without it, and a field drawn with the residual scatter.",
    "figure_map": "Where stick-slip occurs. (a) Its probability, the share of stick-slip in the second half of runs "
    "from rest on the belt, with the deterministic limits. (b) How long it survives at the damping ratios named, by "
    "the estimate of Kaplan and Meier. (c) Mean lifetime of stick-slip, and of steady sliding until the mass sticks; "
    "exponential, censored at the end of the runs. (d) The damping ratio at which stick-slip has the probability of "
    "one half, and the band from 0.1 to 0.9, by how the runs begin. Where the two bands differ, both motions last "
    "longer than the runs. Bands around lines are 95 % intervals.",
    "figure2": "Figure 2. Pressure at the centre of the square: Monte Carlo, Latin hypercube, the two polynomial chaos "
    "variants of the paper, and the expansion that uses every sample. Bands are 95 % intervals of sampling, and for "
    "an expansion of its fit. They do not include the truncation of its series.",
    "figure3": "Figure 3. Friction coefficient of the test surface against penetration, from solved contact, from the "
    "expansion, and from solved contact with the expansion as control variate. The curve through the last is mu_fit.",
    "figure3_law": "The distribution of the friction coefficient. Autocorrelation, with that of windows of white "
    "pressure measured the same way, which is the window's own part. Exponential lengths. The standardised "
    "distribution at median penetration. Distances of the windows from families of distributions; skewness and excess "
    "kurtosis.",
    "figure5": "Figure 5. Stick-slip limit cycle with and without scatter, the point where the mass sticks again, and "
    "the cycles lost to the scatter against damping.",
    "comparison": "Friction coefficient of several scenes against penetration, mean and standard deviation, from "
    "solved contact, from the expansion, and from both.",
}


@dataclass(frozen=True)
class SceneReport:
    """What the page shows of a scene.

    name, description : of the scene
    figures : PNG bytes by the name of the figure
    surfaces : how the surface behind a figure is represented and why, in sentences, by the name of the figure
    claims, costs : contents of claims.json and costs.json
    configuration : what the stages read of the scene
    """

    name: str
    description: str
    figures: Mapping[str, bytes]
    surfaces: Mapping[str, Sequence[str]]
    claims: Sequence[Mapping[str, Any]]
    costs: Sequence[Mapping[str, Any]]
    configuration: str

    def caption(self, figure: str) -> str:
        """Caption of a figure, with the representation of its surface."""
        return " ".join((CAPTIONS[figure], *self.surfaces.get(figure, ())))


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
