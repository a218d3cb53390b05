"""Contact area without the error of the mesh, which is a share of the perimeter of the contact.

A mesh takes a cell wholly in or out of contact. Cells at the edge of a contact are only partly covered, and a solve
finds too many of them. The pressure falls as the square root of the distance from the edge. A cell whose centre lies up
to a seventh of its length outside still has a pressure. So the area of the nodes in contact is too
large in proportion to the perimeter. Yastrebov, Anciaux and Molinari, Tribol. Int. 114 (2017) 161, take 0.1181 cells
off for each edge between contact and gap, from the geometry of a digital image. For contacts that are solved for, it is
0.089 on average (Hertz), less along edges than at corners, so the shares below are measured.
"""

from __future__ import annotations

import math

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.validation import gate

# Mean share of a cell that is covered, by the number of its four neighbours out of contact. Fitted to elliptical Hertz
# contacts of 0.3 to 19 cells at random places and angles, whose area they then give to 1.5 %, from 0.6 cells to 0.5 %.
COVERED = (1.0, 0.915, 0.806, 0.647, 0.498)


@gate
def contact_shares(
    pressure: np.ndarray, hardness_pa: float = math.inf, periodic: bool | tuple[bool, bool] = False
) -> np.ndarray:
    """The share of every cell that is in contact; their sum is the contact area in cells.

    pressure : (nx, ny) [Pa] of a solve, positive in contact
    hardness_pa : H [Pa]; no contact bears more, so a cell is covered by a share of at least p / H
    periodic : whether the first and the last cells are neighbours; for both axes, or along x and along y

    Returns (nx, ny) [-]: 1 inside a contact, less at its edge, 0 out of contact. Cells beyond the mesh do not count as
    out of contact. On Hertz contacts the error falls with the square of the cell. On rough surfaces it is below 0.4 %
    with 5.7 cells in a correlation length, where nodes in contact give 8 to 14 % too much.
    """
    around_x, around_y = (periodic, periodic) if isinstance(periodic, bool | np.bool_) else periodic
    return _shares(pressure, hardness_pa, np.array(COVERED), bool(around_x), bool(around_y))


@compiled()
def _shares(pressure: np.ndarray, hardness: float, covered: np.ndarray, around_x: bool, around_y: bool) -> np.ndarray:
    nx, ny = pressure.shape
    shares = np.zeros((nx, ny))
    for i in range(nx):
        for j in range(ny):
            if pressure[i, j] > 0:
                out = int((around_x or i > 0) and pressure[i - 1, j] <= 0)  # -1 is the last
                out += int((around_x or i < nx - 1) and pressure[(i + 1) % nx, j] <= 0)
                out += int((around_y or j > 0) and pressure[i, j - 1] <= 0)
                out += int((around_y or j < ny - 1) and pressure[i, (j + 1) % ny] <= 0)
                shares[i, j] = max(covered[out], pressure[i, j] / hardness)
    return shares
