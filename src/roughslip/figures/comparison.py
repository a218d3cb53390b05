"""The figures of several scenes in one picture, a colour a scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from string import ascii_lowercase

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughslip.figures.figure3 import PANELS as FRICTION
from roughslip.figures.figure3 import PENETRATION
from roughslip.figures.stick_slip import LABELS
from roughslip.figures.style import (
    Arrays,
    Look,
    despine,
    draw_curve,
    draw_points,
    head,
    panels,
    with_ends,
    with_interval_names,
)

Results = Mapping[str, Arrays]  # by scene

LOOKS = (("C0", "o"), ("C1", "s"), ("C2", "^"), ("C3", "D"), ("C4", "v"), ("C5", "P"))  # of compared scenes
MOST = len(LOOKS)
APART = 0.8  # per cent of penetration between the markers of two scenes, so that none hides another
COLUMNS = 3


@dataclass(frozen=True)
class Panel:
    """A panel of the comparison.

    figure : of the scenes, whose result it draws
    title : of the panel
    drawn : variables of that result
    draw : takes the axes, the results of all scenes that have the figure, and the look of each
    """

    figure: str
    title: str
    drawn: tuple[str, ...]
    draw: Callable[[Axes, Results, Mapping[str, Look]], None]


def _pressure(axes: Axes, results: Results, looks: Mapping[str, Look]) -> None:
    """The Monte Carlo distribution, over its mean, so that materials compare."""
    for scene, result in results.items():
        row = list(map(str, result["method"])).index("monte_carlo")
        value, low, high = with_ends(result, "cumulative", row)
        pressure = result["pressure"]
        mean = float(np.sum(0.5 * (pressure[1:] + pressure[:-1]) * np.diff(value)) / (value[-1] - value[0]))
        draw_curve(axes, pressure / mean, (value, low, high), {"color": looks[scene]["color"]})
    axes.set(xlabel="pressure at the centre over its mean", ylabel="cumulative probability", xlim=(0, 5), ylim=(0, 1))


def _by_penetration(name: str, label: str, factor: float = 1.0) -> Callable[[Axes, Results, Mapping[str, Look]], None]:
    """Draws a number of friction against penetration, in units of 1 / factor."""

    def draw(axes: Axes, results: Results, looks: Mapping[str, Look]) -> None:
        for number, (scene, result) in enumerate(results.items()):
            x = result["percentile"] + APART * (number - 0.5 * (len(results) - 1))
            draw_points(axes, x, with_ends(result, name, factor=factor), looks[scene])
        axes.set(xlabel=PENETRATION, ylabel=label, ylim=(0, None))

    return draw


def _scan(axes: Axes, results: Results, looks: Mapping[str, Look]) -> None:
    """Autocorrelation of the scans along the belt."""
    for scene, result in results.items():
        i, j = (len(result[f"lag_{axis}"]) // 2 for axis in "xy")
        ends = with_ends(result, "correlation", (slice(i, None), j))
        draw_curve(axes, 1e6 * result["lag_x"][i:], ends, {"color": looks[scene]["color"]})
    axes.set(xlabel="lag [µm]", ylabel="autocorrelation", xlim=(0, None))


def _cycle(axes: Axes, results: Results, looks: Mapping[str, Look]) -> None:
    for number, (scene, result) in enumerate(results.items()):
        drawn = 1e3 * result["deterministic_position"], 1e3 * result["deterministic_velocity"]
        axes.plot(
            *drawn, color=looks[scene]["color"], lw=0.8 + 1.2 * (len(results) - 1 - number)
        )  # cycles may coincide
    axes.set(xlabel="displacement $X_1$ [mm]", ylabel="velocity $X_2 = \\dot x / \\omega$ [mm]")


def _reattachment(axes: Axes, results: Results, looks: Mapping[str, Look]) -> None:
    for scene, result in results.items():
        axes.stairs(1e-3 * result["histogram"], 1e3 * result["histogram_edge"], color=looks[scene]["color"], lw=1.2)
    axes.set(xlabel="reattachment point $X_{gh}$ [mm]", ylabel="density [1/mm]", ylim=(0, None))


def _loss(axes: Axes, results: Results, looks: Mapping[str, Look]) -> None:
    for scene, result in results.items():
        draw_curve(axes, result["damping_ratio"], with_ends(result, "difference"), looks[scene] | {"ls": "-"})
    axes.set(xlabel="damping ratio $D$", ylabel="$M_{diff} = M_d - E[M_S]$")


def _map(axes: Axes, results: Results, looks: Mapping[str, Look]) -> None:
    """Where stick-slip is as likely as not, on the maps of the same parameters as that of the first scene."""
    names = [list(map(str, result["map_parameters"])) for result in results.values()]
    for parameters, (scene, result) in zip(names, results.items(), strict=True):
        probability = result["probability"]
        if parameters == names[0] and probability.min() < 0.5 < probability.max():
            axes.contour(result["map_x"], result["map_y"], probability.T, [0.5], colors=[looks[scene]["color"]])
    axes.set(xlabel=LABELS[names[0][0]], ylabel=LABELS[names[0][1]])


COMPARED = (
    Panel("figure2", "Figure 2: pressure", ("method", "pressure", *with_interval_names("cumulative")), _pressure),
    *(
        Panel(figure, f"Figure 3: {title}", ("percentile", *with_interval_names(name)), _by_penetration(name, *label))
        for figure, title, name, label in (
            ("figure3", "mean", "combined_mean", (FRICTION["mean"],)),
            ("figure3", "scatter", "combined_std", (FRICTION["std"],)),
            ("figure3", "scatter over mean", "combined_variation", (FRICTION["variation"],)),
            ("figure3_law", "correlation length", "combined_length_least_squares", ("correlation length [µm]", 1e6)),
        )
    ),
    Panel("figure5", "Figure 5: cycle without scatter", ("deterministic_position", "deterministic_velocity"), _cycle),
    Panel("figure5", "Figure 5: reattachment point", ("histogram", "histogram_edge"), _reattachment),
    Panel("figure5", "Figure 5: cycles lost", ("damping_ratio", *with_interval_names("difference")), _loss),
    Panel("figure_map", "map: where stick-slip is at 50 %", ("map_x", "map_y", "map_parameters", "probability"), _map),
    Panel("figure_scan", "scan: autocorrelation", ("lag_x", "lag_y", *with_interval_names("correlation")), _scan),
)


def drawn(figure: str) -> tuple[str, ...]:
    """Variables of a figure that the comparison draws."""
    return tuple(dict.fromkeys(name for panel in COMPARED if panel.figure == figure for name in panel.drawn))


def comparison(results: Mapping[str, Results]) -> Figure:
    """A panel for each that some scene has, of up to MOST scenes. results : by figure and scene"""
    shown = [panel for panel in COMPARED if panel.figure in results]
    columns = min(COLUMNS, len(shown))
    figure, grid = panels(columns, -(-len(shown) // columns), 4.0)
    scenes = list(dict.fromkeys(scene for by_scene in results.values() for scene in by_scene))
    looks: dict[str, Look] = {
        scene: {"color": colour, "marker": marker, "ms": 4}
        for scene, (colour, marker) in zip(scenes, LOOKS, strict=False)
    }
    every = list(np.ravel(grid))
    for panel, axes, letter in zip(shown, every, ascii_lowercase, strict=False):
        panel.draw(axes, results[panel.figure], looks)
        head(axes, letter, panel.title)
    for axes in every[len(shown) :]:
        axes.remove()
    handles = [Line2D([], [], label=scene, **look) for scene, look in looks.items()]
    figure.legend(handles=handles, loc="outside upper left", ncols=len(handles))
    despine(*figure.axes)
    return figure
