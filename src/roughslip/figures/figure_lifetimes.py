"""How long stick-slip lives near its limits, and where it and steady sliding change places."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from roughslip.figures.style import Arrays, draw_curve, heads, legend_above, panels, with_ends, with_interval_names

DRAWN = {
    "figure_lifetimes": [
        *("scatter_factor", "friction_deviation", "survival_damping", "survival_time"),
        *("survival_limit", "survival_hopf", "band_level", "band_start"),
        *with_interval_names("survival_curve", "lifetime", "waiting", "band"),
    ]
}

CURVES = 6  # of survival that the eye can part
DECIDED = 0.05  # mean survival over the time shown, below which a curve is all fall


def figure_lifetimes(result: Arrays) -> Figure:
    """Survival near the limit; mean lifetimes of either motion; the band against the scatter of friction."""
    figure, (curves, lifetimes, band) = panels(3, 1, 5.2)
    _curves(curves, result)
    _lifetimes(lifetimes, result)
    _band(band, result)
    heads(
        (curves, lifetimes, band),
        "stick-slip that survives, from rest on the belt",
        *("mean lifetimes near the limit", "where stick-slip and sliding change place"),
    )
    for axes in (curves, lifetimes, band):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _nominal(result: Arrays) -> int:
    """The scatter nearest to the scene's own."""
    return int(np.argmin(np.abs(np.log(result["scatter_factor"]))))


def _curves(axes: Axes, result: Arrays) -> None:
    row = _nominal(result)
    mean = result["survival_curve"][row].mean(axis=-1)
    undecided = np.flatnonzero((mean > DECIDED) & (mean < 1.0))
    shown = undecided if undecided.size else np.arange(len(mean))
    shown = shown[np.unique(np.linspace(0, len(shown) - 1, min(CURVES, len(shown))).astype(int))]
    for colour, place in zip(colormaps["viridis"](np.linspace(0, 1, len(shown) + 2)[1:-1]), shown, strict=True):
        look = {"color": colour, "lw": 1.5, "label": f"$D$ = {result['survival_damping'][row, place]:.3f}"}
        draw_curve(axes, result["survival_time"], with_ends(result, "survival_curve", (row, place)), look, alpha=0.15)
    axes.set(xlabel="natural periods", ylabel="share of the runs", ylim=(0, 1.02), xlim=(0, None))
    axes.plot([], [], " ", label=f"std {float(result['friction_deviation'][row]):.3g}")
    legend_above(axes, columns=3)


def _lifetimes(axes: Axes, result: Arrays) -> None:
    deviations = result["friction_deviation"]
    for row in range(len(deviations)):
        colour, damping = f"C{row}", result["survival_damping"][row]
        for name, marker, style in (("lifetime", "o", "-"), ("waiting", "s", "--")):
            ends = with_ends(result, name, row)
            known = np.isfinite(ends[0])
            look = {"color": colour, "marker": marker, "ls": style, "ms": 3.5, "lw": 1.1}
            draw_curve(axes, damping[known], [end[known] for end in ends], look, alpha=0.15)
            bound = np.isfinite(ends[1]) & ~known
            axes.plot(damping[bound], ends[1][bound], "^", ms=3, alpha=0.5, mfc="none", color=colour)
    axes.set(yscale="log", xlabel="damping ratio $D$", ylabel="natural periods")
    low, high = axes.get_ylim()
    for name, style in (("survival_hopf", "--"), ("survival_limit", "-")):
        if axes.get_xlim()[0] <= float(result[name]) <= axes.get_xlim()[1]:
            axes.axvline(float(result[name]), color="0.3", lw=0.9, ls=style)
    axes.set_ylim(low, high)
    handles = [Line2D([], [], color=f"C{row}", lw=1.5, label=f"std {std:.3g}") for row, std in enumerate(deviations)]
    handles += [
        Line2D([], [], color="0.3", marker="o", ms=3.5, lw=1.1, label="stick-slip"),
        Line2D([], [], color="0.3", marker="s", ms=3.5, lw=1.1, ls="--", label="steady sliding"),
        Line2D([], [], color="0.3", marker="^", mfc="none", ms=4, ls="none", label="more than"),
    ]
    axes.set_ylim(low, high * (high / low) ** (0.08 * -(-len(handles) // 2)))
    axes.legend(handles=handles, loc="upper right", ncols=2, fontsize="small", columnspacing=1.0)


def _band(axes: Axes, result: Arrays) -> None:
    deviation, (first, _, last) = result["friction_deviation"], result["band_level"]
    for start, (name, marker) in enumerate(zip(result["band_start"], "os", strict=True)):
        colour, (value, low, high) = f"C{start}", with_ends(result, "band", (slice(None), start))
        axes.fill_between(deviation, value[:, 0], value[:, -1], color=colour, alpha=0.2, linewidth=0)
        for column in (0, 2):
            axes.plot(deviation, value[:, column], color=colour, lw=0.8)
        error = [value[:, 1] - low[:, 1], high[:, 1] - value[:, 1]]
        axes.errorbar(deviation, value[:, 1], error, fmt=f"{marker}-", ms=4, lw=1.4, color=colour, label=str(name))
    for name, style, text in (("limit", "-", "cycle exists below"), ("hopf", "--", "sliding unstable below")):
        limit = float(result[f"survival_{name}"])
        axes.axhline(limit, color="0.3", lw=0.9, ls=style, label=f"{text} {limit:.4f}")
    axes.set(xlabel="standard deviation of friction", ylabel="damping ratio $D$", xlim=(0, None))
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom, top + 0.45 * (top - bottom))  # room for the legend, which would hide a band
    title = f"probability {last:g} to {first:g}"
    axes.legend(loc="upper left", fontsize="small", title=title, title_fontsize="small")
