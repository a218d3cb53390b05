"""How long stick-slip and steady sliding last near the limits, and what share of the time is stick-slip."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import (
    Arrays,
    despine,
    draw_points,
    heads,
    legend_above,
    panels,
    with_ends,
    with_interval_names,
)

STATES = ("stick_slip", "sliding", "share")
DRAWN = {
    "figure_residence": [
        *("friction_deviation", "residence_damping", "residence_limit", "residence_hopf"),
        *with_interval_names(*STATES),
        *(f"{name}_by_theory" for name in STATES),
    ]
}


def figure_residence(result: Arrays) -> Figure:
    """Mean durations of both states, and the share of stick-slip, against damping at every scatter."""
    figure, (stick_slip, sliding, share) = panels(3, 1, 5.2)
    for axes, name in ((stick_slip, "stick_slip"), (sliding, "sliding"), (share, "share")):
        _state(axes, result, name)
    for axes in (stick_slip, sliding):
        axes.set(yscale="log", ylabel="natural periods")
    share.set(ylim=(-0.02, 1.02), ylabel="share of the time")
    legend_above(share, columns=2)
    heads(
        (stick_slip, sliding, share),
        *("mean duration of stick-slip", "mean duration of steady sliding", "stick-slip"),
    )
    despine(stick_slip, sliding, share)
    return figure


def _state(axes: Axes, result: Arrays, name: str) -> None:
    for row, deviation in enumerate(result["friction_deviation"]):
        damping, colour = result["residence_damping"][row], f"C{row}"
        ends = with_ends(result, name, row)
        known = np.isfinite(ends).all(axis=0)
        draw_points(axes, damping[known], [end[known] for end in ends], {"color": colour, "marker": "o", "ms": 3.5})
        axes.plot(damping, result[f"{name}_by_theory"][row], lw=1.2, color=colour, label=f"std {deviation:.3g}")
    axes.set(xlabel="damping ratio $D$")
    for limit, style, label in (("hopf", "--", "sliding unstable below"), ("limit", "-", "cycle exists below")):
        axes.axvline(float(result[f"residence_{limit}"]), color="0.3", lw=0.9, ls=style, label=label)
