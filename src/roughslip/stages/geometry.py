"""From a stage's slice of the scene to meshes, surfaces and random streams."""

from __future__ import annotations

from typing import Any

from roughslip.grid import Grid
from roughslip.surface.covariance import Covariance

Configuration = dict[str, Any]

# The second entry of every random seed, after the scene's: streams of different stages never meet.
STREAM_MONTE_CARLO, STREAM_LATIN_HYPERCUBE, STREAM_EXPANSION_DESIGN, STREAM_STRIP = 1, 2, 3, 4
STREAM_DRAWS, STREAM_BOOTSTRAP, STREAM_PROCESS = 5, 6, 7


def covariance(configuration: Configuration) -> Covariance:
    """Covariance of the heights."""
    roughness = configuration["roughness"]
    return Covariance(roughness["covariance"], roughness["rms_height_m"], roughness["correlation_length_m"])


def square_grid(configuration: Configuration) -> Grid:
    """Mesh of the square of Figure 2."""
    square = configuration["square"]
    cell = square["edge_m"] / square["nodes"]
    return Grid(square["nodes"], square["nodes"], cell, cell)


def strip_grid(configuration: Configuration) -> Grid:
    """Mesh of a strip of Figure 3."""
    strip = configuration["strip"]
    cell = strip["cell_m"]
    return Grid(round(strip["length_m"] / cell), round(strip["width_m"] / cell), cell, cell)


def window(configuration: Configuration) -> tuple[int, int]:
    """(nodes in a window, nodes between two windows) along the strip."""
    strip = configuration["strip"]
    return round(strip["window_m"] / strip["cell_m"]), round(strip["window_spacing_m"] / strip["cell_m"])
