"""Pictures of single results: surface, pressure, friction path, limit cycle. Needs matplotlib: roughslip[plot].

Each function draws into `axes`, by default the current ones of pyplot, and returns them.
"""

import math
from typing import Any

import numpy as np

try:
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
except ImportError as error:
    from roughslip.errors import MissingPackageError

    raise MissingPackageError(f"pictures need matplotlib ({error}): pip install 'roughslip[plot]'") from error

from roughslip.contact import ContactSolution
from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.oscillator import Oscillator, Trajectory
from roughslip.validation import finite, gate

__all__ = ["friction_path", "limit_cycle", "pressure", "surface"]

LINE = "#0072B2"  # with 0.2, legible to the colour-blind


@gate
def surface(heights: np.ndarray, grid: Grid, axes: Axes | None = None) -> Axes:
    """Heights as colours.

    heights : (nx, ny) [m]
    """
    heights = finite("heights", heights, 2)
    return _map(1e6 * heights, grid, "height [µm]", axes, cmap="viridis")


@gate
def pressure(solution: ContactSolution, grid: Grid, axes: Axes | None = None) -> Axes:
    """Pressure as colours on white, where there is no contact."""
    in_contact = np.where(solution.contact, 1e-6 * solution.pressure, np.nan)
    axes = _map(in_contact, grid, "pressure [MPa]", axes, cmap="plasma_r")
    axes.set_title(f"{100 * solution.area_fraction:.2g} % in contact")
    return axes


@gate
def friction_path(mu: np.ndarray, spacing_m: float, axes: Axes | None = None) -> Axes:
    """Friction coefficient along the slipped distance.

    mu : (nodes,) [-] at the multiples of spacing_m
    """
    mu = finite("mu", mu, 1)
    axes = axes or plt.gca()
    axes.plot(1e3 * spacing_m * np.arange(len(mu)), mu, color=LINE, lw=1.0)
    axes.axhline(float(np.mean(mu)), color="0.2", lw=0.8, ls="--")
    axes.set(xlabel="slipped distance [mm]", ylabel="friction coefficient")
    return axes


@gate
def limit_cycle(motion: Trajectory, oscillator: Oscillator, periods: float = 10.0, axes: Axes | None = None) -> Axes:
    """The end of a trajectory in the phase plane, with the velocity of the belt, where the mass sticks.

    periods : natural periods [-] that are drawn
    """
    axes = axes or plt.gca()
    last = motion.time >= motion.time[-1] - 2.0 * math.pi * periods
    axes.plot(1e3 * motion.position[last], 1e3 * motion.velocity[last], color=LINE, lw=1.0)
    axes.axhline(1e3 * oscillator.V, color="0.2", lw=0.8, ls="--")
    axes.text(0.99, 1e3 * oscillator.V, "belt", transform=axes.get_yaxis_transform(), ha="right", va="bottom")
    axes.margins(y=0.1)
    axes.set(xlabel="displacement X [mm]", ylabel="velocity X' [mm]")
    return axes


def _map(values: np.ndarray, grid: Grid, label: str, axes: Axes | None, **look: Any) -> Axes:
    """Values (nx, ny) over the mesh, with a scale."""
    if values.shape != grid.shape:
        raise ParameterError(f"values of the shape {values.shape} on a mesh of {grid.shape}")
    axes = axes or plt.gca()
    extent = (0.0, 1e6 * grid.nx * grid.dx, 0.0, 1e6 * grid.ny * grid.dy)
    image = axes.imshow(values.T, extent=extent, origin="lower", **look)
    axes.figure.colorbar(image, ax=axes, label=label, shrink=0.8)
    axes.set(xlabel="x [µm]", ylabel="y [µm]")
    return axes
