"""Figure 3 of several scenes in one picture: friction against penetration from both sources of pressure."""

from __future__ import annotations

from collections.abc import Mapping

import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughslip.figures.figure3 import DRAWN, PENETRATION
from roughslip.figures.style import Arrays, head, panels

COMPARED = [name for name in DRAWN["figure3"] if not name.startswith("fit")]
LOOKS = (("C0", "o"), ("C1", "s"), ("C2", "^"), ("C3", "D"), ("C4", "v"), ("C5", "P"))
MOST = len(LOOKS)
APART = 0.8  # per cent of penetration between the markers of two scenes, so that none hides another


def comparison(results: Mapping[str, Arrays]) -> Figure:
    """Mean and standard deviation of mu of up to MOST scenes, each by its name.

    A full marker with its interval is what was solved, an open one the expansion, the line with its band both together.
    """
    figure, axes = panels(2, 1, 4.6)
    for one, name, title in zip(axes, ("mean", "std"), ("mean", "standard deviation"), strict=True):
        for number, (scene, look) in enumerate(zip(results, LOOKS, strict=False)):
            _scene(one, results[scene], name, look, APART * (number - 0.5 * (len(results) - 1)))
        one.set(xlabel=PENETRATION, ylabel=f"{title} of $\\mu$", ylim=(0, None))
    lines = [
        Line2D([], [], color=colour, marker=marker, ms=5, label=scene)
        for scene, (colour, marker) in zip(results, LOOKS, strict=False)
    ]
    lines.append(Line2D([], [], color="0.3", marker="o", ms=5, ls="none", label="solved contact"))
    lines.append(Line2D([], [], color="0.3", marker="o", ms=5, mfc="white", ls="none", label="expansion"))
    lines.append(Line2D([], [], color="0.3", lw=1.5, label="expansion as control"))
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines))
    head(axes[0], "a", "mean friction coefficient")
    head(axes[1], "b", "standard deviation")
    sns.despine(figure)
    return figure


def _scene(axes: Axes, result: Arrays, name: str, look: tuple[str, str], shift: float) -> None:
    colour, marker = look
    percentile, sources = result["percentile"] + shift, [str(source) for source in result["source"]]
    axes.fill_between(
        percentile, result[f"combined_{name}_low"], result[f"combined_{name}_high"], color=colour, alpha=0.25, lw=0
    )
    axes.plot(percentile, result[f"combined_{name}"], color=colour, lw=1.5)
    for source, face in (("solved", colour), ("expansion", "white")):
        row = sources.index(source)
        axes.vlines(percentile, result[f"{name}_low"][row], result[f"{name}_high"][row], color=colour, lw=0.8)
        axes.plot(percentile, result[name][row], marker, color=colour, mfc=face, ms=4)
