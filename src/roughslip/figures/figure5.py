"""Figure 5, limit cycles, reattachment point and cycles lost to the scatter; and the whole chain in one picture."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.style import (
    Look,
    Shown,
    draw_curve,
    draw_map,
    heads,
    legend_above,
    panels,
    pressure_unit,
    with_ends,
)

CYCLE = [
    "position",
    "velocity",
    "deterministic_position",
    "deterministic_velocity",
    "nominal_damping",
    "deterministic_reattachment",
]


def figure5(result: Shown) -> Figure:
    """The paper's panels (a) to (c), then the cycles themselves."""
    figure, ((cycle, histogram), (loss, counts)) = panels(2, 2, 4.6)
    draw_cycle(cycle, result)
    _reattachment(histogram, result)
    _loss(loss, result)
    _counts(counts, result)
    titles = "reattachment point", "cycles lost to the scatter", "cycles with and without scatter"
    heads(figure.axes, cycle_title(result), *titles)
    return figure


def cycle_title(result: Shown) -> str:
    """Title of the phase plane: a limit cycle only where the mass sticks to the belt again without scatter."""
    kind = "limit cycle" if np.isfinite(result["deterministic_reattachment"]) else "no stick-slip cycle"
    return f"{kind} at D = {float(result['nominal_damping']):g}"


def draw_cycle(axes: Axes, result: Shown) -> None:
    """The phase plane: loops of the runs with scatter, and the one without."""
    runs = len(result["position"])
    for position, velocity in zip(result["position"], result["velocity"], strict=True):
        axes.plot(1e3 * position, 1e3 * velocity, color="C0", lw=0.4, alpha=0.5)
    axes.plot([], [], color="C0", lw=1, label=f"stochastic, {runs} run{'s' if runs > 1 else ''}")
    drawn = 1e3 * result["deterministic_position"], 1e3 * result["deterministic_velocity"]
    axes.plot(*drawn, color="0.1", lw=1.2, label="deterministic")
    axes.set(xlabel="displacement $X_1$ [mm]", ylabel="velocity $X_2 = \\dot x / \\omega$ [mm]")
    legend_above(axes)


def _reattachment(axes: Axes, result: Shown) -> None:
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
        axes.plot([place, place], [0, max(normal.max(), float(density.max()))], "C3--", lw=1.2, label="deterministic")
    axes.set(xlim=(mean - 5 * std, mean + 5 * std), ylim=(0, None))
    axes.locator_params(axis="x", nbins=4)
    legend_above(axes)


def _loss(axes: Axes, result: Shown) -> None:
    look = {"color": "C0", "ls": "-", "marker": "o", "ms": 3}
    draw_curve(axes, result["damping_ratio"], with_ends(result, "difference"), look, alpha=0.3)
    axes.axhline(0, color="0.6", lw=0.5)
    axes.set(xlabel="damping ratio $D$", ylabel="$M_{diff} = M_d - E[M_S]$")


def _counts(axes: Axes, result: Shown) -> None:
    damping = result["damping_ratio"]
    axes.plot(damping, result["deterministic_cycles"], color="0.1", lw=1.2, label="$M_d$, without scatter")
    axes.plot(damping, result["mean_cycles"], color="C0", lw=1.2, ls="--", label="$E[M_S]$, with scatter")
    low, high = axes.get_ylim()
    limits = ("hopf_damping", ":", "sliding unstable below"), ("existence_limit", "-.", "cycle exists below")
    for name, style, text in limits:
        limit = float(result[f"deterministic_{name}"])
        if damping[0] <= limit <= damping[-1]:
            axes.vlines(limit, low, high, color="C3", lw=1.0, ls=style, label=f"{text} {limit:.4f}")
    axes.set(xlabel="damping ratio $D$", ylabel="cycles in the same time", ylim=(low, high))
    legend_above(axes)


def figure_chain(result: Shown) -> Figure:
    """A surface and the pressure on it; friction along a few paths; the limit cycle."""
    figure, ((surface, contact), (path, cycle)) = panels(2, 2, 4.7)
    heights = 1e6 * result["height"]
    limits = float(heights.min()), float(heights.max())
    draw_map(surface, result["x"], result["y"], heights, "height [µm]", limits)
    unit, name = pressure_unit(float(result["pressure"].max()))
    pressure = unit * result["pressure"]
    limits = 0.0, float(pressure.max()) or 1.0
    draw_map(contact, result["x"], result["y"], pressure, f"pressure [{name}]", limits, "magma")
    _friction(path, result)
    draw_cycle(cycle, result)
    pressed = f"{'contact pressure' if pressure.max() > 0.0 else 'no contact here'}, {result['pressed_by'].item()}"
    heads((surface, contact, path, cycle), "rough surface", pressed, "friction along the path", cycle_title(result))
    return figure


def _friction(axes: Axes, result: Shown) -> None:
    place, mean = 1e3 * result["path"].values, float(result["friction_mean"])
    for number, path in reversed(list(enumerate(result["friction"]))):
        look: Look = {"color": "C0", "lw": 1.3, "label": "one path"} if number == 0 else {"color": "0.7", "lw": 0.8}
        axes.plot(place, path, **look)
    axes.plot([], [], color="0.7", lw=0.8, label="others")
    axes.axhline(mean, color="0.1", lw=1.2, ls="--", label=f"mean {mean:.3g}")
    axes.set(xlabel="slipped distance [mm]", ylabel="friction coefficient $\\mu$", xlim=(0, place[-1]))
    axes.locator_params(axis="y", nbins=6)
    axes.ticklabel_format(axis="y", useOffset=False)
    legend_above(axes, columns=3)
