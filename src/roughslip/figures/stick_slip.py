"""Stick-slip over parameters: its map, how long it lasts near the limit, and from which initial states it comes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

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
LEVELS = {0.05: ":", 0.5: "-", 0.95: ":"}


def figure_map(result: Arrays) -> Figure:
    """The map with its levels 0.05, 0.5 and 0.95, the limits without scatter, and the point of the scene."""
    figure, _ = panels(1, 1, 6.2)
    axes = figure.axes[0]
    x, y = result["map_x"], result["map_y"]
    mesh = draw_probability(axes, x, y, result["probability"], list(map(str, result["map_parameters"])))
    figure.colorbar(mesh, ax=axes, label="probability of stick-slip", shrink=0.9)
    low, high = result["probability"].min(), result["probability"].max()
    for level, style in LEVELS.items():
        if low < level < high:
            axes.contour(x, y, result["probability"].T, [level], colors="white", linewidths=0.8, linestyles=style)
    at = np.nonzero(result["is_computed"])
    axes.plot(x[at[0]], y[at[1]], "o", mfc="white", mec="0.2", mew=0.4, ms=2.6)
    for name, style, label in (
        ("existence_limit", "-", "cycle exists, left of it"),
        ("hopf_damping", "--", "sliding unstable, left of it"),
    ):
        if np.isfinite(result[name]).any():
            axes.plot(result[name], y, color="0.05", lw=1.3, ls=style, label=label, path_effects=OUTLINE)
    own = float(result["map_x_own"]), float(result["map_y_own"])
    axes.plot(*own, "*", color="C1", mec="white", ms=12, label="the scene", clip_on=False, ls="none")
    axes.legend(loc="lower left", fontsize="small", frameon=True, framealpha=0.9, handlelength=1.8)
    axes.set_title(
        f"probability of stick-slip, {int(result['map_runs'])} runs at each dot", loc="left", fontsize="medium"
    )
    return figure


def draw_probability(axes: Axes, x: np.ndarray, y: np.ndarray, probability: np.ndarray, names: list[str]) -> QuadMesh:
    """Probabilities (x, y) as colours, with scales and names of their axes; the limits of the axes are then fixed."""
    mesh = axes.pcolormesh(x, y, probability.T, cmap="cividis", vmin=0, vmax=1, shading="nearest", rasterized=True)
    axes.set(xlabel=LABELS[names[0]], ylabel=LABELS[names[1]])
    for values, scale, axis in ((x, axes.set_xscale, axes.xaxis), (y, axes.set_yscale, axes.yaxis)):
        if values[0] > 0.0:
            scale("log")
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_minor_formatter(NullFormatter())
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    return mesh


STATES = ("stick_slip", "sliding", "share")


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


CURVES = {"from_rest": ("from rest on the belt", "-"), "unstable": ("unstable cycle", "--")}


def figure_basins(result: Arrays) -> Figure:
    """States of the plane by where they end, the motion from rest, and the unstable cycle between."""
    figure, _ = panels(1, 1, 6.0)
    (axes,) = figure.axes
    sticks = result["ends_in_stick_slip"] > 0
    for chosen, colour, label in ((sticks, "C3", "ends in stick-slip"), (~sticks, "C0", "ends in steady sliding")):
        x, v = result["basin_position"][chosen], result["basin_velocity"][chosen]
        axes.plot(1e3 * x, v, ".", color=colour, ms=3.0, label=label)
    for name, (label, style) in CURVES.items():
        x, v = result[f"{name}_position"], result[f"{name}_velocity"]
        if x.size:
            axes.plot(1e3 * x, v, style, color="0.1", lw=1.2, label=label)
    axes.set(xlabel="position $x$ [mm]", ylabel="velocity [m/s]")
    legend_above(axes)
    low, high = (100 * float(result[f"basin_share_{end}"]) for end in ("low", "high"))
    share = 100 * float(result["basin_share"])
    axes.set_title(f"{share:.0f} % of the states end in stick-slip [{low:.0f}, {high:.0f}]", loc="left")
    despine(axes)
    return figure


DRAWN = {
    "figure_map": [
        *("map_x", "map_y", "map_x_own", "map_y_own", "map_parameters", "map_runs", "is_computed"),
        *("probability", "hopf_damping", "existence_limit"),
    ],
    "figure_residence": [
        *("friction_deviation", "residence_damping", "residence_limit", "residence_hopf"),
        *with_interval_names(*STATES),
        *(f"{name}_by_theory" for name in STATES),
    ],
    "figure_basins": [
        *("basin_position", "basin_velocity", "ends_in_stick_slip", *with_interval_names("basin_share")),
        *(f"{name}_{part}" for name in CURVES for part in ("position", "velocity")),
    ],
}
