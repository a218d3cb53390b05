"""What readers of scans share: units, the choice of an array, and what the file or else the scene gives.

Sizes and links of files are checked before heights are read. Each check raises InputError with a line that names the
file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from roughslip.errors import InputError

MOST_POINTS = 2**23  # statistics of so many points take some 2 GB
MOST_BYTES = 2**29
# [bytes] The library of the instruments' formats takes some thirty times as much for text with a header.
MOST_TEXT = 2**26
SMALLER = "export a part of the scan, or every second point"


def check_size(path: Path) -> None:
    """Refuses a file of more than MOST_BYTES."""
    if path.stat().st_size > MOST_BYTES:
        raise InputError(
            f"{path}: {path.stat().st_size / 1e6:.0f} MB; at most {MOST_BYTES / 1e6:.0f} MB are read: {SMALLER}"
        )


def check_text(path: Path) -> None:
    """Refuses text, a file that begins without a zero byte, of more than MOST_TEXT."""
    with path.open("rb") as file:
        is_text = b"\0" not in file.read(4096)
    if is_text and path.stat().st_size > MOST_TEXT:
        raise InputError(
            f"{path}: {path.stat().st_size / 1e6:.0f} MB of text; at most {MOST_TEXT / 1e6:.0f} MB are read: {SMALLER}"
        )


def check_points(path: Path, shape: tuple[int, ...]) -> None:
    """Refuses heights of that shape that are no map, or one of more than MOST_POINTS."""
    if len(shape) != 2:
        raise InputError(f"{path}: holds {len(shape)}-dimensional heights; a map of heights has two dimensions")
    if math.prod(shape) > MOST_POINTS:
        raise InputError(f"{path}: {shape[0]} x {shape[1]} points; at most {MOST_POINTS} are read: {SMALLER}")


def check_hdf5(path: Path) -> None:
    """Refuses HDF5 and netCDF-4 files with links or external values."""
    if not h5py.is_hdf5(path):
        return
    refused: list[str] = []

    def look_at_link(name: str, link: object) -> None:
        if not isinstance(link, h5py.HardLink):
            refused.append(f"{name} is a link")

    def look_at(name: str, part: h5py.Group | h5py.Dataset) -> None:
        if isinstance(part, h5py.Dataset) and (part.is_virtual or part.external):
            refused.append(f"{name} has its values elsewhere")

    try:
        with h5py.File(path) as file:
            file.visititems_links(look_at_link)
            if not refused:
                file.visititems(look_at)
    except (OSError, RuntimeError, ValueError, TypeError, KeyError) as error:
        raise InputError(f"{path}: truncated or damaged ({first_line(error)}); export it again") from error
    if refused:
        raise InputError(f"{path}: {refused[0]}; export the heights alone, into a file of their own")


def first_line(error: Exception) -> str:
    """The message of an error of a library, on one line."""
    return (str(error).strip().splitlines() or ["no reason given"])[0][:200]


METRES = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "μm": 1e-6, "um": 1e-6, "nm": 1e-9, "Å": 1e-10, "pm": 1e-12}
KEYS = {
    "unit of heights": "roughness.scan.height_unit",
    "spacing": "roughness.scan.spacing_m",
}
"""What a scene states where the file does not give it."""

NAMES = ("heights", "height", "topography", "z")  # of the array of heights among several, in any case of letters
MOST_LISTED = 8
ARRAY_KEY = "roughness.scan.array"


@dataclass(frozen=True)
class Reading:
    """What a file holds.

    heights : (nx, ny) [m], nan where there is none
    spacing : (dx, dy) [m]
    words : the array or channel, its unit and how it is written
    """

    heights: np.ndarray
    spacing: tuple[float, float]
    words: str


def settled(
    path: Path,
    in_file: tuple[str | None, tuple[float, float] | None],
    stated: tuple[str | None, tuple[float, float] | None],
    hint: str = "",
) -> tuple[str, tuple[float, float]]:
    """Unit of heights and spacing [m]: each of the file or of the scene, of one of them alone.

    hint : goes with what is missing. Raises InputError with all that is missing or twice there.
    """
    rows = list(zip(KEYS.items(), in_file, stated, strict=True))
    wrong = [
        f"the file gives its {what}, {own}; remove {key} = {said}" for (what, key), own, said in rows if own and said
    ]
    absent = [item for item, own, said in rows if not own and not said]
    if absent:
        keys = " and ".join(key for _, key in absent)
        wrong.append(f"the file does not give its {' and its '.join(what for what, _ in absent)}; set {keys}{hint}")
    unit, spacing = in_file[0] or stated[0], in_file[1] or stated[1]
    if wrong or unit is None or spacing is None:
        raise InputError(f"{path}: {'; '.join(wrong)}")
    return unit, spacing


def metres(path: Path, unit: str) -> float:
    """One of that unit [m]."""
    if unit not in METRES:
        raise no_length(path, unit)
    return METRES[unit]


def no_length(path: Path, unit: str) -> InputError:
    """The error for values in such a unit."""
    return InputError(
        f"{path}: values in {unit!r}, which is not a unit of length: allowed are {', '.join(METRES)}; "
        "export heights as a length"
    )


def array_of_heights(
    path: Path, arrays: Mapping[str, tuple[int, ...]], other: Mapping[str, str] | None = None, wanted: str | None = None
) -> str:
    """The name of the array of heights: the wanted one, else the only map, else the only one with one of NAMES.

    arrays : shapes by name; what has no two dimensions of at least two numbers is no map
    other : of arrays that hold no real numbers, what they hold
    """
    maps = {name: shape for name, shape in arrays.items() if len(shape) == 2 and min(shape) > 1}
    if not maps:
        held = _list(arrays, other or {}) or "no array"
        raise InputError(f"{path}: holds no array of numbers with two dimensions; it has {held}")
    if wanted is not None and wanted not in maps:
        raise InputError(f"{path}: no map of heights is named '{wanted}' ({ARRAY_KEY}); it has {_list(maps)}")
    maps = {name: shape for name, shape in maps.items() if name == wanted} or maps
    chosen = by_name(maps) if len(maps) > 1 else list(maps)
    if len(chosen) != 1:
        listed = _list({name: maps[name] for name in chosen or maps})
        raise InputError(f"{path}: {listed} can be the heights; name one of them in {ARRAY_KEY}")
    return chosen[0]


def by_name(names: Iterable[str]) -> list[str]:
    """Those that are one of NAMES; a name in a group counts by its last part."""
    return [name for name in names if name.rpartition("/")[2].strip().lower() in NAMES]


def _list(arrays: Mapping[str, tuple[int, ...]], other: Mapping[str, str] | None = None) -> str:
    names = [f"'{name}' ({' x '.join(map(str, shape))})" for name, shape in arrays.items()]
    names += [f"'{name}' ({kind})" for name, kind in (other or {}).items()]
    more = [f"{len(names) - MOST_LISTED} more"] if len(names) > MOST_LISTED else []
    return ", ".join([*names[:MOST_LISTED], *more])
