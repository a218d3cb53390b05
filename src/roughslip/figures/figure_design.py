"""The cheapest change of two or three parameters that keeps stick-slip rare, on maps of its probability."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from roughslip.figures.figure_map import LABELS, draw_probability
from roughslip.figures.style import Arrays, heads, panels, with_ends, with_interval_names

DRAWN = [
    *("design_own", "design_cheapest", "design_parameters", "design_limit"),
    *("design_map", "design_panel", "design_x", "design_y"),
    *with_interval_names("design_probability", "design_cost"),
]


def figure_design(result: Arrays) -> Figure:
    """A map for each value of the third parameter, with the scene, the cheapest point and the limit."""
    names, third = list(map(str, result["design_parameters"])), result["design_panel"]
    figure, axes = panels(len(third), 1, 5.2)
    every = np.atleast_1d(axes)
    for one, value, probability in zip(every, third, result["design_map"], strict=True):
        mesh = draw_probability(one, result["design_x"], result["design_y"], probability, names)
        _limit(one, result, probability)
        _points(one, result, value)
    figure.colorbar(mesh, ax=list(every), label="probability of stick-slip", shrink=0.9)
    found = "cheapest change: " + ", ".join(
        f"{title} {value:.2g} ({low:.2g} to {high:.2g})"
        for title, name in (("probability", "design_probability"), ("cost", "design_cost"))
        for value, low, high in [with_ends(result, name)]
    )
    figure.suptitle(found, x=0.02, ha="left", fontsize="medium")
    if len(names) > 2:
        heads(every, *(f"{LABELS[names[2]]} = {value:.3g}" for value in third))
    return figure


def _limit(axes: Axes, result: Arrays, probability: np.ndarray) -> None:
    limit = float(result["design_limit"])
    if probability.min() < limit < probability.max():
        x, y = result["design_x"], result["design_y"]
        axes.contour(x, y, probability.T, [limit], colors="white", linewidths=1.5)
        axes.plot([], [], color="white", lw=1.5, label=f"probability {limit:.3g}")


def _points(axes: Axes, result: Arrays, third: float) -> None:
    """The scene where its third parameter has the value of the panel, and the cheapest point in its panel."""
    own, cheapest = result["design_own"], result["design_cheapest"]
    if np.isnan(third) or np.isclose(third, own[2]):
        axes.plot(*own[:2], "*", color="C1", mec="white", ms=12, label="the scene", ls="none", clip_on=False)
    if np.isnan(third) or np.isclose(third, cheapest[2]):
        axes.plot(*cheapest[:2], "o", color="C2", mec="white", ms=8, label="cheapest change", ls="none", clip_on=False)
        label = ", ".join(f"{new / old - 1:+.1%}" for new, old in zip(cheapest, own, strict=True))
        x = result["design_x"]
        right = bool(cheapest[0] ** 2 > x[0] * x[-1])
        axes.annotate(
            label,
            (cheapest[0], cheapest[1]),
            xytext=(-8 if right else 8, 8),
            textcoords="offset points",
            ha="right" if right else "left",
            color="white",
            fontsize="small",
            path_effects=[withStroke(linewidth=2.0, foreground="0.2")],
        )
    axes.legend(loc="lower left", fontsize="small", frameon=True, facecolor="0.6", framealpha=0.9, handlelength=1.8)
