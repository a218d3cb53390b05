"""The whole chain in one picture: rough surface, contact pressure, friction along the path, limit cycle."""

from __future__ import annotations

from collections.abc import Sequence

import seaborn as sns
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from roughslip.figures.figure5 import cycle_title, draw_cycle
from roughslip.figures.style import Look, Shown, draw_map, heads, legend_above, panels, pressure_unit

CYCLE = [
    "position",
    "velocity",
    "deterministic_position",
    "deterministic_velocity",
    "nominal_damping",
    "deterministic_reattachment",
]


def figure_chain(result: Shown) -> Figure:
    """A piece of a surface and the pressure on it; friction along a few paths; the limit cycle of several runs."""
    figure, ((surface, contact), (path, cycle)) = panels(2, 2, 4.7)
    heights = 1e6 * result["height"]
    _map(surface, result, heights, "height [µm]", "viridis", (float(heights.min()), float(heights.max())))
    unit, name = pressure_unit(float(result["pressure"].max()))
    pressure = unit * result["pressure"]
    _map(contact, result, pressure, f"pressure [{name}]", "magma", (0.0, float(pressure.max()) or 1.0))
    _friction(path, result)
    draw_cycle(cycle, result)
    heads(
        figure.axes,
        "rough surface",
        pressure_title(result),
        "friction along the path",
        cycle_title(result),
    )
    sns.despine(figure)
    return figure


def pressure_title(result: Shown) -> str:
    """Title of the map of pressure; it says so where the piece shown has no contact."""
    contact = "contact pressure" if result["pressure"].max() > 0.0 else "no contact here"
    return f"{contact}, {result['pressed_by'].item()}"


def _map(axes: Axes, result: Shown, values: xr.DataArray, label: str, colours: str, limits: Sequence[float]) -> None:
    image = draw_map(axes, result["x"], result["y"], values, colours, limits)
    assert axes.figure is not None
    axes.figure.colorbar(image, ax=axes, label=label)


def _friction(axes: Axes, result: Shown) -> None:
    place, mean = 1e3 * result["path"].values, float(result["friction_mean"])
    for number, path in reversed(list(enumerate(result["friction"]))):
        look: Look = {"color": "C0", "lw": 1.3, "label": "one path"} if number == 0 else {"color": "0.7", "lw": 0.8}
        axes.plot(place, path, **look)
    axes.plot([], [], color="0.7", lw=0.8, label="others")
    axes.axhline(mean, color="0.1", lw=1.2, ls="--", label=f"mean {mean:.3g}")
    axes.set(xlabel="slipped distance [mm]", ylabel="friction coefficient $\\mu$", xlim=(0, place[-1]))
    axes.locator_params(axis="y", nbins=6)
    legend_above(axes, columns=3)
