"""What part each source of uncertainty has: in whether it stick-slips, and in the limits of the cycle."""

from __future__ import annotations

import numpy as np
import seaborn as sns
from matplotlib.figure import Figure

from roughslip.figures.style import Shown, heads, panels, with_ends

TITLES = {
    "damping": "limit in damping",
    "belt_velocity": "limit in belt velocity",
    "mass": "limit in mass",
    "stiffness": "limit in stiffness",
    "load": "limit in normal force",
    "death": "rate of its end",
    "birth": "rate of its beginning",
}


def figure_budget(result: Shown) -> Figure:
    """Bars by source: of the variance of the outcome, then Sobol' indices of each limit and rate."""
    limits = [str(name) for name in result["result_name"].values[1:]]
    figure, axes = panels(1 + len(limits), 1, max(2.6, 5.2 / (1 + len(limits))))
    sources, rows = [str(name) for name in result["source_name"].values], np.arange(len(result["source_name"]))
    outcome, *others = np.atleast_1d(axes)
    outcome.barh(rows, result["outcome"], color="C0")
    outcome.barh(len(rows), float(result["outcome_scatter"]), color="C7")
    outcome.set_yticks(np.arange(len(rows) + 1), [*sources, "scatter of friction"])
    outcome.set(xlabel="share of the variance")
    for place, panel in enumerate(others, start=1):
        total, (first, low, high) = result["total"][place], [end[place] for end in with_ends(result, "first")]
        panel.barh(rows, np.clip(total, 0.0, None), height=0.8, color="C9", label="total")
        panel.barh(rows, np.clip(first, 0.0, None), height=0.45, color="C0", label="first")
        panel.hlines(rows, np.clip(low, 0.0, None), np.clip(high, 0.0, None), color=".15", lw=1.2)
        panel.set_yticks(rows, [""] * len(rows))
        panel.set(xlabel="Sobol' index")
    for panel in (outcome, *others):
        panel.set(xlim=(0.0, 1.05), xticks=(0.0, 0.5, 1.0), ylim=(len(rows) + 0.6, -0.6))
    if others:
        others[-1].legend(loc="lower right")
    mean = 100.0 * float(result["averaged_probability"])
    heads((outcome, *others), f"stick-slip or not ({mean:.0f} %)", *(TITLES[name] for name in limits))
    sns.despine(figure)
    return figure
