"""One page, without a network, that shows what scenes found: figures, verdicts, costs and how to make it again."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from roughslip.report.evidence import Evidence, evidence_section
from roughslip.report.sensitivity_table import legend, standing_line
from roughslip.report.table import table

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 62rem; margin: 0 auto; padding: 1rem; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
figure { margin: 1.5rem 0; } img { width: 100%; min-width: 44rem; height: auto; display: block; }
figcaption { color: #555; font-size: .9rem; }
.wide, pre { overflow-x: auto; } pre { background: #f5f5f5; padding: .7rem; }
table { border-collapse: collapse; font-size: .85rem; width: 100%; }
th, td { text-align: left; vertical-align: top; padding: .3rem .6rem .3rem 0; border-bottom: 1px solid #ddd; }
td.number { white-space: nowrap; text-align: right; } td.note::first-letter { text-transform: uppercase; }
.verdict { white-space: nowrap; font-weight: 600; } .reproduced { color: #0b6e3b; } .not-reproduced { color: #a12; }
.contradicts-itself { color: #8a5a00; } .not-tested { color: #666; font-weight: 400; }
@media (max-width: 50rem) {
  table, tbody, tr, td { display: block; } thead, td:empty { display: none; }
  tr { padding: .5rem 0; border-bottom: 1px solid #bbb; } td, td.number { border: 0; padding: 0; text-align: left; }
  td::before { content: attr(data-head) ": "; color: #666; font-weight: 400; }
}
@media print {
  body { max-width: none; } h2 { break-before: page; } figure, tr { break-inside: avoid; } img { min-width: 0; }
}
"""

