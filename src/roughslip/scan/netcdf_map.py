"""NetCDF maps: a variable of heights over x and y with units, and coordinates with theirs."""

from __future__ import annotations

from pathlib import Path

import netCDF4
import numpy as np

from roughslip.errors import InputError
from roughslip.scan.limits import check_points, first_line
from roughslip.scan.reading import Reading, array_of_heights, metres, settled


def read_netcdf(path: Path, spacing: tuple[float, float] | None, unit: str | None, wanted: str | None) -> Reading:
    """A variable `heights(x, y)` with attribute `units`, and coordinates x, y with theirs.

    The variable may have another name that `array_of_heights` chooses. `mask` is 1 at missing points.
    """
    try:
        with netCDF4.Dataset(path) as file:
            numbers = {
                name: variable.shape
                for name, variable in file.variables.items()
                if name not in ("mask", "x", "y") and variable.dtype is not str and variable.dtype.kind in "iuf"
            }
            if "heights" in numbers:
                check_points(path, numbers["heights"])
            name = array_of_heights(path, numbers, wanted=wanted)
            heights = file.variables[name]
            check_points(path, heights.shape)
            if sorted(heights.dimensions) != ["x", "y"]:
                raise InputError(f"{path}: {name} over {', '.join(heights.dimensions)}; a map is over x and y")
            axes = [file.variables[axis] for axis in "xy" if axis in file.variables]
            for other in (*axes, *(file.variables[own] for own in ("mask",) if own in file.variables)):
                _check_shape(path, other, heights)
            steps = [_spacing(path, axis) for axis in axes]
            stored = (steps[0], steps[1]) if len(steps) == 2 else None
            unit, spacing = settled(path, (_units(heights), stored), (unit, spacing))
            scale = metres(path, unit)
            values = np.ma.filled(np.ma.asarray(heights[:], dtype=np.float64), np.nan)
            if "mask" in file.variables:  # of missing points, as SurfaceTopography writes it
                values[np.ma.filled(file.variables["mask"][:], 1) != 0] = np.nan
            values = values if heights.dimensions == ("x", "y") else values.T
    except (OSError, RuntimeError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{path}: truncated or not netCDF ({first_line(error)}); export it again") from error
    return Reading(values * scale, spacing, f"variable '{name}' in {unit}")


def _check_shape(path: Path, other: netCDF4.Variable, heights: netCDF4.Variable) -> None:
    """Refuse coordinates and masks of another shape than the heights, before they are read."""
    points = {axis: heights.shape[heights.dimensions.index(axis)] for axis in "xy"}
    wanted = heights.shape if other.name == "mask" else (points[other.name],)
    if other.shape != wanted:
        raise InputError(
            f"{path}: {other.name} has the shape {other.shape}; heights of {heights.shape} go with {wanted}"
        )


def _units(variable: netCDF4.Variable) -> str | None:
    """Attribute `units`, or `unit` as SurfaceTopography writes it."""
    units = next((getattr(variable, name) for name in ("units", "unit") if hasattr(variable, name)), None)
    return None if units is None else str(units)


def _spacing(path: Path, axis: netCDF4.Variable) -> float:
    if axis.ndim != 1 or len(axis) < 2 or _units(axis) is None:
        raise InputError(f"{path}: coordinate {axis.name} needs at least two points and an attribute 'units'")
    steps = np.diff(np.asarray(axis[:], dtype=np.float64)) * metres(path, str(_units(axis)))
    if not (steps[0] > 0.0 and np.allclose(steps, steps[0], rtol=1e-3, atol=0.0)):
        raise InputError(
            f"{path}: coordinate {axis.name} does not increase in equal steps; a scan has one spacing an axis"
        )
    return float(np.mean(steps))
