"""Figures 2 and 5 of the paper, each number with its 95 % interval, and the style of all figures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure

Arrays = Mapping[str, np.ndarray]

INTERVAL = ("", "_low", "_high")


def with_interval_names(*names: str) -> list[str]:
    """The names of stored numbers and of both ends of their intervals."""
    return [name + end for name in names for end in INTERVAL]


DRAWN = {
    "figure2": ["method", "pressure", "distance_in_contact", *with_interval_names("cumulative", "contact_probability")],
    "figure5": [
        *("position", "velocity", "deterministic_position", "deterministic_velocity", "histogram", "histogram_edge"),
        *("reattachment_mean", "reattachment_std", "deterministic_reattachment", "nominal_damping", "damping_ratio"),
        *("deterministic_cycles", "mean_cycles", *with_interval_names("difference")),
        *("deterministic_hopf_damping", "deterministic_existence_limit"),
    ],
}
"""Variables of a result that a figure draws, which are stored beside it."""

METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "monte_carlo": ("Monte Carlo", {"color": "0.15", "linestyle": "-", "linewidth": 2.2}),
    "latin_hypercube": ("Latin hypercube", {"color": "C0", "linestyle": ":", "linewidth": 1.8}),
    "equation_8": ("PC, eq. (8)", {"color": "C1", "linestyle": "--"}),
    "equation_9": ("PC, eq. (9)", {"color": "C3", "linestyle": "-."}),
    "roughslip": ("PC, all samples", {"color": "C2", "linestyle": "-", "linewidth": 1.2}),
}
"""Label and look of the ways to a distribution; told apart by style as well as by colour."""


def panels(columns: int, rows: int, width: float) -> tuple[Figure, np.ndarray]:
    """A figure in the style of the study with its panels, each `width` inches wide."""
    mpl.rcdefaults()  # whatever a user's matplotlibrc says
    sns.set_theme(context="paper", style="ticks", palette="colorblind", font_scale=1.1)
    mpl.rcParams.update({"svg.hashsalt": "roughslip", "savefig.dpi": 160, "legend.frameon": False})
    figure = Figure(figsize=(width * columns, 3.5 * rows), layout="constrained")
    return figure, figure.subplots(rows, columns)


def save(figure: Figure, path: Path) -> None:
    """Write a figure as its suffix says; the same figure gives the same bytes, so neither date nor version goes in."""
    figure.savefig(path, metadata={"Date": None, "Creator": None} if path.suffix == ".svg" else {"Software": None})
    figure.set_layout_engine("none")  # what was laid out for one format stays so for the next


def head(axes: Axes, letter: str, text: str) -> None:
    """The letter and the title of a panel, above its left edge."""
    axes.set_title(f"({letter}) {text}", loc="left", fontsize="medium")


def legend_above(axes: Axes, columns: int = 2) -> None:
    """A legend at the top, over nothing: the axis is raised by the height of its lines."""
    labels = axes.get_legend_handles_labels()[1]
    share = 0.03 + 0.07 * -(-len(labels) // columns)
    scale, (low, high) = axes.yaxis.get_transform(), axes.get_ylim()
    axes.set_yticks([tick for tick in axes.get_yticks() if low <= tick <= high])
    below, above = scale.transform([low, high])
    axes.set_ylim(low, float(scale.inverted().transform([below + (above - below) / (1 - share)])[0]))
    axes.legend(
        loc="upper left", ncols=columns, fontsize="small", columnspacing=0.8, handlelength=1.7, borderaxespad=0.1
    )


def figure2(result: Arrays) -> Figure:
    """Distribution of the pressure at the centre given contact, linear and logarithmic, and the contact probability."""
    figure, (linear, logarithmic, probability) = panels(3, 1, 4.0)
    unit, name = (1e-9, "GPa") if result["pressure"].max() > 1e9 else (1e-6, "MPa")
    pressure = unit * result["pressure"]
    methods = [str(method) for method in result["method"]]
    for row, method in enumerate(methods):
        label, look = METHODS[method]
        for axes, floor in ((linear, 0.0), (logarithmic, 1e-9)):
            low, high = (np.maximum(result[f"cumulative{end}"][row], floor) for end in INTERVAL[1:])
            axes.fill_between(pressure, low, high, color=look["color"], alpha=0.15, linewidth=0)
            curve = np.where(result["cumulative"][row] > floor, result["cumulative"][row], np.nan)
            axes.plot(pressure, curve, label=label, **look)
        _contact(probability, result, row, look["color"], annotated=method != "monte_carlo")
    linear.set(xlabel=f"pressure at the centre [{name}]", ylabel="probability given contact", ylim=(0, 1))
    nearly_all = int(np.searchsorted(result["cumulative"][methods.index("monte_carlo")], 0.999))
    linear.set_xlim(0, pressure[min(nearly_all, len(pressure) - 1)])
    logarithmic.set(xscale="log", yscale="log", ylim=(1e-4, 1.2), xlabel=f"pressure at the centre [{name}]")
    logarithmic.set(xlim=(pressure[0], pressure[-1]), ylabel="probability given contact")
    probability.set(xlabel="probability of contact [%]", ylim=(0.4 - len(methods), 0.7))
    probability.set_yticks(-np.arange(len(methods)), [METHODS[method][0] for method in methods])
    probability.margins(x=0.3)
    figure.legend(*linear.get_legend_handles_labels(), loc="outside lower center", ncols=len(methods))
    head(linear, "a", "distribution given contact")
    head(logarithmic, "b", "low probabilities")
    head(probability, "c", "contact, and distance to Monte Carlo")
    sns.despine(figure)
    return figure


def _contact(axes: Axes, result: Arrays, row: int, colour: str, annotated: bool) -> None:
    share, low, high = (100 * float(result[f"contact_probability{end}"][row]) for end in INTERVAL)
    axes.plot([low, high], [-row, -row], "|-", color=colour)
    axes.plot(share, -row, "o", color=colour)
    if annotated:
        distance = float(result["distance_in_contact"][row])
        text = f"distance {distance:.3f}" if np.isfinite(distance) else "fit refused"
        axes.annotate(text, (share, -row), xytext=(0, 7), textcoords="offset points", ha="center", fontsize="small")


def figure5(result: Arrays) -> Figure:
    """Limit cycles, histogram of the reattachment point, and cycles lost to the scatter against damping."""
    figure, (cycle, histogram, loss) = panels(3, 1, 4.0)
    _cycle(cycle, result)
    _reattachment(histogram, result)
    _loss(loss, result)
    head(cycle, "a", f"limit cycle at D = {float(result['nominal_damping']):g}")
    head(histogram, "b", "reattachment point")
    head(loss, "c", "cycles lost to the scatter")
    sns.despine(figure)
    return figure


def _cycle(axes: Axes, result: Arrays) -> None:
    runs = len(result["position"])
    for number in range(runs):
        axes.plot(1e3 * result["position"][number], 1e3 * result["velocity"][number], color="C0", lw=0.4, alpha=0.5)
    axes.plot([], [], color="C0", lw=1, label=f"stochastic, {runs} run{'s' if runs > 1 else ''}")
    drawn = 1e3 * result["deterministic_position"], 1e3 * result["deterministic_velocity"]
    axes.plot(*drawn, color="0.1", lw=1.2, label="deterministic")
    axes.set(xlabel="displacement $X_1$ [mm]", ylabel="velocity $X_2 = \\dot x / \\omega$ [mm]")
    legend_above(axes)


def _reattachment(axes: Axes, result: Arrays) -> None:
    axes.set(xlabel="reattachment point $X_{gh}$ [mm]", ylabel="density [1/mm]")
    mean, std = 1e3 * float(result["reattachment_mean"]), 1e3 * float(result["reattachment_std"])
    if not np.isfinite(mean):
        axes.text(0.5, 0.5, "too few cycles at this damping", transform=axes.transAxes, ha="center")
        return
    density, edges = 1e-3 * result["histogram"], 1e3 * result["histogram_edge"]
    axes.stairs(density, edges, fill=True, color="C0", alpha=0.45, label="stochastic")
    x = mean + std * np.linspace(-4, 4, 200)
    normal = np.exp(-(((x - mean) / std) ** 2) / 2) / (std * np.sqrt(2 * np.pi))
    axes.plot(x, normal, "k-", lw=1.2, label="fitted normal")
    place = 1e3 * float(result["deterministic_reattachment"])
    if np.isfinite(place):
        axes.plot([place, place], [0, max(normal.max(), density.max())], "C3--", lw=1.2, label="deterministic")
    axes.set_ylim(bottom=0)
    legend_above(axes)


def _loss(axes: Axes, result: Arrays) -> None:
    damping = result["damping_ratio"]
    axes.fill_between(damping, result["difference_low"], result["difference_high"], color="C0", alpha=0.3, linewidth=0)
    axes.plot(damping, result["difference"], "o-", ms=3, color="C0", label="$M_d - E[M_S]$")
    axes.plot(damping, result["deterministic_cycles"], color="0.4", lw=1, ls="-.", label="$M_d$")
    axes.plot(damping, result["mean_cycles"], color="C1", lw=1.2, ls="--", label="$E[M_S]$")
    axes.axhline(0, color="0.6", lw=0.5)
    low, high = axes.get_ylim()
    for name, style, text in (
        ("hopf_damping", ":", "sliding unstable below"),
        ("existence_limit", "-", "cycle exists below"),
    ):
        limit = float(result[f"deterministic_{name}"])
        if damping[0] <= limit <= damping[-1]:
            axes.vlines(limit, low, high, color="0.2", lw=0.8, ls=style, label=f"{text} {limit:.4f}")
    axes.set(xlabel="damping ratio $D$", ylabel="number of cycles", ylim=(low, high))
    legend_above(axes)
