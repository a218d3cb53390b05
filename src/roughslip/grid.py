"""Regular meshes of rectangular cells: x along the belt (first axis), y across it (second axis)."""

from __future__ import annotations

import numbers
from dataclasses import dataclass

import numpy as np

from roughslip.errors import ParameterError
from roughslip.validation import gate, positive


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
        if not all(isinstance(nodes, numbers.Integral) and nodes >= 1 for nodes in (self.nx, self.ny)):
            raise ParameterError(
                f"a mesh needs whole numbers of cells, at least one an axis, not {self.nx} x {self.ny}"
            )
        for axis, edge in (("x", self.dx), ("y", self.dy)):
            positive(f"the edge of a cell along {axis}", edge, "m")

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
