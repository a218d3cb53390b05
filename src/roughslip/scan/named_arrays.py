"""Files of named arrays, which say nothing of what they hold: HDF5, MATLAB and numpy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import scipy

from roughslip.errors import InputError
from roughslip.scan.limits import check_points, first_line
from roughslip.scan.matlab import check_matlab
from roughslip.scan.reading import Reading, array_of_heights, metres, settled

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
        check_matlab(path)
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
