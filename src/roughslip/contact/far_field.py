"""Effect of distant contacts along a strip on the contact at a column, by one step of a fixed-point iteration.

An expansion in local functionals describes contacts within some correlation lengths. Distant columns that carry more
force than the mean press the surface down by

    u(x) = sum over |x' - x| > reach of K(x - x') (F(x') - mean F),

with K the displacement averaged across the strip. For a column pressed down by u the plane is higher by u. Its contact
area and force are therefore those at the height h_p + u, interpolated between the known penetrations. The mean of F is
subtracted because the expansion was trained with it.
"""

from __future__ import annotations

import numpy as np

from roughslip.contact.influence import Influence
from roughslip.errors import ParameterError


def column_influence(influence: Influence, spacing: int, reach: int) -> np.ndarray:
    """Mean displacement across a strip under a force distributed evenly across another column.

    influence : B of the strip
    spacing : columns of the mesh from one selected column to the next
    reach : number of selected columns, from the loaded one on, that are local and get K = 0; at least 1

    Returns K : (ceil(nx / spacing),) [m/N] by the distance in selected columns. Raises ParameterError for a spacing or
    a reach below 1.
    """
    if spacing < 1 or reach < 1:
        raise ParameterError(f"columns {spacing} apart and a reach of {reach}: both must be at least 1")
    rows = influence.grid.ny
    pairs = np.where(np.arange(rows) > 0, 2.0, 1.0) * (rows - np.arange(rows))  # of rows so far apart
    kernel = influence.coefficients[::spacing] @ pairs / (rows**2 * influence.grid.cell_area)
    kernel[:reach] = 0.0
    return kernel


def displacement(kernel: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Displacement along a strip under forces on its columns, without load outside.

    kernel : (at least n,) [m/N] K
    force : (..., n) [N]

    Returns u : (..., n) [m]. Raises ParameterError for a kernel of fewer columns.
    """
    n = force.shape[-1]
    if len(kernel) < n:
        raise ParameterError(f"an influence over {len(kernel)} columns does not reach along {n}")
    around = np.concatenate([kernel[:n], [0.0], kernel[n - 1 : 0 : -1]])
    spectrum = np.fft.rfft(around) * np.fft.rfft(force, 2 * n)
    return np.asarray(np.fft.irfft(spectrum, 2 * n)[..., :n])


def at_displaced_planes(values: np.ndarray, planes: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Quantities along a strip at displaced planes, linear between the known heights of the plane.

    values : (..., levels, n) not negative, at the known heights of the plane
    planes : (levels,) [m] these heights, in descending order
    moved : (levels, n) [m] rise of the plane of each level at each column

    Returns (..., levels, n), constant above the highest plane, extrapolated below the lowest, never negative. With a
    single plane the values are returned unchanged. Raises ParameterError for planes that do not descend.
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
