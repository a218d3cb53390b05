"""How far contacts along a strip change the contact at a place: one step of the fixed point, a column at a time.

What lies within some correlation lengths of a place an expansion in local functionals of the heights sees; beyond, a
strip that carries more force than the mean presses the surface down as a whole,

    u(x) = sum over |x' - x| > reach of K(x - x') (F(x') - mean F),

K the displacement averaged across the strip. A place pressed down by u sees the plane higher by u, so that its contact
area and force are those at the height h_p + u, interpolated between the penetrations that are known anyway. The mean of
F is left out as the expansion has been trained with it.
"""

from __future__ import annotations

import numpy as np

from roughslip.contact.influence import Influence
from roughslip.errors import ParameterError


def column_influence(influence: Influence, spacing: int, reach: int) -> np.ndarray:
    """Mean displacement across a strip under a force spread evenly across another column.

    influence : B of the strip
    spacing : columns of the mesh from one column that is kept to the next
    reach : number of columns that are kept, the loaded one first, on which nothing is felt; at least 1

    Returns K : (ceil(nx / spacing),) [m/N] by the distance in columns that are kept. Raises ParameterError for a
    spacing or a reach below 1.
    """
    if spacing < 1 or reach < 1:
        raise ParameterError(f"columns {spacing} apart and a reach of {reach}: both must be at least 1")
    rows = influence.grid.ny
    pairs = np.where(np.arange(rows) > 0, 2.0, 1.0) * (rows - np.arange(rows))  # of rows so far apart
    kernel = influence.coefficients[::spacing] @ pairs / (rows**2 * influence.grid.cell_area)
    kernel[:reach] = 0.0
    return kernel


def displacement(kernel: np.ndarray, force: np.ndarray) -> np.ndarray:
    """u : (..., n) [m] under forces on n columns : (..., n) [N], from K : (at least n,) [m/N]; there is no load beyond.

    Raises ParameterError for a kernel of fewer columns.
    """
    n = force.shape[-1]
    if len(kernel) < n:
        raise ParameterError(f"an influence over {len(kernel)} columns does not reach along {n}")
    around = np.concatenate([kernel[:n], [0.0], kernel[n - 1 : 0 : -1]])
    spectrum = np.fft.rfft(around) * np.fft.rfft(force, 2 * n)
    return np.asarray(np.fft.irfft(spectrum, 2 * n)[..., :n])


def at_displaced_planes(values: np.ndarray, planes: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Quantities along a strip where the plane stands higher by so much, linear in its height between known heights.

    values : (..., levels, n) not negative, at the known heights of the plane
    planes : (levels,) [m] these heights, in descending order
    moved : (levels, n) [m] by how much the plane of each level is higher at each column

    Returns (..., levels, n): above the highest plane as there, below the lowest continued, never negative. A single
    plane tells no change and is returned as it is. Raises ParameterError for planes that do not descend.
    """
    levels = len(planes)
    if not np.all(np.diff(planes) < 0):
        raise ParameterError("planes must be given from the highest to the lowest")
    if levels == 1:
        return values
    height = planes[:, None] + moved
    lower = np.clip(np.searchsorted(-planes, -height), 1, levels - 1)
    upper_plane, lower_plane = planes[lower - 1], planes[lower]
    share = np.maximum((upper_plane - height) / (upper_plane - lower_plane), 0.0)
    column = np.arange(values.shape[-1])
    return np.maximum((1 - share) * values[..., lower - 1, column] + share * values[..., lower, column], 0.0)
