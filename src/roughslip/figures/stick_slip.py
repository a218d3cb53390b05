"""Stick-slip over two parameters, and what part each source of uncertainty has in it and in its limits."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from roughslip.figures.style import Shown, heads, panels, with_ends

OUTLINE = (withStroke(linewidth=2.6, foreground="white"),)
LABELS = {
    "damping": "damping ratio $D$",
    "belt_velocity": "belt velocity $v_0$ [m/s]",
    "mass": "mass $m$ [kg]",
    "stiffness": "stiffness $k$ [N/m]",
    "load": "normal force $N$ [N]",
    "windows": "windows in parallel $n$",
    "correlation_length": "correlation length of friction [m]",
    "mean_friction": "mean friction coefficient",
}
TITLES = {"load": "limit in normal force", "vibration": "end of vibration in $D$"}  # others have the parameter's name
LEVELS = {0.05: ":", 0.5: "-", 0.95: ":"}


def figure_map(result: Shown) -> Figure:
    """The map with its levels, the area of vibration, limits without scatter, and the scene."""
    figure, _ = panels(1, 1, 6.2)
    figure.set_figheight(4.2)  # with a legend below
    axes = figure.axes[0]
    x, y, probability = (result[name].values for name in ("map_x", "map_y", "probability"))
    names = list(map(str, result["map_parameters"].values))
    mesh = axes.pcolormesh(x, y, probability.T, cmap="cividis", vmin=0, vmax=1, shading="nearest", rasterized=True)
    axes.set(xlabel=LABELS[names[0]], ylabel=LABELS[names[1]])
    for values, scale, axis in ((x, axes.set_xscale, axes.xaxis), (y, axes.set_yscale, axes.yaxis)):
        if values[0] > 0.0:
            scale("log")
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_minor_formatter(NullFormatter())
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    figure.colorbar(mesh, ax=axes, label="probability of stick-slip", shrink=0.9)
    low, high = float(probability.min()), float(probability.max())
    for level, style in LEVELS.items():
        if low < level < high:
            axes.contour(x, y, probability.T, [level], colors="white", linewidths=0.8, linestyles=style)
    handles = vibration_area(axes, x, y, result["vibration"].values)
    at = np.nonzero(result["is_computed"])
    axes.plot(x[at[0]], y[at[1]], "o", mfc="white", mec="0.2", mew=0.4, ms=2.6)
    for name, style, label in (
        ("existence_limit", "-", "cycle exists, left of it"),
        ("hopf_damping", "--", "sliding unstable, left of it"),
        ("vibration_limit", "-.", "vibrates or sticks, left of it"),
    ):
        if np.isfinite(result[name]).any():
            axes.plot(result[name], y, color="0.05", lw=1.3, ls=style, label=label, path_effects=OUTLINE)
    own = [float(result[f"map_{name}_own"]) or float(values[0]) for name, values in (("x", x), ("y", y))]  # 0: its edge
    if all(values[0] <= value <= values[-1] for value, values in zip(own, (x, y), strict=True)):
        axes.plot(*own, "*", color="C1", mec="white", ms=12, label="the scene", clip_on=False, ls="none")
    shown = [*axes.get_legend_handles_labels()[0], *handles]
    figure.legend(handles=shown, loc="outside lower center", ncols=2, fontsize="small", handlelength=1.8)
    axes.set_title(
        f"probability of stick-slip, {int(result['map_runs'])} runs at each dot", loc="left", fontsize="medium"
    )
    return figure


def vibration_area(axes: Axes, x: np.ndarray, y: np.ndarray, vibration: np.ndarray) -> list[Patch]:
    """Hatch where the motion without scatter vibrates and does not stick; what the legend shows of it."""
    if not vibration.max() > 0.5:
        return []
    axes.contourf(x, y, vibration.T, [0.5, 1.01], colors="none", hatches=["///"])
    axes.contour(x, y, vibration.T, [0.5], colors="white", linewidths=0.8)
    return [Patch(facecolor="#00224e", edgecolor="white", hatch="///", label="vibrates without sticking")]


def figure_budget(result: Shown) -> Figure:
    """Bars by source: of the variance of the outcome, then Sobol' indices of each limit.

    An estimate below 0 or above 1, or a first index above the total one, is drawn at the nearest that can be.
    """
    limits = [str(name) for name in result["result_name"].values[1:]]
    columns = 2 if len(limits) == 3 else min(3, 1 + len(limits))
    figure, axes = panels(columns, -(-(1 + len(limits)) // columns), 3.6)
    sources, rows = [str(name) for name in result["source_name"].values], np.arange(len(result["source_name"]))
    outcome, *others = np.ravel(axes)
    outcome.barh(rows, result["outcome"], color="C0")
    outcome.hlines(rows, result["outcome_low"], result["outcome_high"], color=".15", lw=1.2)
    outcome.barh(len(rows), float(result["outcome_scatter"]), color="C7")
    outcome.set(xlabel="share of the variance")
    for panel in others[len(limits) :]:
        panel.remove()
    for place, panel in enumerate(others[: len(limits)], start=1):
        total, *first = (np.clip(end[place], 0.0, 1.0) for end in (result["total"], *with_ends(result, "first")))
        panel.barh(rows, total, height=0.8, color="C9", label="total index")
        panel.barh(rows, np.minimum(first[0], total), height=0.45, color="C0", label="first index (95 %)")
        panel.hlines(rows, *first[1:], color=".15", lw=1.2)
        panel.set(xlabel="Sobol' index")
    for place, panel in enumerate(figure.axes):
        names = [*sources, "scatter of friction"] if place % columns == 0 else [""] * (len(rows) + 1)
        panel.set_yticks(np.arange(len(rows) + 1), names)
        panel.set(xlim=(0.0, 1.02), xticks=(0.0, 0.5, 1.0), ylim=(len(rows) + 0.6, -0.6))
    if limits:
        figure.legend(*others[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    mean = 100.0 * float(result["averaged_probability"])
    titles = (TITLES.get(name, f"limit in {name.replace('_', ' ')}") for name in limits)
    heads(figure.axes, f"stick-slip ({mean:.0f} %) or not", *titles)
    return figure
