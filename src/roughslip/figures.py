"""Figures 2, 3 and 5 of the paper, each number with its 95 % interval. The only module that knows seaborn."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import betaln, ndtri

Arrays = Mapping[str, np.ndarray]

INTERVAL = ("", "_low", "_high")


def _with_interval(*names: str) -> list[str]:
    return [name + end for name in names for end in INTERVAL]


DRAWN = {
    "figure2": ["method", "pressure", *_with_interval("cumulative", "contact_probability", "distance_in_contact")],
    "figure3": [
        *("source", "percentile", "lag", "triangle", "histogram", "histogram_edge"),
        *_with_interval("combined_mean", "combined_std", "mean", "std", "autocorrelation", "length_least_squares"),
        *_with_interval("beta_a", "beta_b", "beta_lower", "beta_upper"),
    ],
    "figure5": [
        *("position", "velocity", "deterministic_position", "deterministic_velocity", "histogram", "histogram_edge"),
        *("reattachment_mean", "reattachment_std", "deterministic_reattachment", "nominal_damping", "damping_ratio"),
        *("deterministic_cycles", "mean_cycles", "mean_cycles_error", *_with_interval("difference")),
        *("deterministic_hopf_damping", "deterministic_existence_limit"),
    ],
}
"""Variables of a result that a figure draws, which are stored beside it."""

LABELS = {
    "monte_carlo": "Monte Carlo",
    "latin_hypercube": "Latin hypercube",
    "equation_8": "PC, eq. (8)",
    "equation_9": "PC, eq. (9)",
    "roughslip": "PC, all samples",
}
COLOURS = dict(zip(LABELS, ["0.15", "C0", "C1", "C3", "C2"], strict=True))
STYLES = dict(zip(LABELS, ["-", ":", "--", "-.", "-"], strict=True))


def _canvas(columns: int, rows: int = 1) -> tuple[Figure, np.ndarray]:
    sns.set_theme(context="paper", style="ticks", palette="colorblind", font_scale=1.0)
    mpl.rcParams.update({"svg.hashsalt": "roughslip", "savefig.dpi": 160, "legend.frameon": False})
    return plt.subplots(rows, columns, figsize=(3.9 * columns, 3.3 * rows), layout="constrained")


def save(figure: Figure, path: Path) -> None:
    """Write a figure as its suffix says; the same figure gives the same bytes, so neither date nor version goes in."""
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else {"Software": None})


def _title(axes: Axes, letter: str, text: str) -> None:
    axes.set_title(f"({letter}) {text}", loc="left", fontsize="medium")


def figure2(result: Arrays) -> Figure:
    """Distribution of the pressure at the centre given contact, linear and logarithmic, and the contact probability."""
    figure, (linear, logarithmic, probability) = _canvas(3)
    unit, name = (1e-9, "GPa") if result["pressure"].max() > 1e9 else (1e-6, "MPa")
    pressure = unit * result["pressure"]
    for row, method in enumerate(map(str, result["method"])):
        look = {"color": COLOURS[method], "linestyle": STYLES[method], "label": LABELS[method]}
        for axes in (linear, logarithmic):
            floor = 1e-9 if axes is logarithmic else 0.0
            low, high = (np.maximum(result[f"cumulative_{end}"][row], floor) for end in ("low", "high"))
            axes.fill_between(pressure, low, high, color=COLOURS[method], alpha=0.15, linewidth=0)
            curve = np.where(result["cumulative"][row] > floor, result["cumulative"][row], np.nan)
            axes.plot(pressure, curve, **look)
        share, low, high = (100 * result[f"contact_probability{end}"][row] for end in INTERVAL)
        probability.errorbar(
            share, -row, xerr=[[max(share - low, 0)], [max(high - share, 0)]], fmt="o", capsize=3, color=COLOURS[method]
        )
        distance = result["distance_in_contact"][row]
        if method != "monte_carlo":
            probability.annotate(
                f"distance {distance:.3f}", (share, -row), xytext=(0, 7), textcoords="offset points", ha="center",
                fontsize="small",
            )  # fmt: skip
    linear.set(xlabel=f"pressure at the centre [{name}]", ylabel="probability given contact", ylim=(0, 1))
    linear.set_xlim(0, pressure[np.searchsorted(result["cumulative"][0], 0.999)])
    linear.legend(loc="lower right")
    logarithmic.set(xscale="log", yscale="log", ylim=(1e-4, 1.2), xlabel=f"pressure at the centre [{name}]")
    logarithmic.set_xlim(pressure[0], pressure[-1])
    logarithmic.set_ylabel("probability given contact")
    probability.set(xlabel="probability of contact [%]", ylim=(-len(result["method"]) + 0.4, 0.7))
    probability.set_yticks(-np.arange(len(result["method"])), [LABELS[str(name)] for name in result["method"]])
    probability.margins(x=0.3)
    _title(linear, "a", "distribution given contact")
    _title(logarithmic, "b", "low probabilities")
    _title(probability, "c", "contact, and distance to Monte Carlo")
    sns.despine(figure)
    return figure


def figure3(result: Arrays) -> Figure:
    """Mean and standard deviation of mu against penetration, its autocorrelation and its marginal at the median."""
    figure, grid = _canvas(2, 2)
    percentile = result["percentile"]
    for axes, name, label in ((grid[0, 0], "mean", "mean"), (grid[0, 1], "std", "standard deviation")):
        for row, (source, colour) in enumerate((("solved contact", "C0"), ("expansion", "C1"))):
            axes.plot(percentile, result[name][row], "s" if row else "o", color=colour, ms=3.5, label=source)
            band = result[f"{name}_low"][row], result[f"{name}_high"][row]
            axes.fill_between(percentile, *band, color=colour, alpha=0.2, linewidth=0)
        low, high = (np.abs(result[f"combined_{name}{end}"] - result[f"combined_{name}"]) for end in INTERVAL[1:])
        axes.errorbar(
            percentile, result[f"combined_{name}"], yerr=[low, high], color="0.15", capsize=2, lw=1.2,
            label="solved, expansion as control",
        )  # fmt: skip
        axes.set(xlabel="penetration [percentile of heights]", ylabel=f"{label} of friction coefficient")
        axes.set_ylim(bottom=0)
    grid[0, 0].legend(loc="lower left")
    _autocorrelation(grid[1, 0], result)
    _marginal(grid[1, 1], result)
    _title(grid[0, 0], "a", "mean")
    _title(grid[0, 1], "b", "standard deviation")
    _title(grid[1, 0], "c", "autocorrelation at median penetration")
    _title(grid[1, 1], "d", "marginal at median penetration")
    sns.despine(figure)
    return figure


def _median(result: Arrays) -> int:
    return int(np.flatnonzero(result["percentile"] == 50.0)[0])


def _autocorrelation(axes: Axes, result: Arrays) -> None:
    median, lag = _median(result), 1e6 * result["lag"]
    for level in range(len(result["percentile"])):
        if level != median:
            axes.plot(lag, result["autocorrelation"][0, level], color="0.8", lw=0.7, zorder=1)
    axes.plot([], [], color="0.8", lw=0.7, label="other penetrations")
    axes.plot(lag, result["autocorrelation"][0, median], color="C0", label="solved contact")
    band = (result[f"autocorrelation{end}"][0, median] for end in INTERVAL[1:])
    axes.fill_between(lag, *band, color="C0", alpha=0.2, linewidth=0)
    axes.plot(lag, result["triangle"], color="C3", ls=":", label="window alone (white noise)")
    length = float(result["length_least_squares"][0, median])
    axes.plot(lag, np.exp(-result["lag"] / length), "k--", lw=1, label=f"exponential fit, {1e6 * length:.0f} µm")
    axes.plot(lag, np.exp(-result["lag"] / 250e-6), color="C2", ls="-.", lw=1, label="paper, 250 µm")
    axes.axhline(0, color="0.6", lw=0.5)
    axes.set(xlabel="distance of windows [µm]", ylabel="autocorrelation", xlim=(0, lag[-1]))
    axes.legend(loc="upper right")


def _marginal(axes: Axes, result: Arrays) -> None:
    """Densities of mu less its mean, over its standard deviation, so that the shapes compare."""
    median = _median(result)
    mean, std = (float(result[name][0, median]) for name in ("mean", "std"))
    edges = (result["histogram_edge"] - mean) / std
    axes.stairs(result["histogram"] * std, edges, fill=True, color="C0", alpha=0.35, label="solved contact")
    a, b, lower, upper = (float(result[f"beta_{name}"][0, median]) for name in ("a", "b", "lower", "upper"))
    u = np.linspace(1e-4, 1 - 1e-4, 400)
    fitted = (lower + (upper - lower) * u - mean) / std
    axes.plot(
        fitted, _beta_density(u, a, b) * std / (upper - lower), "k-", label=f"Beta({a:.2g}, {b:.2g}), four parameters"
    )
    paper_mean, paper_std = 2.1 / 7.1, np.sqrt(2.1 * 5.0 / (7.1**2 * 8.1))
    axes.plot((u - paper_mean) / paper_std, _beta_density(u, 2.1, 5.0) * paper_std, "C2-.", label="paper, Beta(2.1, 5)")
    normal = ndtri(u)
    axes.plot(normal, np.exp(-(normal**2) / 2) / np.sqrt(2 * np.pi), color="0.5", lw=0.8, ls=":", label="normal")
    axes.set(xlabel="(friction coefficient - mean) / standard deviation", ylabel="density", ylim=(0, None))
    axes.set_xlim(min(-3.0, edges[0]), max(3.5, edges[-1]))
    axes.legend(loc="upper right")


def _beta_density(u: np.ndarray, a: float, b: float) -> np.ndarray:
    return np.exp((a - 1) * np.log(u) + (b - 1) * np.log1p(-u) - betaln(a, b))


def figure5(result: Arrays) -> Figure:
    """Limit cycles, histogram of the reattachment point, and cycles lost to the scatter against damping."""
    figure, (cycle, histogram, loss) = _canvas(3)
    for number in range(len(result["position"])):
        cycle.plot(1e3 * result["position"][number], 1e3 * result["velocity"][number], color="C0", lw=0.4, alpha=0.5)
    cycle.plot([], [], color="C0", lw=0.6, label=f"stochastic, {len(result['position'])} runs")
    drawn = 1e3 * result["deterministic_position"], 1e3 * result["deterministic_velocity"]
    cycle.plot(*drawn, color="0.1", lw=1.2, label="deterministic")
    cycle.set(xlabel="displacement $X_1$ [mm]", ylabel="velocity $X_2 = \\dot x / \\omega$ [mm]")
    cycle.margins(y=0.22)
    cycle.legend(loc="upper left", ncols=2)
    _reattachment(histogram, result)
    damping = result["damping_ratio"]
    loss.fill_between(damping, result["difference_low"], result["difference_high"], color="C0", alpha=0.3, linewidth=0)
    loss.plot(damping, result["difference"], "o-", ms=3, color="C0", label="$M_d - E[M_S]$")
    loss.plot(damping, result["deterministic_cycles"], color="0.6", lw=1, ls="--", label="$M_d$")
    loss.plot(damping, result["mean_cycles"], color="C1", lw=1, ls="--", label="$E[M_S]$")
    for name, style, label in (
        ("hopf_damping", ":", "steady sliding unstable below"),
        ("existence_limit", "-", "deterministic cycle exists below"),
    ):
        limit = float(result[f"deterministic_{name}"])
        if np.isfinite(limit):
            loss.axvline(limit, color="0.2", lw=0.8, ls=style, label=f"{label} {limit:.4f}")
    loss.axhline(0, color="0.6", lw=0.5)
    loss.set(xlabel="damping ratio $D$", ylabel="number of cycles")
    loss.legend(loc="best", fontsize="small")
    _title(cycle, "a", f"limit cycle at D = {float(result['nominal_damping']):g}")
    _title(histogram, "b", "reattachment point")
    _title(loss, "c", "cycles lost to the scatter")
    sns.despine(figure)
    return figure


def _reattachment(axes: Axes, result: Arrays) -> None:
    axes.set(xlabel="reattachment point $X_{gh}$ [mm]", ylabel="density [1/mm]")
    mean, std = 1e3 * float(result["reattachment_mean"]), 1e3 * float(result["reattachment_std"])
    if not np.isfinite(mean):
        axes.text(0.5, 0.5, "no cycle at this damping", transform=axes.transAxes, ha="center")
        return
    axes.stairs(1e-3 * result["histogram"], 1e3 * result["histogram_edge"], fill=True, color="C0", alpha=0.45)
    x = mean + std * np.linspace(-4, 4, 200)
    axes.plot(x, np.exp(-(((x - mean) / std) ** 2) / 2) / (std * np.sqrt(2 * np.pi)), "k-", label="fitted normal")
    place = 1e3 * float(result["deterministic_reattachment"])
    if np.isfinite(place):
        axes.axvline(place, color="C3", lw=1, ls="--", label="deterministic")
    axes.set_ylim(bottom=0)
    axes.legend()
