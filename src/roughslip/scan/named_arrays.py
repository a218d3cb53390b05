"""Files of named arrays: HDF5, MATLAB and numpy, which say nothing of what they hold, and netCDF maps with units."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import scipy

from roughslip.errors import InputError
from roughslip.scan.reading import Reading, array_of_heights, check_points, first_line, metres, settled

ARRAYS = (".h5", ".hdf5", ".mat", ".npz", ".npy")
# Classes of numbers in MATLAB files; truth values are masks.
_CLASSES = {"double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}

Found = tuple[dict[str, tuple[int, ...]], dict[str, str], Callable[[str], np.ndarray]]


def read_arrays(path: Path, spacing: tuple[float, float] | None, unit: str | None, wanted: str | None) -> Reading:
    """The array that `array_of_heights` chooses, (nx, ny), x along its first index.

    An array `mask` of its shape is not zero at missing points, as in numpy; so is the attribute `_FillValue` of HDF5
    equal to heights that are none.
    """
    try:
        arrays, other, read = _opened(path)
        name = array_of_heights(path, arrays, other, wanted)
        check_points(path, arrays[name])
        values = np.asarray(read(name))
        mask = f"{name.rpartition('/')[0]}/mask".lstrip("/")
        missing = np.asarray(read(mask)) != 0 if mask in arrays | other and mask != name else np.zeros((), dtype=bool)
    except InputError:
        raise
    except Exception as error:  # a reader can fail in any way on a damaged file
        reason = f"{type(error).__name__}: {first_line(error)}"
        raise InputError(f"{path}: truncated or damaged ({reason}); export it again") from error
    if missing.ndim and missing.shape != values.shape:
        raise InputError(f"{path}: mask has the shape {missing.shape}, '{name}' {values.shape}; they must be the same")
    unit, spacing = settled(path, (None, None), (unit, spacing))
    heights = np.where(missing, np.nan, values.astype(np.float64) * metres(path, unit))
    return Reading(heights, spacing, f"array '{name}'{' less its mask' if missing.ndim else ''} in {unit}")


def _opened(path: Path) -> Found:
    """Shapes of arrays of real numbers by name, kinds of all others, and what reads one of them."""
    shapes: dict[str, tuple[int, ...]] = {}
    other: dict[str, str] = {}

    def note(name: str, array: h5py.Dataset | np.ndarray) -> None:
        kind = array.dtype.kind
        if kind in "iuf":
            shapes[name] = array.shape
        else:
            other[name] = {"b": "truth values", "c": "complex numbers"}.get(kind, "no numbers")

    if h5py.is_hdf5(path):
        # MATLAB's HDF5 files hold transposed arrays
        turned = path.suffix.lower() == ".mat"

        def read(name: str) -> np.ndarray:
            with h5py.File(path) as file:
                values, fill = file[name][()], file[name].attrs.get("_FillValue")
            values = values if fill is None else np.where(values == fill, np.nan, values)
            return values.T if turned else values

        with h5py.File(path) as file:
            file.visititems(lambda name, part: note(name, part) if isinstance(part, h5py.Dataset) else None)
        return {name: shape[::-1] if turned else shape for name, shape in shapes.items()}, other, read
    if path.suffix.lower() == ".mat":
        for name, shape, kind in scipy.io.whosmat(path):
            if kind in _CLASSES:
                shapes[name] = shape
            else:
                other[name] = "truth values" if kind == "logical" else "no numbers"
        return shapes, other, lambda name: _real(path, scipy.io.loadmat(path, variable_names=[name])[name])

    def of_numpy(name: str) -> np.ndarray:
        with path.open("rb") as file:
            loaded = np.load(file, allow_pickle=False)
            return loaded if isinstance(loaded, np.ndarray) else loaded[name]

    with path.open("rb") as file:
        loaded = np.load(file, allow_pickle=False)
        for name in (path.stem,) if isinstance(loaded, np.ndarray) else loaded.files:
            try:
                note(name, loaded if isinstance(loaded, np.ndarray) else loaded[name])
            except ValueError:  # objects, which are not unpacked
                other[name] = "no numbers"
    return shapes, other, of_numpy


def _real(path: Path, values: np.ndarray) -> np.ndarray:
    if np.iscomplexobj(values):
        raise InputError(f"{path}: complex numbers; export heights, their real part")
    return values


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
