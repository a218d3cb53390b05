"""Friction of a pad against its load: real area, mean, scatter, and windows without contact."""

from __future__ import annotations

import seaborn as sns
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from roughslip.figures.style import (
    Shown,
    draw_curve,
    heads,
    panels,
    pressure_unit,
    with_ends,
)

PANELS = {
    "real_area": ("real area over apparent area", "real area of contact"),
    "mean": ("mean of $\\mu$", "mean friction coefficient"),
    "variation": ("standard deviation over mean", "scatter of the pad"),
    "no_contact": ("share of windows", "windows without contact"),
}
OVER = "over_loads_"


def friction_against_load(result: Shown) -> Figure:
    """Four panels over the nominal pressure, on a logarithmic axis; the scene's load is a line in each."""
    figure, axes = panels(4, 1, 3.4)
    own = float(result["nominal_pressure"])
    factor, unit = pressure_unit(own)
    pressures = factor * result[f"{OVER}nominal_pressure"]
    for panel, (name, (label, _)) in zip(axes, PANELS.items(), strict=True):
        ends = with_ends(result, f"{OVER}{name}")
        draw_curve(panel, pressures, ends, {"color": "C0", "marker": "o", "ms": 4})
        panel.axvline(factor * own, color="C3", ls="--", lw=1.2, label="load of the scene")
        panel.set(xscale="log", xlabel=f"nominal pressure [{unit}]", ylabel=label)
        panel.set_xticks(pressures, [f"{pressure:.2g}" for pressure in pressures.values])  # those of the points alone
        panel.xaxis.set_minor_locator(NullLocator())
        if name in ("real_area", "variation"):
            panel.set_yscale("log")
        else:
            panel.set_ylim(0, 1.0 if name == "no_contact" else None)
    axes[0].legend(loc="lower right", fontsize="small", frameon=True)
    heads(axes, *(title for _, title in PANELS.values()))
    sns.despine(figure)
    return figure
