"""Regular meshes of rectangular cells: x along the belt (first axis), y across it (second axis)."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from roughslip.errors import ParameterError
from roughslip.validation import finite, gate, positive, whole_at_least

UNEQUAL = 1e-3  # of a step: coordinates in single precision differ by less


@gate
@dataclass(frozen=True)
class Grid:
    """A mesh of nx by ny rectangular cells; a node is the centre of its cell.

    nx, ny : number of cells along and across the belt
    dx, dy : edges of a cell [m]
    """

    nx: int
    ny: int
    dx: float
    dy: float

    def __post_init__(self) -> None:
        whole_at_least("nx", self.nx, 1)
        whole_at_least("ny", self.ny, 1)
        positive("dx", self.dx, "m")
        positive("dy", self.dy, "m")

    @classmethod
    @gate
    def of(cls, heights: Any, dx: float | None = None, dy: float | None = None) -> Self:
        """The mesh of a field.

        heights : (nx, ny) [m] an array, or a DataArray whose coordinates x and y [m] give the edges of cells
        dx, dy : edges of a cell [m], where there are no coordinates; both alike if one is given

        Raises ParameterError where edges are missing or given twice, and for coordinates that are not equally spaced.
        """
        nx, ny = finite("heights", heights, 2).shape
        step_x, step_y = _step(heights, 0), _step(heights, 1)
        edge_x = step_x or (dy if dx is None else dx)
        edge_y = step_y or (dx if dy is None else dy)
        if edge_x is None or edge_y is None or (step_x and dx is not None) or (step_y and dy is not None):
            raise ParameterError("heights need the edges dx and dy of a cell [m], or coordinates x and y, not both")
        return cls(nx, ny, edge_x, edge_y)

    @property
    def shape(self) -> tuple[int, int]:
        """(nx, ny), the shape of every field on the mesh."""
        return self.nx, self.ny

    @property
    def size(self) -> int:
        """Number of nodes."""
        return self.nx * self.ny

    @property
    def cell_area(self) -> float:
        """Area of a cell [m^2]."""
        return self.dx * self.dy

    @property
    def centre(self) -> tuple[int, int]:
        """The node that the study calls the centre: (nx // 2, ny // 2)."""
        return self.nx // 2, self.ny // 2

    def x(self) -> np.ndarray:
        """x : (nx,) [m] nodes along the belt, the first at dx / 2."""
        return (np.arange(self.nx) + 0.5) * self.dx

    def y(self) -> np.ndarray:
        """y : (ny,) [m] nodes across the belt, the first at dy / 2."""
        return (np.arange(self.ny) + 0.5) * self.dy


def _step(heights: Any, axis: int) -> float | None:
    """Distance [m] of the coordinates of a DataArray along an axis; None without coordinates."""
    dimension, known = getattr(heights, "dims", (0, 1))[axis], getattr(heights, "coords", {})
    if dimension not in known:
        return None
    coordinate, name = known[dimension], "xy"[axis]
    if dimension != name or coordinate.attrs.get("units", "m") != "m":
        unit = coordinate.attrs.get("units", "m")
        raise ParameterError(f"heights must have the dimensions x and y in m, not {dimension!r} in {unit}")
    places = finite(f"heights.{name}", coordinate, 1)
    step = (places[-1] - places[0]) / max(places.size - 1, 1)
    if not step > 0.0 or np.ptp(np.diff(places)) > UNEQUAL * step:
        helps = f"sort them with heights.sortby({name!r})" if step < 0.0 else f"interpolate, or drop them for d{name}"
        raise ParameterError(f"heights.{name} must be two coordinates or more that rise in equal steps: {helps}")
    return float(step)
