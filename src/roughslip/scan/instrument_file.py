"""Files of scans: instruments' formats by SurfaceTopography, netCDF maps and text.

Each error is one InputError line that names the file. SurfaceTopography (Roettger et al., Surface Topography: Metrology
and Properties 10, 2022, 035032) is imported in this module alone, where a file needs it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import netCDF4
import numpy as np

from roughslip.errors import InputError
from roughslip.scan.text_table import METRES, HasHeader, read_table
from roughslip.scan.topography import Topography, topography
from roughslip.validation import gate

MOST_POINTS = 2**23  # statistics of so many points take some 2 GB
MOST_LISTED = 8
TEXT = (".txt", ".csv", ".tsv", ".dat", ".asc", ".prn", ".xyz")
ARRAYS = ("h5", "mat", "npz")  # formats of named arrays, which say nothing of what they hold
NAMES = ("heights", "height", "topography", "z")  # of the channel of heights among several, in any case of letters


@dataclass(frozen=True)
class Stated:
    """What a scene states where the file does not give it. unit : of the heights; spacing : (dx, dy) [m]"""

    unit: str | None
    spacing: tuple[float, float] | None


@dataclass(frozen=True)
class Reading:
    """What a file holds.

    heights : (nx, ny) [m], nan where there is none
    spacing : (dx, dy) [m]
    words : the channel, its unit and how it is written
    """

    heights: np.ndarray
    spacing: tuple[float, float]
    words: str


@gate
def read_scan(path: Path | str, spacing: tuple[float, float] | None = None, unit: str | None = None) -> Topography:
    """Read a scan from a file.

    path : an instrument's file in any format that SurfaceTopography reads; a `.nc` map; text, such as `.txt` or `.csv`
    spacing : (dx, dy) [m] distances of neighbouring points, where the file does not give them
    unit : unit of the heights, a key of METRES, where the file does not give it

    Text without a header is a matrix, a row for each y, or points x, y, z. Values in the file cannot be replaced. Of
    several channels the one of heights is that whose name is one of NAMES, else the first of an instrument; named
    arrays are then refused. `read` of the scan says what was.

    Raises InputError where the file is no scan or gives too little, in a line that names the key of a scene that helps.
    """
    path = Path(path)
    if unit is not None and unit not in METRES:
        raise InputError(f"{path}: heights stated in {unit!r}, an unknown unit; allowed are {', '.join(METRES)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; a scan is a file of an instrument, a .nc map or a .txt matrix")
    reading = _read(path, Stated(unit, spacing))
    scan = topography(reading.heights, *reading.spacing, str(path), reading.words)
    deviation, diagonal = float(np.std(scan.heights)), math.hypot(scan.grid.nx * scan.dx, scan.grid.ny * scan.dy)
    if not deviation < diagonal:
        raise InputError(
            f"{path}: heights scatter by {deviation:.3g} m over a scan of {diagonal:.3g} m; they must scatter by less "
            f"than its length; they go from {np.min(scan.heights):.4g} to {np.max(scan.heights):.4g} m: check the "
            "units, and that neither end stands for missing points"
        )
    return scan


def _read(path: Path, stated: Stated) -> Reading:
    suffix = path.suffix.lower()
    if suffix == ".nc":
        return _read_netcdf(path, stated)
    with path.open("rb") as file:
        start = file.read(4096)
    if not start:
        raise InputError(f"{path}: empty; export it again")
    if suffix in TEXT and (start.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" not in start):
        try:
            return _read_text(path, stated)
        except HasHeader as header:
            return _read_instrument(path, stated, start, header)
    return _read_instrument(path, stated, start)


def _settled(
    path: Path, unit: str | None, spacing: tuple[float, float] | None, stated: Stated, hint: str = ""
) -> tuple[str, tuple[float, float]]:
    """Unit of heights and spacing [m]: each of the file or of the scene, of one of them alone.

    unit, spacing : in the file
    hint : goes with what is missing. Raises InputError with all that is missing or twice there.
    """
    rows = (
        ("unit of heights", "roughness.scan.height_unit", unit, stated.unit),
        ("spacing", "roughness.scan.spacing_m", spacing, stated.spacing),
    )
    wrong = [
        f"the file gives its {what}, {own}; remove {key} = {said}" for what, key, own, said in rows if own and said
    ]
    absent = [(what, key) for what, key, own, said in rows if not own and not said]
    if absent:
        what, keys = (" and ".join(names) for names in zip(*absent, strict=True))
        wrong.append(f"the file does not give its {what}; set {keys}{hint}")
    unit, spacing = unit or stated.unit, spacing or stated.spacing
    if wrong or unit is None or spacing is None:
        raise InputError(f"{path}: {'; '.join(wrong)}")
    return unit, spacing


def _metres(path: Path, unit: str) -> float:
    """One of that unit [m]."""
    if unit not in METRES:
        raise InputError(
            f"{path}: values in {unit!r}, which is not a unit of length: allowed are {', '.join(METRES)}; "
            "export heights as a length"
        )
    return METRES[unit]


def _check_points(path: Path, shape: tuple[int, ...]) -> None:
    """Refuses heights of that shape that are no map, or one of more than MOST_POINTS."""
    if len(shape) != 2:
        raise InputError(f"{path}: holds {len(shape)}-dimensional heights; a map of heights has two dimensions")
    if math.prod(shape) > MOST_POINTS:
        smaller = "export a part of the scan, or every second point"
        raise InputError(f"{path}: {shape[0]} x {shape[1]} points; at most {MOST_POINTS} are read: {smaller}")


def _damaged(path: Path, error: Exception) -> InputError:
    reason = (str(error).strip().splitlines() or ["no reason given"])[0][:200]
    return InputError(f"{path}: truncated or damaged ({type(error).__name__}: {reason}); export it again")


def _read_text(path: Path, stated: Stated) -> Reading:
    table = read_table(path)
    _check_points(path, table.values.shape)
    spacing, hint = None, ""
    if table.steps is not None:
        hint = f" (its points lie {table.steps[0]:.4g} x {table.steps[1]:.4g} apart, in a unit that it does not give)"
        if len(table.units) == 3:
            spacing = table.steps[0] * METRES[table.units[0]], table.steps[1] * METRES[table.units[1]]
        elif stated.spacing is not None:
            ratio = stated.spacing[0] * table.steps[1] / (stated.spacing[1] * table.steps[0])
            if not math.isclose(ratio, 1.0, rel_tol=0.01):
                said = f"{stated.spacing[0]:.4g} x {stated.spacing[1]:.4g} m"
                raise InputError(f"{path}: the stated spacing of {said} has another ratio than the file{hint}")
    unit, spacing = _settled(path, table.units[-1] if table.units else None, spacing, stated, hint)
    return Reading(table.values * METRES[unit], spacing, f"{table.words}, heights in {unit}")


def _read_netcdf(path: Path, stated: Stated) -> Reading:
    """A variable `heights(x, y)` with attribute `units`, and coordinates x, y with theirs.

    `mask`, where there is one, is 1 at missing points. SurfaceTopography calls the attributes `unit`.
    """
    try:
        with netCDF4.Dataset(path) as file:
            if "heights" not in file.variables:
                raise InputError(f"{path}: no variable heights; it has {', '.join(file.variables) or 'none'}")
            heights = file.variables["heights"]
            if sorted(heights.dimensions) != ["x", "y"]:
                raise InputError(f"{path}: heights over {', '.join(heights.dimensions)}; a map is over x and y")
            _check_points(path, heights.shape)
            axes = [file.variables[axis] for axis in "xy" if axis in file.variables]
            steps = [_step(path, axis) for axis in axes]
            spacing = (steps[0], steps[1]) if len(steps) == 2 else None
            unit, spacing = _settled(path, _unit(heights), spacing, stated)
            values = np.ma.filled(np.ma.asarray(heights[:], dtype=np.float64), np.nan) * _metres(path, unit)
            if "mask" in file.variables:
                values[np.ma.filled(file.variables["mask"][:], 1) != 0] = np.nan
            values = values if heights.dimensions == ("x", "y") else values.T
    except (OSError, RuntimeError, ValueError, TypeError, IndexError) as error:
        raise _damaged(path, error) from error
    return Reading(values, spacing, f"variable 'heights' in {unit}")


def _unit(variable: netCDF4.Variable) -> str | None:
    return next((str(getattr(variable, name)) for name in ("units", "unit") if name in variable.ncattrs()), None)


def _step(path: Path, axis: netCDF4.Variable) -> float:
    """[m] between neighbouring points of an axis."""
    unit = _unit(axis)
    if axis.ndim != 1 or len(axis) < 2 or unit is None:
        raise InputError(f"{path}: coordinate {axis.name} needs at least two points and an attribute 'units'")
    steps = np.diff(np.asarray(axis[:], dtype=np.float64)) * _metres(path, unit)
    if not (steps[0] > 0.0 and np.allclose(steps, steps[0], rtol=1e-3, atol=0.0)):
        raise InputError(
            f"{path}: coordinate {axis.name} does not increase in equal steps; a scan has one spacing an axis"
        )
    return float(np.mean(steps))


def _library(path: Path) -> ModuleType:
    try:
        import SurfaceTopography  # for instrument files alone: its import takes two seconds
    except ImportError as error:
        install = "install it with: pip install 'roughslip[scans]'"
        raise InputError(f"{path}: files of instruments need SurfaceTopography; {install}") from error
    return SurfaceTopography


def _read_instrument(path: Path, stated: Stated, start: bytes, header: HasHeader | None = None) -> Reading:
    """Heights of an instrument's file. A reader of such files can fail in any way on a damaged one.

    start : the first bytes. A reader that they prove reports the damage of a file; trying all readers hides it
    header : the error of text with a header, raised where no reader knows the header
    """
    library = _library(path)
    proven = [reader for reader in library.IO.readers if reader.can_read(start[:512]) is library.IO.MagicMatch.YES]
    try:
        with library.open_topography(path, format=proven[0].format() if len(proven) == 1 else None) as reader:
            if reader.format() == "hgt":  # radar maps of the Earth: the reader accepts any file of 2 n^2 bytes
                raise library.IO.CannotDetectFileFormat("no signature")
            channel, words = _channel(path, reader.channels, named=reader.format() in ARRAYS)
            _check_points(path, channel.nb_grid_pts)
            unit, spacing = _settled(path, channel.unit, _spacing(channel), stated)
            sizes = {} if channel.physical_sizes is not None else {"physical_sizes": (1.0, 1.0)}
            heights = channel.topography(**sizes).heights()
    except InputError:
        raise
    except library.IO.CannotDetectFileFormat as error:
        known = "allowed are instrument files, .nc and text such as .txt and .csv"
        raise header or InputError(f"{path}: unknown format, or damaged; {known}") from error
    except Exception as error:
        if "unit" in str(error).lower():
            raise InputError(f"{path}: no unit of length for heights or distances ({error}); export lengths") from error
        raise _damaged(path, error) from error
    heights = np.ma.filled(np.ma.asarray(heights, dtype=np.float64), np.nan) * _metres(path, unit)
    return Reading(heights.T if start.startswith(b"MATLAB 7.3") else heights, spacing, f"{words} in {unit}")


def _channel(path: Path, channels: Sequence[Any], *, named: bool) -> tuple[Any, str]:
    """The channel of heights, and which it is in words. named : whether channels are arrays that may be anything"""
    maps = [channel for channel in channels if channel.is_height_channel and min(channel.nb_grid_pts) > 1]
    listed = ", ".join(channel.name for channel in (maps or channels)[:MOST_LISTED])
    if not maps:
        raise InputError(f"{path}: no channel of heights; it has {listed or 'no channel'}; export heights, as a length")
    chosen = [channel for channel in maps if channel.name.rpartition("/")[2].strip().lower() in NAMES]
    if named and len(maps) > 1 and len(chosen) != 1:
        raise InputError(f"{path}: {listed} can be the heights; export them alone, or call them heights")
    others = f" of {len(maps)} with heights ({listed})" if len(maps) > 1 else ""
    channel = chosen[0] if len(chosen) == 1 else maps[0]
    return channel, f"channel '{channel.name}'{others}"


def _spacing(channel: Any) -> tuple[float, float] | None:
    """(dx, dy) [m] that the file gives; None without a unit. A text header may have one for x alone."""
    unit = channel.unit or channel.info.get("raw_metadata", {}).get("xunit")
    if channel.pixel_size is None or unit not in METRES:
        return None
    dx, dy = channel.pixel_size
    return float(dx) * METRES[unit], float(dy) * METRES[unit]
