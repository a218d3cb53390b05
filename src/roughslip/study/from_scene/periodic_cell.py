"""The mesh of a periodic cell under a load.

A cell has whole windows along and across the belt, at least WINDOWS of them and EDGE correlation lengths. All of it
bears the nominal pressure, so it also needs many contacts. The expected real area is sqrt(2 pi) p / (E* h') of it at
light loads (Bush, Gibson and Thomas, Wear 35 (1975) 87). It is at least CONTACT correlation areas, some 20 contacts.
What the period itself does is measured in docs/notebook/contact.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.scene.types import Scene
from roughslip.study.from_scene import elastic
from roughslip.study.from_scene.surface_model import fitted_covariance
from roughslip.surface.model import GaussianModel
from roughslip.surface.plausibility import (
    LIGHT_AREA,
    MOST_CELL_NODES,
    contact_mistake,
    plasticity_index,
    rms_slope,
    slope_mistake,
    yield_warning,
)

WINDOWS = 6, 2  # along and across, at least: lags of three windows are within half a period
EDGE = 8.0  # correlation lengths of an edge, at least
CONTACT = 4.0  # correlation areas in contact in a cell, at least


def mesh_of(scene: Scene, lengths_m: tuple[float, float], light_area: float) -> Grid:
    """The smallest cell that serves, or one of at most MOST_CELL_NODES nodes. Its shorter edge doubles until it serves.

    lengths_m : 1/e lengths of the heights along and across
    light_area : [-] share of the cell in contact that is expected
    """
    strip = scene.strip
    window, width = strip.window_m, strip.width_m
    along, across = (
        2 * math.ceil(max(least, EDGE * length / edge) / 2)
        for least, length, edge in zip(WINDOWS, lengths_m, (window, width), strict=True)
    )
    needed = CONTACT * math.prod(lengths_m) / light_area
    most = MOST_CELL_NODES * strip.cell_m**2
    while along * window * across * width < min(needed, most / 2):
        along, across = (2 * along, across) if along * window <= across * width else (along, 2 * across)
    x, y = (round(size / strip.cell_m) for size in (window, width))
    return Grid(along * x, across * y, strip.cell_m, strip.cell_m)


def mesh_under(scene: Scene, model: GaussianModel, pressure_pa: float) -> tuple[Grid, str]:
    """The mesh of a cell under a nominal pressure, and what is wrong where the pressure is too high or too low.

    Raises IllPosedError where a cell of WINDOWS and EDGE has too many nodes.
    """
    modulus, hardness = elastic.material(scene).plane_strain_modulus_pa, elastic.hardness_pa(scene)
    slope = rms_slope(model.covariance, scene.strip.cell_m)
    share = max(LIGHT_AREA * pressure_pa / (modulus * slope), pressure_pa / hardness)
    least = CONTACT * math.prod(model.lengths_m) / (MOST_CELL_NODES * scene.strip.cell_m**2)
    mistake = contact_mistake(pressure_pa, modulus, slope, hardness, least)
    grid = mesh_of(scene, model.lengths_m, share)
    if grid.size > MOST_CELL_NODES:
        raise IllPosedError(
            f"a periodic cell of {WINDOWS[0]} x {WINDOWS[1]} windows and {EDGE:g} correlation lengths takes "
            f"{grid.size} nodes, more than {MOST_CELL_NODES}: use larger cells or smaller windows; scene keys: "
            "strip.cell_m, strip.window_m, strip.width_m"
        )
    return grid, mistake


def index_of(scene: Scene, model: GaussianModel) -> float:
    """Plasticity index E* h' / H [-], zero in elastic contact."""
    modulus, slope = elastic.material(scene).plane_strain_modulus_pa, rms_slope(model.covariance, scene.strip.cell_m)
    return plasticity_index(modulus, slope, elastic.hardness_pa(scene))


def check_slope(scan: Path | None) -> None:
    """Raise IllPosedError for a covariance fitted to a scan whose slope is infinite."""
    fitted = None if scan is None else fitted_covariance(store.read(scan))
    if fitted is not None and (text := slope_mistake(fitted)):
        raise IllPosedError(f"roughness.scan.covariance: {text}. Of a scan, measured ends at its spacing")


def warnings(scene: Scene, model: GaussianModel, scan: Path | None) -> Iterator[str]:
    """That the surface of a scan would yield where the scene gives no hardness."""
    if scan is None or scene.material.hardness_pa is not None:
        return
    modulus, slope = elastic.material(scene).plane_strain_modulus_pa, rms_slope(model.covariance, scene.strip.cell_m)
    if text := yield_warning(scene.material.young_modulus_pa, modulus, slope):
        yield text


def yielding(index: float, share: float) -> str:
    """Whether the contact of a load yields, as the log and the page say it.

    index : E* h' / H, zero in elastic contact; share : of the real area that bears the hardness
    """
    if not index:
        return "The contact is elastic: material.hardness_pa is not given."
    return f"The plasticity index E* h' / H is {index:.2g}; {100 * share:.2g} % of the real area bears the hardness."
