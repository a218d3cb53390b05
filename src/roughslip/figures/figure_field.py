"""The figure of the whole square: statistics of the pressure at every node, and solved and expanded fields."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import Arrays, despine, draw_map, heads, panels, pressure_unit

MAPS = ("contact", "mean", "deviation")  # in the titles with their standard error, the median over the nodes
FIELDS = {"solved": "a solved field", "expected": "the same, as expected", "drawn": "the same, as drawn"}
DRAWN = {
    "figure_field": [
        *("x", "y", "missed", "leading_share", "sobol_first", "sobol_total", "sobol_first_error", "sobol_total_error"),
        *(name + end for name in MAPS for end in ("", "_error")),
        "mean_gain",
        *(f"{name}_pressure" for name in FIELDS),
    ]
}

SHOWN = 0  # of the stored fields


def figure_field(result: Arrays) -> Figure:
    """Maps of contact probability, mean and standard deviation; what the expansion explains; fields and modes."""
    figure, grid = panels(3, 3, 4.0)
    unit, name = pressure_unit(max(float(result[name].max()) for name in ("mean", "deviation")))
    labels = (100.0, "probability of contact [%]"), (unit, f"mean [{name}]"), (unit, f"standard deviation [{name}]")
    for axes, quantity, (factor, label) in zip(grid[0], MAPS, labels, strict=True):
        _map(axes, result, factor * result[quantity], label, "viridis")
    _map(grid[1, 0], result, result["mean_gain"], "times fewer solves for the mean", "cividis")
    _map(grid[1, 1], result, 100 * (1 - result["missed"]), "share of that of the pressure [%]", "cividis")
    _modes(grid[1, 2], result)
    fields = [result[f"{name}_pressure"][SHOWN] for name in FIELDS]
    peak = max(float(field.max()) for field in fields)
    unit, name = pressure_unit(peak)
    for axes, field in zip(grid[2], fields, strict=True):
        _map(axes, result, unit * np.maximum(field, 0.0), f"pressure [{name}]", "magma", (0.0, unit * peak))
    errors = [100 * float(np.median(result[f"{statistic}_error"] / result[statistic])) for statistic in MAPS]
    names = ("contact probability", "mean pressure", "standard deviation")
    heads(
        grid.ravel(),
        *(f"{statistic}, ±{error:.1f} %" for statistic, error in zip(names, errors, strict=True)),
        *("gain of the expansion", "variance explained", "modes of the variance"),
        *FIELDS.values(),
    )
    despine(grid[1, 2])
    return figure


def _map(
    axes: Axes,
    result: Arrays,
    values: np.ndarray,
    label: str,
    colours: str,
    limits: tuple[float, float] | None = None,
) -> None:
    """A map; without limits its colours leave out a hundredth of the nodes at either end, such as the corners."""
    ends = np.quantile(values, [0.01, 0.99]) if limits is None else limits
    image = draw_map(axes, result["x"], result["y"], values, colours, ends)
    assert axes.figure is not None
    axes.figure.colorbar(image, ax=axes, label=label, shrink=0.8, extend="both" if limits is None else "neither")


def _modes(axes: Axes, result: Arrays) -> None:
    """Sobol' indices of the modes, all nodes together, with two standard errors."""
    mode = np.arange(1, len(result["sobol_first"]) + 1)
    for name, colour, label in (("total", "C0", "with others"), ("first", "C1", "alone")):
        share, error = 100 * result[f"sobol_{name}"], 200 * result[f"sobol_{name}_error"]
        axes.fill_between(mode, share - error, share + error, color=colour, alpha=0.35, linewidth=0, step="mid")
        axes.step(mode, share, where="mid", color=colour, lw=1, label=label)
    top = 150 * float(result["sobol_total"].max())
    axes.set(xlabel="mode", ylabel="share of the variance [%]", xlim=(0.5, len(mode) + 0.5), ylim=(0, top))
    joint = 100 * result["leading_share"]
    title = f"leading modes together:\n{joint.min():.1f} to {joint.max():.1f} % at a node"
    axes.legend(loc="upper right", fontsize="small", title=title, title_fontsize="small")