CAPTIONS = {
    "figure_scan": "The scan beside surfaces sampled from the models fitted to it: map of the scan and of one twin, "
    "density of heights, autocorrelation, radially averaged power spectrum, and numbers in units of the half width of "
    "the scan's 95 % intervals. Bands around the scan are those intervals; bands of the twins go from the least to the "
    "largest of them.",
    "figure_field": "The pressure at every node of the square. Contact probability, mean and standard deviation are "
    "those of solved surfaces with the expansion as control variate: what it misses widens their errors and biases "
    "nothing. In the titles: their standard error, as the median over the nodes. Gain: variance of the mean pressure "
    "from the solves alone, over that with the expansion. Modes: their Sobol' "
    "indices for the expected pressure, all nodes together, with two standard errors. Below, a solved field, what the "
    "expansion expects at the same variables though it has not seen it, and a field drawn with the scatter that it "
    "leaves.",
    "figure_map": "Where stick-slip lives. (a) Its probability, the share of stick-slip in the second half of runs "
    "from rest on the belt, with the deterministic limits. (b) How long it survives, at the damping ratios named, by "
    "Kaplan and Meier. (c) Mean lifetime of stick-slip, and of steady sliding until the mass sticks; exponential, "
    "censored at the end of the runs. (d) The damping ratio at which stick-slip has the probability of one half, and "
    "the band from 0.1 to 0.9, by how the runs begin: where the two bands lie apart both motions last longer than the "
    "runs. Bands around lines are 95 % intervals.",
    "figure2": "Figure 2. Pressure at the centre of the square: Monte Carlo, Latin hypercube, the two polynomial chaos "
    "variants of the paper, and the expansion that uses every sample. Bands are 95 % intervals, of sampling, and for "
    "an expansion of its fit, not of the truncation of its series.",
    "figure3": "Figure 3. Friction coefficient of the test surface against penetration, from solved contact, from the "
    "expansion, and from solved contact with the expansion as control variate. The curve through the last is mu_fit.",
    "figure3_law": "The law of the friction coefficient. Autocorrelation beside that of windows of white pressure, "
    "measured the same way, which is the window's own part; exponential lengths; the marginal at median penetration, "
    "less its mean and over its standard deviation; distances of the windows from families of laws; skewness and "
    "excess kurtosis.",
    "figure5": "Figure 5. Stick-slip limit cycle with and without scatter, the point where the mass sticks again, and "
    "the cycles lost to the scatter against damping.",
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


def page(scenes: Sequence[SceneReport], versions: Mapping[str, str], evidence: Evidence | None = None) -> str:
    """The page as HTML, with its pictures inside."""
    shown = "" if evidence is None else evidence_section(evidence)
    names = " ".join(scene.name for scene in scenes)
    links = ", ".join(f'<a href="#{escape(scene.name)}">{escape(scene.name)}</a>' for scene in scenes)
    body = "".join(_scene(scene) for scene in scenes)
    packages = ", ".join(f"{escape(name)} {escape(number)}" for name, number in versions.items())
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>roughslip: {escape(names)}</title><style>{STYLE}</style></head><body>
<h1>How surface roughness makes friction scatter, and what the scatter does to stick-slip vibration</h1>
<p>Random rough surfaces, elastic half-space contact, polynomial chaos of the contact pressure, Bowden-Tabor friction on
sliding windows as a stochastic process, a mass on a belt. The study reproduces Figures 2, 3 and 5 of <em>Modelling of
dynamical systems with friction between randomly rough surfaces</em> and gives a verdict on each of its statements.
Scenes: {links}.</p>
{body}
{shown}
<h2>How to make this again</h2>
<pre>make reproduce            # sets up the environment and runs the default scenes
snakemake -j2 {escape(names)}   # with the packages installed</pre>
<p>Made with {packages}.</p>
</body></html>
"""


def _scene(scene: SceneReport) -> str:
    pictures = "".join(
        f'<figure><div class="wide"><img alt="{escape(name)} of the scene {escape(scene.name)}" '
        f'src="data:image/png;base64,{base64.b64encode(content).decode()}"></div>'
        f"<figcaption>{escape(' '.join((CAPTIONS[name], *scene.surfaces.get(name, ()))))}</figcaption></figure>"
        for name, content in scene.figures.items()
    )
    return f"""<h2 id="{escape(scene.name)}">Scene {escape(scene.name)}</h2>
<p>{escape(scene.description.rstrip("."))}.</p>
{pictures}
<h3>The paper's statements</h3>
{_claims(scene)}
<h3>What it cost</h3>
{_costs(scene.costs)}
<details><summary>Configuration that the stages read</summary><pre>{escape(scene.configuration)}</pre></details>
"""


def _claims(scene: SceneReport) -> str:
    claims = scene.claims
    verdicts = Counter(str(claim["verdict"]) for claim in claims)
    counts = ", ".join(f"{count} {escape(verdict)}" for verdict, count in verdicts.most_common())
    rows = []
    for claim in claims:
        verdict = str(claim["verdict"])
        rows.append(
            (
                ("", f'<span id="{escape(scene.name)}-{escape(claim["id"])}">{escape(claim["statement"])}</span>'),
                ("", escape(claim["paper"])),
                ("number", "" if claim["ours"] is None else f"{claim['ours']:.3g}"),
                ("number", "" if claim["interval"] is None else " to ".join(f"{end:.3g}" for end in claim["interval"])),
                (f"verdict {verdict.replace(' ', '-')}", escape(verdict)),
                ("note", _note(claim, claims)),
            )
        )
    heads = ("Statement", "Paper", "Ours", "95 % interval", "Verdict", "Note")
    how_far = escape(legend(claims, scene.name))
    return f"<p>{len(claims)} statements: {counts}. {how_far}.</p>{table(heads, rows)}"


def _note(claim: Mapping[str, Any], claims: Sequence[Mapping[str, Any]]) -> str:
    """What the number is, the rule of the verdict, and how far it stands."""
    stands = standing_line(claim, claims)
    told = f" {escape(stands)}." if stands else ""
    return f"{escape(claim['note'])}. <em>Rule: {escape(claim['rule'])}.</em>{told}"


def _costs(costs: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for row in costs:
        did = ", ".join(f"{count:,} {escape(name.replace('_', ' '))}" for name, count in row["did"].items())
        skipped = ", ".join(f"{count:,} {escape(name)}" for name, count in row.get("skipped", {}).items() if count)
        peak = "" if row["peak_memory_mib"] is None else f"{row['peak_memory_mib']:.0f}"
        numbers = (str(row["jobs"]), f"{row['cpu_seconds']:.1f}", f"{100 * row['core_share']:.0f}", peak)
        rows.append(
            (
                ("", escape(row["stage"])),
                *(("number", number) for number in numbers),
                ("", "" if row["stage"] == "all" else did),
                ("", "" if row["stage"] == "all" else skipped),
            )
        )
    heads = (
        "Stage",
        "Jobs",
        "CPU [s]",
        "Solving, fitting, integrating [%]",
        "Peak memory [MiB]",
        "Did",
        "Did not, and why",
    )
    return table(heads, rows) + _spared(costs)


def _spared(costs: Sequence[Mapping[str, Any]]) -> str:
    """Stages that did not run, by the reason."""
    reasons: dict[str, list[str]] = {}
    for stage, reason in (costs[-1].get("not_needed", {}) if costs else {}).items():
        reasons.setdefault(reason, []).append(stage)
    told = "; ".join(f"{escape(', '.join(stages))} ({escape(reason)})" for reason, stages in reasons.items())
    return f"<p>Stages that did not run: {told}.</p>" if told else ""
