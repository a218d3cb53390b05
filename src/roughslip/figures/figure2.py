"""Figure 2: distribution of the pressure at the centre of the square, by Monte Carlo and by expansions."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import (
    Arrays,
    despine,
    draw_curve,
    heads,
    panels,
    pressure_unit,
    with_ends,
    with_interval_names,
)

DRAWN = ["method", "pressure", "distance_in_contact", *with_interval_names("cumulative", "contact_probability")]

METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "monte_carlo": ("Monte Carlo (MCS)", {"color": "0.15", "linestyle": "-", "linewidth": 2.2}),
    "latin_hypercube": ("Latin hypercube (LHS)", {"color": "C0", "linestyle": ":", "linewidth": 1.8}),
    "equation_8": ("PC, eq. (8)", {"color": "C1", "linestyle": "--"}),
    "equation_9": ("PC, eq. (9)", {"color": "C3", "linestyle": "-."}),
    "roughslip": ("PC, all samples", {"color": "C2", "linestyle": "-", "linewidth": 1.2}),
}
"""Label and look of each method of sampling or expansion; they differ in line style as well as in colour."""


def figure2(result: Arrays) -> Figure:
    """The paper's panel is (a), the distribution given contact; then the same on logarithms, and who is in contact."""
    figure, (linear, logarithmic, probability) = panels(3, 1, 4.0)
    unit, name = pressure_unit(result["pressure"].max())
    pressure = unit * result["pressure"]
    methods = [str(method) for method in result["method"]]
    for row, method in enumerate(methods):
        label, look = METHODS[method]
        for axes, floor in ((linear, 0.0), (logarithmic, 1e-9)):
            value, *ends = with_ends(result, "cumulative", row)
            shown = [np.where(value > floor, value, np.nan), *(np.maximum(end, floor) for end in ends)]
            draw_curve(axes, pressure, shown, look | {"label": label}, alpha=0.15)
        _contact(probability, result, row, look["color"], annotated=method != "monte_carlo")
    linear.set(xlabel=f"pressure at the centre [{name}]", ylabel="cumulative probability", ylim=(0, 1))
    nearly_all = int(np.searchsorted(result["cumulative"][methods.index("monte_carlo")], 0.999))
    linear.set_xlim(0, pressure[min(nearly_all, len(pressure) - 1)])
    logarithmic.set(xscale="log", yscale="log", ylim=(1e-4, 1.2), xlabel=f"pressure at the centre [{name}]")
    logarithmic.set(xlim=(pressure[0], pressure[-1]), ylabel="cumulative probability")
    probability.set(xlabel="probability of contact [%]", ylim=(0.4 - len(methods), 0.7))
    probability.set_yticks(-np.arange(len(methods)), [METHODS[method][0] for method in methods])
    probability.margins(x=0.3)
    figure.legend(*linear.get_legend_handles_labels(), loc="outside lower center", ncols=len(methods))
    heads(figure.axes, "distribution given contact", "low probabilities", "contact, and distance to solves")
    despine(*figure.axes)
    return figure


def _contact(axes: Axes, result: Arrays, row: int, colour: str, annotated: bool) -> None:
    share, low, high = with_ends(result, "contact_probability", row, 100.0)
    axes.plot([low, high], [-row, -row], "|-", color=colour)
    axes.plot(share, -row, "o", color=colour)
    if annotated:
        distance = float(result["distance_in_contact"][row])
        text = f"distance {distance:.3f}" if np.isfinite(distance) else "fit refused"
        axes.annotate(text, (share, -row), xytext=(0, 7), textcoords="offset points", ha="center", fontsize="small")
