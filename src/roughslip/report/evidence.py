"""What the joint page shows of benchmarks and stress campaigns, as git keeps them: how fast, how sure.

None of it is of a scene alone, and none is made anew by a run of the study, since that would take hours.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

from roughslip.report.table import table

BUDGET = "chain"  # the benchmark that tells where errors come from
MEASURED = {
    "surface": "Surfaces: error of the covariance against the time of a sample, and the leading modes.",
    "contact": "Contact: independent residual of the complementarity conditions against time, by mesh and roughness.",
    "chaos": "Pressure at the centre: distance of the distribution from its Monte Carlo reference against contact "
    "solves and against seconds; sparse expansions of functions; multilevel Monte Carlo.",
    "friction": "Friction paths: error of the autocorrelation against the time of the paths, and points a second.",
    "oscillator": "Oscillator: error of the point where the mass sticks again against time, and cycles a second.",
    "skips": "What is not computed: the time with everything computed over the time as it is, and how far the two "
    "results are apart beside the tolerance; at the edge where they are the same to the bit.",
    BUDGET: "What each source leaves in every number of the figures, the others as the scene has them; to the right of "
    "each mark two standard errors of it. Varied with common random numbers; errors of mesh and path nodes are twice "
    "their change on halving, as of first order. Numbers in units of the mean friction coefficient at median "
    "penetration; cycles by damping ratio.",
}


@dataclass(frozen=True)
class Evidence:
    """What is kept of benchmarks and stress.

    pictures : PNG bytes by benchmark
    budget : of every number in the figures, by the name of its case, value, error and largest source
    cost : of the chain beside the plain way at the same error: stages, and scenes with all of them
    stress : rows with stage, problems, outcomes, worst residual over tolerance
    machine : on which the benchmarks ran, by benchmark
    """

    pictures: Mapping[str, bytes] = field(default_factory=dict)
    budget: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    cost: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    stress: Sequence[Mapping[str, Any]] = ()
    machine: Mapping[str, str] = field(default_factory=dict)


def evidence_section(evidence: Evidence) -> str:
    """HTML of what there is, nothing where there is nothing."""
    parts = []
    if BUDGET in evidence.pictures:
        parts.append('<h2 id="budget">Where the errors come from</h2>')
        parts.append(_picture(BUDGET, evidence) + _budget(evidence.budget))
    if evidence.cost:
        parts.append('<h2 id="cost">What the same error costs the plain way</h2>')
        parts.append(_cost(evidence.cost))
    measured = [name for name in MEASURED if name in evidence.pictures and name != BUDGET]
    if measured:
        parts.append('<h2 id="speed">Run time against error</h2>')
        parts += [_picture(name, evidence) for name in measured]
    if evidence.stress:
        parts.append('<h2 id="stress">Hard and wrong problems</h2>')
        parts.append(_stress(evidence.stress))
    return "\n".join(parts)


def _picture(name: str, evidence: Evidence) -> str:
    content = base64.b64encode(evidence.pictures[name]).decode()
    machine = f" Measured on: {evidence.machine[name]}." if name in evidence.machine else ""
    return (
        f'<figure><div class="wide"><img alt="Benchmark {escape(name)}" src="data:image/png;base64,{content}"></div>'
        f"<figcaption>{escape(MEASURED[name] + machine)} Again with: <code>make benchmark</code>.</figcaption></figure>"
    )


def _budget(budget: Mapping[str, Mapping[str, Any]]) -> str:
    rows = []
    for case, number in budget.items():
        names = dict(pair.split("=", 1) for pair in case.split(" "))
        rows.append(
            (
                ("", escape(names["scene"])),
                ("", escape(names["number"].replace("_", " "))),
                ("number", f"{number['value']:.4g}"),
                ("number", f"{100 * number['error']:.2g}"),
                ("", escape(str(number["largest"]))),
            )
        )
    return table(("Scene", "Number", "Value", "Error [%]", "Most of it from"), rows)


def _cost(cost: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    rows = []
    for one in cost["stages"]:
        ours, plain = one["ours"], one["plain"]
        ratios = one["ratio"], one["ratio_at_the_tolerance_asked"]
        numbers = (ours["units"], ours["seconds"], plain["units"], plain["seconds"], *ratios)
        texts = (("", escape(one["scene"])), ("", escape(one["stage"])), ("", escape(one["unit"])))
        rows.append((*texts, *(("number", f"{number:,.3g}") for number in numbers), ("note", escape(one["how"]))))
    for one in cost["chain"]:
        texts = (("", escape(one["scene"])), ("", "all"), ("", ""))
        both = (f"{one[name]:,.3g}" for name in ("ratio", "ratio_at_the_tolerance_asked"))
        cells = ("", f"{one['ours_seconds']:,.3g}", "", f"{one['plain_seconds']:,.3g}", *both)
        rows.append((*texts, *(("number", cell) for cell in cells), ("", "")))
    sides = ("Ours", "CPU [s]", "Plain", "CPU [s]")
    heads = ("Scene", "Stage", "Unit", *sides, "Ratio", "Ratio, scipy as asked", "How it was counted")
    text = (
        "Each stage as textbooks have it, at the error of ours: seconds of a unit of work, measured on short samples, "
        "times the units that it takes, extrapolated in proportion; of motions also at scipy's own idea of the "
        "tolerance. Again with: <code>make benchmark</code>."
    )
    return f"<p>{text}</p>" + table(heads, rows)


def _stress(stress: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for row in stress:
        outcomes = ", ".join(f"{count:,} {escape(name)}" for name, count in row["outcomes"].items())
        worst = row["worst_residual_over_tolerance"]
        rows.append(
            (
                ("", escape(row["stage"])),
                ("number", f"{row['problems']:,}"),
                ("", outcomes),
                ("number", "" if worst is None else f"{worst:.2g}"),
            )
        )
    text = (
        "Random problems, some without a solution, some that no user would pose: each ends in an answer that is judged "
        "apart from the code that gave it, or in an error that says what to try. Again, or with other problems: "
        "<code>make stress SEED=today</code>."
    )
    return f"<p>{text}</p>" + table(("Stage", "Problems", "Outcomes", "Largest residual over its tolerance"), rows)
